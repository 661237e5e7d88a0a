"""The body as URDF text, for Pinocchio, Drake, yourdfpy and any other reader.

URDF allows a constant transformation only before the motion of a joint. Link i of the URDF is
therefore U_i = A_p B_i Rz(theta_offset + q) (with Tz(d + q) if prismatic), its axis z, and the rest
of the DH row, K_i, goes into the origins of its children: A_i = U_i K_i. A massless fixed link
``dh_01`` ... ``dh_55`` marks each A_i.
"""

import xml.etree.ElementTree as ET
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body import skeleton
from human_gait.body.dh import constant, joint_origins, link_to_dh
from human_gait.body.figure import Capsule, capsules
from human_gait.body.limits import position_limits, torque_limits
from human_gait.body.links import Links, anatomical_to_link

COLOURS = {
    "skin": "0.87 0.68 0.55 1",
    "hair": "0.24 0.16 0.11 1",
    "shirt": "0.24 0.45 0.66 1",
    "shorts": "0.20 0.22 0.28 1",
    "shoe": "0.88 0.88 0.90 1",
    "backpack": "0.42 0.47 0.27 1",
}


def _numbered(prefix: str, names: Sequence[str]) -> tuple[str, ...]:
    """Pad the numbers, so that the alphabetical order of siblings is the order of the DOF."""
    return tuple(f"{prefix}{i:02d}_{name}" for i, name in enumerate(names, start=1))


def _bare_links() -> list[str]:
    segment = {i: name for name, i in skeleton.SEGMENTS.items()}
    return [segment.get(i, name) for i, name in enumerate(skeleton.DOF_NAMES)]


JOINT_NAMES = _numbered("j", skeleton.DOF_NAMES)
"""Names of the 55 joints in URDF: ``j01_pelvis_tz`` ..."""

LINK_NAMES = _numbered("l", _bare_links())
"""Names of the 55 links in URDF: ``l06_pelvis`` ..."""


def urdf_text(body: Links) -> str:
    """Return the URDF of a body; the same text for the same body."""
    robot = ET.Element("robot", name="human")
    for name, rgba in COLOURS.items():
        ET.SubElement(ET.SubElement(robot, "material", name=name), "color", rgba=rgba)
    ET.SubElement(robot, "link", name="world")
    to_dh, origins = link_to_dh(body.table), joint_origins(body.table)
    anatomical, limits = anatomical_to_link(body.table), _limits(body)
    drawn = capsules(body.measures)
    for i in range(skeleton.N_DOF):
        link = _add_link(robot, body, i, to_dh[i])
        for capsule in drawn if body.mass[i] > 0 else ():
            if capsule.link == i:
                _add_capsule(link, capsule, to_dh[i] @ anatomical[i])
        _add_joint(robot, i, origins[i], limits[i])
        add_fixed(robot, f"dh_{i + 1:02d}", LINK_NAMES[i], to_dh[i])
    if body.load.mass > 0:
        _add_backpack(robot, body, to_dh)
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode") + "\n"


def _add_link(robot: ET.Element, body: Links, i: int, to_dh: FloatArray) -> ET.Element:
    link = ET.SubElement(robot, "link", name=LINK_NAMES[i])
    if body.mass[i] > 0:
        com = to_dh[:3, :3] @ body.com[i] + to_dh[:3, 3]
        add_inertial(
            link, float(body.mass[i]), com, to_dh[:3, :3] @ body.inertia[i] @ to_dh[:3, :3].T
        )
    return link


def add_inertial(
    link: ET.Element,
    mass: float,
    com: FloatArray,
    inertia: FloatArray,
    turn: tuple[float, float, float] = (0, 0, 0),
) -> None:
    """Add mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m^2] to a link.

    The axes of the inertia are those of the link after a turn of roll, pitch and yaw [rad].
    """
    inertial = ET.SubElement(link, "inertial")
    rpy = numbers(turn) if any(turn) else "0 0 0"
    ET.SubElement(inertial, "origin", xyz=numbers(com), rpy=rpy)
    ET.SubElement(inertial, "mass", value=numbers([mass]))
    axes = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}
    ET.SubElement(
        inertial, "inertia", {f"i{name}": numbers([inertia[ij]]) for name, ij in axes.items()}
    )


