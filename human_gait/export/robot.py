"""The body as URDF for programs of others: physics engines, kinematics libraries, parsers.

The package's own URDF (`urdf.urdf_text`) has a moving link for each degree of freedom, most of them
without mass, and marks every DH frame. Engines guess the mass of such links (1 kg) or refuse them;
libraries that follow the first child end at a mark. The file for others has no marks, and every
link without mass has a bead.

A bead sits in the centre of the joint that its link is a part of. That is a fixed point of the
segment behind the joint, and the bead's mass is taken from the segment there: mass and torques stay
what they are, but for the bead's own inertia, and for what the translations of the pelvis leave
behind. Both are below 1e-6 of the peak of each torque.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body import skeleton
from human_gait.body.dh import joint_origins, link_to_dh
from human_gait.body.joints import segment_joints
from human_gait.body.links import anatomical_to_link
from human_gait.body.person import Body
from human_gait.body.urdf import (
    JOINT_NAMES,
    LINK_NAMES,
    add_inertial,
    numbers,
    roll_pitch_yaw,
)
from human_gait.export.notes import Note
from human_gait.export.ranges import JointRanges
from human_gait.scenario import Ground

BEAD_MASS, BEAD_INERTIA = 1e-6, 1e-11
"""Of a link between two segments: mass [kg], inertia about each axis [kg m^2]."""

_WORDS = (
    "axes: x left, y up, z forward; gravity is no part of URDF: (0, -9.81, 0) m/s^2 here",
    f"links between two segments have {BEAD_MASS:g} kg each, taken from the segment behind them",
)
_DRAKE = "drake"  # the prefix of Drake's own elements
_LOAD = "backpack"


def robot_text(
    body: Body, ranges: JointRanges, friction: float = Ground.friction, note: Note | None = None
) -> str:
    """Return the URDF of a body for other programs.

    Parameters
    ----------
    body : Body
    ranges : JointRanges
        What stands in the limits of the joints.
    friction : float
        Coefficient between sole and floor.
    note : Note, optional
        What the file is made from.
    """
    robot = ET.fromstring(body.urdf)
    robot.set(f"xmlns:{_DRAKE}", "http://drake.mit.edu")
    robot.insert(0, ET.Comment((note or Note()).xml([*_WORDS, *ranges.words])))
    _remove_marks(robot)
    links = {str(link.get("name")): link for link in robot.iter("link")}
    _add_beads(links, body)
    _add_soles(links, body, friction)
    joints = {str(joint.get("name")): joint for joint in robot.iter("joint")}
    for i, name in enumerate(JOINT_NAMES):
        for limit in joints[name].iter("limit"):
            limit.attrib.update(_limits(ranges, i))
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode") + "\n"


def _limits(ranges: JointRanges, i: int) -> dict[str, str]:
    names = ("lower", "upper", "effort", "velocity")
    return {name: numbers([getattr(ranges, name)[i]]) for name in names}


def _remove_marks(robot: ET.Element) -> None:
    """Remove the massless fixed links of the DH frames, and their joints."""
    for element in list(robot):
        if str(element.get("name")).removeprefix("fixed_").startswith("dh_"):
            robot.remove(element)


def _add_beads(links: Mapping[str, ET.Element], body: Body) -> None:
    """Give every link without mass a bead, and take it from its segment."""
    origins, to_dh = joint_origins(body.table), link_to_dh(body.table)
    thorax, force = skeleton.SEGMENTS["thorax"], body.load.model == "force"
    for joint in segment_joints(body):
        *between, segment = joint.dofs
        centre = np.zeros(3)
        beads = [centre] * len(between)
        for i, below in zip(between[::-1], joint.dofs[::-1], strict=False):
            centre = origins[below, :3, :3] @ centre + origins[below, :3, 3]
            _add_bead(links[LINK_NAMES[i]], centre)
        if segment == thorax and force and _LOAD in links:  # which is no mass, and is drawn
            _add_bead(links[_LOAD], np.zeros(3))
            beads.append(to_dh[thorax, :3, :3] @ body.load_com + to_dh[thorax, :3, 3])
        _take_beads(links[LINK_NAMES[segment]], body, segment, beads)


def _add_bead(link: ET.Element, centre: FloatArray) -> None:
    add_inertial(link, BEAD_MASS, centre, BEAD_INERTIA * np.eye(3))


def _take_beads(link: ET.Element, body: Body, i: int, beads: list[FloatArray]) -> None:
    """Write the inertia of a segment anew, without beads at places (n, 3) in its link."""
    to_dh = link_to_dh(body.table)[i]
    mass, turn = float(body.mass[i]), to_dh[:3, :3]
    com = turn @ body.com[i] + to_dh[:3, 3]
    about_origin = turn @ body.inertia[i] @ turn.T + mass * _spread(com)
    left, first = mass - BEAD_MASS * len(beads), mass * com
    for place in beads:
        about_origin -= BEAD_INERTIA * np.eye(3) + BEAD_MASS * _spread(place)
        first = first - BEAD_MASS * place
    for old in link.findall("inertial"):
        link.remove(old)
    add_inertial(link, left, first / left, about_origin - left * _spread(first / left))


def _spread(r: FloatArray) -> FloatArray:
    """Return the inertia (3, 3) about the origin of a unit mass at r (3,): r.r - r r^T."""
    return np.asarray((r @ r) * np.eye(3) - np.outer(r, r))


def _add_soles(links: Mapping[str, ET.Element], body: Body, friction: float) -> None:
    """Add what may touch the floor: a box below the foot and one below its toes.

    The foot's reaches from the heel to the ball, which are on its underside, the toes' from there
    to their tip; both up to the joint of the toes.
    """
    frames = link_to_dh(body.table) @ anatomical_to_link(body.table)
    lengths, height = body.measures.lengths, body.measures.lengths["h_mtp"]
    soles = {  # breadth; back, front and underside from the joint of the segment
        "foot": (lengths["foot_breadth"], -lengths["L_heel"], lengths["L_f"], -lengths["h_ank"]),
        "toe": (lengths["heel_breadth"], 0.0, lengths["L_toe"], -height),
    }
    for side in skeleton.SIDES:
        for part, (breadth, back, front, underside) in soles.items():
            i = skeleton.SEGMENTS[f"{part}_{side}"]
            centre = np.array([0.0, underside + height / 2, (back + front) / 2])
            box = np.array([breadth, height, front - back])
            _add_sole(links[LINK_NAMES[i]], frames[i], centre, box, friction)


def _add_sole(
    link: ET.Element, place: FloatArray, centre: FloatArray, size: FloatArray, friction: float
) -> None:
    """Add a box (3,) about a centre (3,) in anatomical axes, whose place (4, 4) is in the link.

    Friction is no part of URDF: PyBullet, Gazebo and Drake have elements of their own for it.
    """
    collision = ET.SubElement(link, "collision")
    at = place[:3, :3] @ centre + place[:3, 3]
    turn = numbers(roll_pitch_yaw(place[:3, :3]))
    ET.SubElement(collision, "origin", xyz=numbers(at), rpy=turn)
    ET.SubElement(ET.SubElement(collision, "geometry"), "box", size=numbers(size))
    properties = ET.SubElement(collision, f"{_DRAKE}:proximity_properties")
    for kind in ("static", "dynamic"):
        ET.SubElement(properties, f"{_DRAKE}:mu_{kind}", value=numbers([friction]))
    contact = ET.SubElement(link, "contact")
    ET.SubElement(contact, "lateral_friction", value=numbers([friction]))
