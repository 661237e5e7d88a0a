"""What the links of the URDF have for engines of others: mass everywhere, and what they touch with.

*Beads.* A link between two segments has no mass, for which engines guess 1 kg, or which they
refuse. It gets a bead in the centre of the joint that it is a part of. That is a fixed point of the
segment behind the joint, and the bead's mass is taken from the segment there: mass and torques stay
what they are, but for the bead's own inertia, and for what the translations of the pelvis leave
behind. Both are below 1e-7 of the peak of each torque.

*Corners.* PyBullet ignores the inertia of a file, unless it is told otherwise, and takes that of
the box around all collision shapes of a link. Two specks in opposite corners of the box that has
the segment's inertia make it the right one. They are too small to meet those of other segments.

*Soles.* A ball on each contact point of the feet, of which the point is the lowest, on a link of
its own. Soles of one piece would meet where one foot passes the other.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body import skeleton
from human_gait.body.dh import joint_origins, link_to_dh
from human_gait.body.joints import segment_joints
from human_gait.body.links import anatomical_to_link
from human_gait.body.person import Body
from human_gait.body.urdf import LINK_NAMES, add_fixed, add_inertial, numbers, roll_pitch_yaw

BEAD_MASS, BEAD_INERTIA = 1e-9, 1e-11
"""Of a bead: mass [kg], inertia about each axis [kg m^2]."""

SOLE_RADIUS = 0.005
"""Of the balls that touch the floor, [m]."""

_STILL = 1e-12  # mass of the base, which never moves, [kg]
_SPECK = 5e-4  # radius, [m]
_MARGIN = 1e-3  # that PyBullet adds around the shapes of a URDF, [m]
_UPRIGHT = 1e-6  # axes are principal if products of inertia are below this share of the trace
_LOAD, _WORLD, _BASE = "backpack", "world", "base_link"
_DRAKE = "drake"  # the prefix of Drake's own elements


@dataclass(frozen=True, eq=False)
class _Mass:
    """A mass [kg], its centre (3,) [m] and its inertia about that (3, 3) [kg m^2], in a link."""

    mass: float
    com: FloatArray
    inertia: FloatArray

    def without_beads(self, places: list[FloatArray]) -> _Mass:
        """Return what is left if beads are taken at places in the link."""
        left, first = self.mass - BEAD_MASS * len(places), self.mass * self.com
        about_origin = self.inertia + self.mass * _spread(self.com)
        for place in places:
            first = first - BEAD_MASS * place
            about_origin = about_origin - BEAD_INERTIA * np.eye(3) - BEAD_MASS * _spread(place)
        com = first / left
        return _Mass(left, com, about_origin - left * _spread(com))

    def principal(self) -> tuple[FloatArray, FloatArray]:
        """Return moments (3,) and axes (3, 3), by columns, as near those of the link as can be."""
        moments, axes = np.diag(self.inertia), np.eye(3)
        if np.abs(self.inertia - np.diag(moments)).max() < _UPRIGHT * moments.sum():
            return moments, axes
        moments, found = np.linalg.eigh(self.inertia)
        order = np.abs(found).argmax(axis=1)
        axes = found[:, order] * np.sign(np.diag(found[:, order]))
        return moments[order], axes


def _spread(r: FloatArray) -> FloatArray:
    """Return the inertia (3, 3) about the origin of a unit mass at r (3,): r.r - r r^T."""
    return np.asarray((r @ r) * np.eye(3) - np.outer(r, r))


def complete_links(robot: ET.Element, body: Body, friction: float) -> None:
    """Give the links of a body's URDF beads, corners and soles, with a coefficient of friction."""
    links = {str(link.get("name")): link for link in robot.iter("link")}
    _add_base(robot)
    origins, to_dh = joint_origins(body.table), link_to_dh(body.table)
    for joint in segment_joints(body):
        *between, segment = joint.dofs
        centre, fixed = np.zeros(3), _fixed_beads(robot, links, body, segment, friction)
        for i, below in zip(between[::-1], joint.dofs[:0:-1], strict=True):
            centre = origins[below, :3, :3] @ centre + origins[below, :3, 3]
            _add_bead(links[LINK_NAMES[i]], centre)
        turn, mass = to_dh[segment, :3, :3], float(body.mass[segment])
        com = turn @ body.com[segment] + to_dh[segment, :3, 3]
        whole = _Mass(mass, com, turn @ body.inertia[segment] @ turn.T)
        _put(links[LINK_NAMES[segment]], whole.without_beads([np.zeros(3)] * len(between) + fixed))
    if _LOAD in links and body.load.model == "rigid":
        place = anatomical_to_link(body.table)[skeleton.SEGMENTS["thorax"], :3, :3]
        _put(links[_LOAD], _Mass(body.load.mass, np.zeros(3), place.T @ body.load_inertia @ place))


