"""Columns of measured trials by what other programs call them, and in which sign.

A curve is one of the gait cycle here. Where programs, or models of one program, differ in the sign
under one name, the values decide, and it is said.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from human_gait import data
from human_gait.walk.gait_cycle import ANGLES, COLUMNS, FURTHER, MOMENTS

Signs = Mapping[str, tuple[str, float]]

CURVES: tuple[str, ...] = (
    *COLUMNS[1:],
    *(name for name in FURTHER if not name.startswith("left_")),
)
"""Curves of one leg, to which columns can be mapped."""

BY_VALUES = 0.0
"""In the place of a sign: the values decide."""

OPENSIM: Signs = {
    # OpenSim turns the pelvis about z (right), x (forward) and y (up): backwards, down on the right
    # side, and forward on it are positive.
    "pelvis_tilt": ("pelvis_tilt_anterior_deg", -1.0),
    "pelvis_list": ("pelvis_obliquity_up_deg", -1.0),
    "pelvis_rotation": ("pelvis_rotation_internal_deg", 1.0),
    "hip_flexion_r": ("hip_flexion_deg", 1.0),
    "hip_adduction_r": ("hip_adduction_deg", 1.0),
    "hip_rotation_r": ("hip_rotation_internal_deg", 1.0),
    "knee_angle_r": ("knee_flexion_deg", BY_VALUES),
    "ankle_angle_r": ("ankle_dorsiflexion_deg", 1.0),
    "subtalar_angle_r": ("ankle_inversion_deg", 1.0),
    "arm_flex_r": ("shoulder_flexion_deg", 1.0),
    "elbow_flex_r": ("elbow_flexion_deg", 1.0),
}
"""Coordinates of gait2392, gait2354, gait10dof18musc and Rajagopal's model.

The knee of Rajagopal's model flexes in the positive sense, that of the others in the negative one.
"""

OPENSIM_MOMENTS: Signs = {
    "hip_flexion_r_moment": ("hip_extension_Nm_per_kg", -1.0),
    "hip_adduction_r_moment": ("hip_abduction_Nm_per_kg", -1.0),
    "knee_angle_r_moment": ("knee_extension_Nm_per_kg", BY_VALUES),
    "ankle_angle_r_moment": ("ankle_plantarflexion_Nm_per_kg", -1.0),
}
"""Generalised forces of OpenSim's inverse dynamics, each along its coordinate."""

PLUG_IN_GAIT: Signs = {
    "RPelvisAngles.x": ("pelvis_tilt_anterior_deg", 1.0),
    "RPelvisAngles.y": ("pelvis_obliquity_up_deg", 1.0),
    "RPelvisAngles.z": ("pelvis_rotation_internal_deg", 1.0),
    "RHipAngles.x": ("hip_flexion_deg", 1.0),
    "RHipAngles.y": ("hip_adduction_deg", 1.0),
    "RHipAngles.z": ("hip_rotation_internal_deg", 1.0),
    "RKneeAngles.x": ("knee_flexion_deg", 1.0),
    "RAnkleAngles.x": ("ankle_dorsiflexion_deg", 1.0),
    "RShoulderAngles.x": ("shoulder_flexion_deg", 1.0),
    "RElbowAngles.x": ("elbow_flexion_deg", 1.0),
    "RHipMoment.x": ("hip_extension_Nm_per_kg", 1.0),
    "RHipMoment.y": ("hip_abduction_Nm_per_kg", 1.0),
    "RKneeMoment.x": ("knee_extension_Nm_per_kg", 1.0),
    "RAnkleMoment.x": ("ankle_plantarflexion_Nm_per_kg", 1.0),
}
"""Outputs of Plug-in Gait; its moments are in the sense of the muscles that these names have."""

OWN: Signs = {
    **{dof: (curve, sign) for curve, (dof, sign) in ANGLES.items()},
    **{
        f"{dof}{end}": (curve, sign)
        for curve, (dof, sign) in MOMENTS.items()
        for end in ("_moment", "_net")
    },
}
"""Degrees of freedom of the body here, as its exports have them."""

ENDS: Mapping[str, str] = {"angle": "_deg", "moment": "_Nm_per_kg"}
"""How the curves of a kind of quantity end."""

DIALECTS: Mapping[str, Signs] = {
    "this package": OWN,
    "OpenSim": {**OPENSIM, **OPENSIM_MOMENTS},
    "Plug-in Gait": PLUG_IN_GAIT,
}
"""All of them; the first that has a name counts."""

LEANS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "this package": tuple(
        (row["name"], row["axis_at_neutral"])
        for row in data.rows("dh_table")
        if row["kind"] == "joint" and row["type"] == "R" and row["branch"] in ("virtual", "spine")
    ),
    "OpenSim": (
        *(("pelvis_tilt", "-x"), ("pelvis_list", "+z"), ("pelvis_rotation", "+y")),
        *(("lumbar_extension", "-x"), ("lumbar_bending", "+z"), ("lumbar_rotation", "+y")),
    ),
}
"""Columns that turn the trunk, one after the other, each about an axis here.

Those about x are needed; what is not measured of the others is small.
"""

LEAN = "trunk_flexion_deg"

_OF_THE_SIDE = ("pelvis_obliquity_up_deg", "pelvis_rotation_internal_deg")
"""What the pelvis does on a side; it does the contrary on the other."""


_UNIT = re.compile(
    r"(?P<name>.*?)(?:_|\s*[\[(]\s*)"
    r"(?P<unit>deg|rad|mm|cm|m|s|ms|N|Nm|Nmm|Nm_per_kg|Nmm_per_kg|Nm/kg|Nmm/kg|BW)\s*[\])]?"
)


def without_unit(column: str) -> tuple[str, str]:
    """Return the name of a column without the unit at its end, and this, which may be empty."""
    if matched := _UNIT.fullmatch(column):
        return matched["name"], matched["unit"].replace("_per_", "/")
    return column, ""


def is_known(name: str) -> bool:
    """Return whether a column without unit is an angle by its name."""
    parts = {column for turns in LEANS.values() for column, _ in turns}
    return name in parts or bool(known_as(name, "angle"))


def known_as(name: str, kind: str, side: str = "r") -> tuple[str, float, str] | None:
    """Return curve, sign and whose name it is of a column without its unit, if it is known.

    The tables are those of the right leg. On the left, names are those of the other side, and the
    pelvis goes up, and forward, where it goes down and back on the right; Plug-in Gait has a pelvis
    for each side.

    Parameters
    ----------
    name : str
    kind : str
        Of ``ENDS``.
    side : str
        ``r`` or ``l``.
    """
    end = ENDS[kind]
    if (curve := f"{name.removesuffix(end)}{end}") in CURVES:
        return curve, 1.0, "a curve of the gait cycle"
    there = _other_side(name) if side == "l" else name
    for whose, dialect in DIALECTS.items():
        if there in dialect and dialect[there][0].endswith(end):
            curve, sign = dialect[there]
            turned = side == "l" and there == name and curve in _OF_THE_SIDE
            return curve, -sign if turned else sign, whose
    return None


def _other_side(name: str) -> str:
    """Return a name of the left side as that of the right one, and the other way round."""
    if matched := re.fullmatch(r"(.+_)([rl])((?:_moment|_net)?)", name):
        return matched[1] + {"r": "l", "l": "r"}[matched[2]] + matched[3]
    if matched := re.fullmatch(r"([RL])([A-Z]\w+(?:Angles|Moment)\.[xyz])", name):
        return {"R": "L", "L": "R"}[matched[1]] + matched[2]
    return name
