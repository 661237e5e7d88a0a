"""What the dynamics moves: DH table, rigid links, load on the back, points of the feet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.body import skeleton
from human_gait.body.anthropometry import Anthropometry, Segment, body_measures, symmetric_inertia
from human_gait.body.dh import DHTable, constant, dh_table, frames, inverse
from human_gait.scenario import Load, Subject
from human_gait.values import Value

GRAVITY = np.array([0.0, -skeleton.GRAVITY, 0.0])
"""Acceleration of gravity in the world, [m/s^2]."""

CONTACT_POINTS = ("heel", "ball_medial", "ball_lateral", "toe")
"""Points that touch the ground (Fig. 6)."""

OUTLINE_POINTS = (
    "heel_medial",
    "ball_medial",
    "toe_medial",
    "toe_lateral",
    "ball_lateral",
    "heel_lateral",
)
"""Corners of the sole, around the foot support region."""

_TIP_TAPER = 0.6  # breadth of the foot at the toe tips against the ball: assumed


@dataclass(frozen=True, eq=False)
class FootPoints(Value):
    """Points of the sole, right foot first.

    Attributes
    ----------
    names : tuple of str, n of them
    links : (2, n) int array
        Index of the link that carries the point.
    points : (2, n, 3) array, [m]
        In the DH frame of that link. All have the height 0 when the foot stands flat.
    """

    names: tuple[str, ...]
    links: IntArray
    points: FloatArray


@dataclass(frozen=True, eq=False)
class Links(Value):
    """One person and the load on the back, as rigid links in the DH frames.

    Attributes
    ----------
    subject : Subject
    load : Load
    measures : Anthropometry
    table : DHTable
    mass : (55,) array, [kg]
    com : (55, 3) array, [m]
        Centres of mass in the DH frames of the links.
    inertia : (55, 3, 3) array, [kg m^2]
        About the centres of mass, in the axes of the DH frames. All three are those of the body
        alone, and zero for links without a segment.
    load_com : (3,) array, [m]
    load_inertia : (3, 3) array, [kg m^2]
        The load (a box of even density), in the DH frame of the thorax.
    contact : FootPoints
        The points of ``CONTACT_POINTS``.
    outline : FootPoints
        The points of ``OUTLINE_POINTS``.
    """

    subject: Subject
    load: Load
    measures: Anthropometry
    table: DHTable
    mass: FloatArray
    com: FloatArray
    inertia: FloatArray
    load_com: FloatArray
    load_inertia: FloatArray
    contact: FootPoints
    outline: FootPoints

    @classmethod
    def of(cls, subject: Subject, load: Load) -> Self:
        """Return the links of a subject who carries a load; their arrays cannot be written to."""
        measures = body_measures(subject)
        table = dh_table(measures)
        to_link = anatomical_to_link(table)
        box = symmetric_inertia(load.mass, np.square(load.size) / 12)
        carried = Segment(load.mass, np.array(load.position), box)
        rigid = _links(measures.segments, to_link)
        hung = _in_link(carried, to_link[skeleton.SEGMENTS["thorax"]])
        feet = (
            _foot_points(names, measures, to_link) for names in (CONTACT_POINTS, OUTLINE_POINTS)
        )
        return cls(subject, load, measures, table, *rigid, *hung, *feet).frozen()

    @property
    def total_mass(self) -> float:
        """Mass of body and load, [kg]."""
        return float(self.mass.sum() + self.load.mass)

    def pseudo_inertia(self) -> FloatArray:
        """Return the J_i of Eq. (10), a rigid load included, (55, 4, 4).

        Notes
        -----
        J = [[S + m c c^T, m c], [m c^T, m]] about the origin of the DH frame, S = tr(I) / 2 - I.
        Its last column is m r of Eq. (11).
        """
        J = _pseudo_inertia(self.mass, self.com, self.inertia)
        thorax = skeleton.SEGMENTS["thorax"]
        if self.load.model == "rigid":
            J[thorax] += _pseudo_inertia(np.array(self.load.mass), self.load_com, self.load_inertia)
        return J

    def standing(self, ball: str) -> FootPoints:
        """Return the contact points with the ball on a link of the foot: ``foot`` or ``toes``.

        On the toes it stays where it is when the heel rises about the axis of the metatarsal heads.
        """
        points = self.contact
        if ball == "foot":
            return points
        of_ball = np.array([name.startswith("ball") for name in points.names])
        toes = np.array([[skeleton.SEGMENTS[f"toe_{side}"]] for side in skeleton.SIDES])
        links = np.where(of_ball, toes, points.links)
        _, A = frames(self.table, np.zeros(skeleton.N_DOF))  # a foot that stands flat
        to_link = inverse(A[links]) @ A[points.links]
        places = np.einsum("fpij,fpj->fpi", to_link[..., :3, :3], points.points)
        return FootPoints(points.names, links, places + to_link[..., :3, 3])


def _pseudo_inertia(mass: FloatArray, com: FloatArray, inertia: FloatArray) -> FloatArray:
    J = np.empty((*mass.shape, 4, 4))
    trace = np.trace(inertia, axis1=-2, axis2=-1)[..., None, None]
    moment = mass[..., None] * com
    J[..., :3, :3] = trace / 2 * np.eye(3) - inertia + moment[..., :, None] * com[..., None, :]
    J[..., :3, 3] = J[..., 3, :3] = moment
    J[..., 3, 3] = mass
    return J


def anatomical_to_link(table: DHTable) -> FloatArray:
    """Return (55, 4, 4) from anatomical axes at the proximal joint to the DH frame, at q = 0."""
    P, A = frames(table, np.zeros(skeleton.N_DOF))
    at_joint = np.tile(np.eye(4), (skeleton.N_DOF, 1, 1))
    at_joint[:, :3, 3] = P[:, :3, 3]
    return constant(inverse(constant(A)) @ at_joint)


def _in_link(segment: Segment, to_link: FloatArray) -> tuple[FloatArray, FloatArray]:
    rotation = to_link[:3, :3]
    return rotation @ segment.com + to_link[:3, 3], rotation @ segment.inertia @ rotation.T


def _links(
    segments: Mapping[str, Segment], to_link: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    mass, com, inertia = (np.zeros((skeleton.N_DOF, *shape)) for shape in ((), (3,), (3, 3)))
    for name, segment in segments.items():
        i = skeleton.SEGMENTS[name]
        mass[i] = segment.mass
        com[i], inertia[i] = _in_link(segment, to_link[i])
    return mass, com, inertia


def _foot_points(
    names: tuple[str, ...], measures: Anthropometry, to_link: FloatArray
) -> FootPoints:
    links = np.array([[_foot_link(name, side) for name in names] for side in skeleton.SIDES])
    sole = [
        [_sole_point(name, measures.lengths, side) for name in names] for side in skeleton.SIDES
    ]
    points = np.einsum("...ij,...j->...i", to_link[links], np.array(sole))
    return FootPoints(names, links, points[..., :3])


def _foot_link(point: str, side: str) -> int:
    return skeleton.SEGMENTS[f"toe_{side}" if point.startswith("toe") else f"foot_{side}"]


def _sole_point(
    name: str, lengths: Mapping[str, float], side: str
) -> tuple[float, float, float, float]:
    """Return a point in anatomical axes from the ankle (of the toes: from the MTP axis)."""
    part, _, edge = name.partition("_")
    joint_height, ahead, breadth = {
        "heel": (lengths["h_ank"], -lengths["L_heel"], lengths["heel_breadth"]),
        "ball": (lengths["h_ank"], lengths["L_f"], lengths["foot_breadth"]),
        "toe": (lengths["h_mtp"], lengths["L_toe"], _TIP_TAPER * lengths["foot_breadth"]),
    }[part]
    lateral = {"": 0.0, "medial": -breadth / 2, "lateral": breadth / 2}[edge]
    return (lateral if side == "l" else -lateral), -joint_height, ahead, 1.0