def _add_bead(link: ET.Element, centre: FloatArray) -> None:
    add_inertial(link, BEAD_MASS, centre, BEAD_INERTIA * np.eye(3))


def _add_base(robot: ET.Element) -> None:
    """Hang the tree on a link of the usual name, where libraries start, and that on the world."""
    base = add_fixed(robot, _BASE, _WORLD, np.eye(4))
    add_inertial(base, _STILL, np.zeros(3), BEAD_INERTIA * np.eye(3))
    for joint in robot.iter("joint"):
        for parent in joint.iter("parent"):
            if parent.get("link") == _WORLD and joint.get("type") != "fixed":
                parent.set("link", _BASE)


def _fixed_beads(
    robot: ET.Element, links: Mapping[str, ET.Element], body: Body, segment: int, friction: float
) -> list[FloatArray]:
    """Add the beads of links that are fixed to a segment, and return where they are in its link."""
    to_dh = link_to_dh(body.table)[segment]
    if segment == skeleton.SEGMENTS["thorax"] and _LOAD in links and body.load.model == "force":
        _add_bead(links[_LOAD], np.zeros(3))  # a force has no mass, and is drawn
        return [to_dh[:3, :3] @ body.load_com + to_dh[:3, 3]]
    points = body.contact.points[body.contact.links == segment]
    if not len(points):
        return []
    sole = add_fixed(robot, f"sole_{LINK_NAMES[segment][4:]}", LINK_NAMES[segment], np.eye(4))
    _add_bead(sole, np.zeros(3))
    up = (to_dh @ anatomical_to_link(body.table)[segment])[:3, 1]
    for point in points:
        centre = to_dh[:3, :3] @ point + to_dh[:3, 3] + SOLE_RADIUS * up
        _add_friction(_add_ball(sole, centre, SOLE_RADIUS), friction)
    contact = ET.SubElement(sole, "contact")  # PyBullet's own
    ET.SubElement(contact, "lateral_friction", value=numbers([friction]))
    return [np.zeros(3)]


def _put(link: ET.Element, what: _Mass) -> None:
    """Write a mass into a link in the place of what is there, with the corners of its box."""
    for old in link.findall("inertial"):
        link.remove(old)
    moments, axes = what.principal()
    tensor = what.inertia if np.array_equal(axes, np.eye(3)) else np.diag(moments)
    add_inertial(link, what.mass, what.com, tensor, roll_pitch_yaw(axes))
    edges = np.sqrt(6.0 * np.maximum(moments.sum() - 2.0 * moments, 0.0) / what.mass)
    corner = axes @ np.maximum(edges / 2 - _SPECK - _MARGIN, 0.0)
    for sign in (1.0, -1.0):
        _add_ball(link, what.com + sign * corner, _SPECK)


def _add_ball(link: ET.Element, centre: FloatArray, radius: float) -> ET.Element:
    collision = ET.SubElement(link, "collision")
    ET.SubElement(collision, "origin", xyz=numbers(centre), rpy="0 0 0")
    ball = ET.SubElement(ET.SubElement(collision, "geometry"), "sphere")
    ball.set("radius", numbers([radius]))
    return collision


def _add_friction(collision: ET.Element, friction: float) -> None:
    """Add the coefficient as Drake has it: it is no part of URDF."""
    properties = ET.SubElement(collision, f"{_DRAKE}:proximity_properties")
    for kind in ("static", "dynamic"):
        ET.SubElement(properties, f"{_DRAKE}:mu_{kind}", value=numbers([friction]))