def _add_joint(robot: ET.Element, i: int, origin: FloatArray, limits: dict[str, str]) -> None:
    parent = skeleton.PARENT[i]
    kind = "prismatic" if skeleton.PRISMATIC[i] else "revolute"
    joint = ET.SubElement(robot, "joint", name=JOINT_NAMES[i], type=kind)
    ET.SubElement(joint, "parent", link="world" if parent < 0 else LINK_NAMES[parent])
    ET.SubElement(joint, "child", link=LINK_NAMES[i])
    ET.SubElement(
        joint, "origin", xyz=numbers(origin[:3, 3]), rpy=numbers(roll_pitch_yaw(origin[:3, :3]))
    )
    ET.SubElement(joint, "axis", xyz="0 0 1")
    ET.SubElement(joint, "limit", limits)


def _limits(body: Links) -> list[dict[str, str]]:
    """Return the limits of all joints: effort 0 without a muscle; URDF demands a velocity."""
    strength = np.abs(torque_limits(body.subject)).max(axis=0)
    efforts = np.where(np.isfinite(strength), strength, 0.0)
    texts = ([numbers([x]) for x in each] for each in (*position_limits(), efforts))
    return [
        {"lower": lower, "upper": upper, "effort": effort, "velocity": "100.0"}  # none is known
        for lower, upper, effort in zip(*texts, strict=True)
    ]


def add_fixed(robot: ET.Element, name: str, parent: str, origin: FloatArray) -> ET.Element:
    """Add a link without mass at a place (4, 4) in another one, and return it."""
    link = ET.SubElement(robot, "link", name=name)
    joint = ET.SubElement(robot, "joint", name=f"fixed_{name}", type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=name)
    ET.SubElement(
        joint, "origin", xyz=numbers(origin[:3, 3]), rpy=numbers(roll_pitch_yaw(origin[:3, :3]))
    )
    return link


def _add_backpack(robot: ET.Element, body: Links, to_dh: FloatArray) -> None:
    """Hang the load on the thorax, in anatomical axes about its centre; a force has no mass."""
    thorax = skeleton.SEGMENTS["thorax"]
    turn = anatomical_to_link(body.table)[thorax]
    origin = turn.copy()
    origin[:3, 3] = body.load_com
    link = add_fixed(robot, "backpack", LINK_NAMES[thorax], constant(to_dh[thorax] @ origin))
    inertia = turn[:3, :3].T @ body.load_inertia @ turn[:3, :3]
    if body.load.model == "rigid":
        add_inertial(link, body.load.mass, np.zeros(3), inertia)
    visual = ET.SubElement(link, "visual")
    ET.SubElement(ET.SubElement(visual, "geometry"), "box", size=numbers(body.load.size))
    ET.SubElement(visual, "material", name="backpack")


def _add_capsule(link: ET.Element, capsule: Capsule, place: FloatArray) -> None:
    """Add the shape of a capsule at a place (4, 4) in a link."""
    ends = [place[:3, :3] @ end + place[:3, 3] for end in capsule.ends]
    along, radius = ends[1] - ends[0], numbers([capsule.radius])
    rpy = (0.0, np.arctan2(np.hypot(along[0], along[1]), along[2]), np.arctan2(along[1], along[0]))
    cylinder = ET.Element("cylinder", radius=radius, length=numbers([np.sqrt(along @ along)]))
    shapes = [((ends[0] + ends[1]) / 2, rpy, cylinder)]
    shapes += [(end, (0.0, 0.0, 0.0), ET.Element("sphere", radius=radius)) for end in ends]
    for centre, turn, shape in shapes:
        visual = ET.SubElement(link, "visual")
        ET.SubElement(visual, "origin", xyz=numbers(centre), rpy=numbers(turn))
        ET.SubElement(visual, "geometry").append(shape)
        ET.SubElement(visual, "material", name=capsule.colour)


def roll_pitch_yaw(R: FloatArray) -> tuple[float, float, float]:
    """Return the angles, [rad], of R = Rz(yaw) Ry(pitch) Rx(roll); yaw = 0 if pitch is +-pi/2."""
    level = np.hypot(R[0, 0], R[1, 0])
    pitch = np.arctan2(-R[2, 0], level)
    if level < 1e-9:
        return float(np.arctan2(-R[1, 2], R[1, 1])), float(pitch), 0.0
    return float(np.arctan2(R[2, 1], R[2, 2])), float(pitch), float(np.arctan2(R[1, 0], R[0, 0]))


def numbers(values: npt.ArrayLike) -> str:
    """Return numbers that read back exactly."""
    return " ".join(repr(float(value) + 0.0) for value in np.asarray(values).tolist())
