"""The file of a gait, ``gait.npz``: the motion, and what it claims about forces and torques."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray
from human_gait.body.person import Body
from human_gait.body.skeleton import DOF_NAMES, N_DOF, SEGMENTS
from human_gait.results.archive import numbers, opened, text, told
from human_gait.results.names import GAIT_FILE
from human_gait.results.sealed import plain
from human_gait.results.shapes import SOLUTION_SHAPE, faults
from human_gait.scenario import Scenario
from human_gait.values import Value
from human_gait.walk.bspline import DEGREE
from human_gait.walk.gait import Gait, Samples
from human_gait.walk.measured import GroundForces

FORMAT = "human_gait gait 2"
_ABOUT = """One step of a predicted walk, left heel strike (t = 0) to right heel strike (t = T).
World: y up, z forward, x to the left. SI units, angles in radians.
knots (n+4), control_points (n, 55): cubic B-splines of the 55 joint angles named in dof_names,
q(t) = sum_j N_j,4(t) P_j for 0 <= t <= T; the next step is the mirror image.
Sampled at t: q, v, a, tau (joint torques with ground reaction), active (without passive
torques), zmp (x, y, z), and for the right and the left foot grf, cop (centre of pressure),
yaw_moment, toe_share (of force and moment) and points (heel, ball_medial, ball_lateral, toe).
footholds: where these points stand. mass: of the 55 links, the load with the thorax.
Of a walk whose ground reaction was measured: measured_force, measured_point (x, z) and
measured_free_moment of the right and the left foot, at even times from 0 to T.
scenario and solution are JSON; so are digests, the sha256 of every other member."""
_FARTHEST = 25.0  # [rad] or [m], more than joints can be allowed
_CLOSEST = 5e-3  # of the step: two samples or more to every piece
_DIGESTS = "digests"
_FORCES = {"force": (2, 3), "point": (2, 2), "free_moment": (2,)}  # of one time
_MOST_TIMES = 10_000
_SHOWN_NAME = 40
_SHAPES: dict[str, tuple[int, ...]] = {  # of the samples of one instant
    **dict.fromkeys(("q", "v", "a", "tau", "active"), (N_DOF,)),
    "zmp": (3,),
    **dict.fromkeys(("grf", "cop"), (2, 3)),
    **dict.fromkeys(("yaw_moment", "toe_share"), (2,)),
    "points": (2, 4, 3),
}


@dataclass(frozen=True, eq=False, repr=False)
class Record(Value):
    """A gait and what its file claims about it, nothing of which has to be true.

    Attributes
    ----------
    gait : Gait
    samples : Samples
        At ``gait.fine_times``.
    mass : (55,) array, [kg]
        Of the links, the load with the thorax.
    footholds : (2, 4, 3) array, [m]
        Where the contact points of the right and of the left foot stand.
    altered : tuple of str, or None
        Members of the file that are not as they were written; None if the file cannot tell, since
        it has no digests.
    """

    gait: Gait
    samples: Samples
    mass: FloatArray
    footholds: FloatArray
    altered: tuple[str, ...] | None = ()


def make_record(gait: Gait) -> Record:
    """Return what a gait claims: its samples, its body and its footholds."""
    return Record(gait, gait.fine_samples, carried_mass(gait.body), gait.plan.footholds)


def carried_mass(body: Body) -> FloatArray:
    """Return the masses (55,) of the links, the load with the thorax, [kg]."""
    mass = body.mass.copy()
    mass[SEGMENTS["thorax"]] += body.load.mass
    return mass


def save_gait(gait: Gait, folder: Path) -> None:
    """Write a gait, and its samples for readers without this package, to ``gait.npz``."""
    members: dict[str, Any] = sealed(members_of(make_record(gait)))
    with (folder / GAIT_FILE).open("wb") as file:
        np.savez_compressed(file, **members)


def members_of(record: Record) -> dict[str, npt.NDArray[Any]]:
    """Return everything that the file of a record holds but the digests, by name."""
    gait = record.gait
    return {
        "format": np.array(FORMAT),
        "about": np.array(_ABOUT),
        "scenario": np.array(json.dumps(gait.scenario.to_dict())),
        "solution": np.array(json.dumps(plain(gait.solution))),
        "dof_names": np.array(DOF_NAMES),
        "breaks": gait.breaks,
        "knots": gait.knots,
        "control_points": gait.control_points,
        "mass": record.mass,
        "footholds": record.footholds,
        **{item.name: getattr(record.samples, item.name) for item in fields(Samples)},
        **({f"measured_{x}": getattr(gait.forces, x) for x in _FORCES} if gait.forces else {}),
    }


def sealed(members: Mapping[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Return the members with their digests among them."""
    digests = {name: digest(member) for name, member in members.items() if name != _DIGESTS}
    return {**members, _DIGESTS: np.array(json.dumps(digests))}


def digest(member: npt.NDArray[Any]) -> str:
    """Return the sha256 of an array: of its type, its shape and its content."""
    content = hashlib.sha256(f"{member.dtype.str} {member.shape}".encode())
    content.update(np.ascontiguousarray(member).tobytes())
    return content.hexdigest()


def load_gait(folder: str | Path) -> Gait:
    """Read the gait of a result folder, or of its ``gait.npz``.

    Raises
    ------
    ResultError
        If there is no ``gait.npz``, or it is not one of ours, or its content contradicts itself.
    """
    return load_record(folder).gait


def load_record(folder: str | Path) -> Record:
    """Read the gait of a result folder, or of its ``gait.npz``, and what the file claims about it.

    Raises
    ------
    ResultError
        As for `load_gait`. Numbers that are merely wrong are left to `verification`.
    """
    with opened(folder_of(folder) / GAIT_FILE, "a gait") as file:
        return restored(file)


def gait_of(result: Gait | str | Path) -> Gait:
    """Return a gait that is given itself, or by the folder of a result, or its ``gait.npz``.

    Raises
    ------
    ResultError
        As for `load_gait`.
    TypeError
        If it is neither a gait nor a path.
    """
    return result if isinstance(result, Gait) else load_gait(result)


def folder_of(result: str | Path) -> Path:
    """Return the folder of a result that is given by its folder or by the ``gait.npz`` in it."""
    path = Path(result)
    return path.parent if path.name == GAIT_FILE and not path.is_dir() else path


def restored(file: Mapping[str, Any]) -> Record:
    """Return the gait that the members of a file make, and what they claim about it.

    Raises
    ------
    KeyError, TypeError, ValueError
        If one is missing, is not what it should be, or contradicts another.
    ScenarioError
        If the scenario cannot be used.
    """
    if (found := text(file, "format")) != FORMAT:
        raise ValueError(f"format {found!r:.60}, expected {FORMAT!r}: predict it again")
    gait = _gait(file)
    if list(file["dof_names"]) != list(DOF_NAMES):
        raise ValueError("dof_names are not those of the body")
    mass, footholds = numbers(file, "mass", (N_DOF,)), numbers(file, "footholds", (2, 4, 3))
    return Record(gait, _samples(file, gait), mass, footholds, _altered(file))


def _altered(file: Mapping[str, Any]) -> tuple[str, ...] | None:
    """Return the members that are not as they were written, or None if there are no digests.

    Those that were added or taken away count, too.
    """
    if _DIGESTS not in file:
        return None
    digests = told(file, _DIGESTS)
    if not isinstance(digests, dict):
        return (_DIGESTS,)
    found = {name: digest(file[name]) for name in file if name != _DIGESTS}
    return tuple(
        "".join(sign if sign.isprintable() else "?" for sign in name[:_SHOWN_NAME])
        for name in sorted({*found, *digests})
        if name not in found or found[name] != digests.get(name)
    )


def _gait(file: Mapping[str, Any]) -> Gait:
    scenario, solution = Scenario.from_record(told(file, "scenario")), told(file, "solution")
    if wrong := next(faults(solution, SOLUTION_SHAPE, "solution"), ""):
        raise ValueError(wrong)
    breaks, control_points = (numbers(file, name) for name in ("breaks", "control_points"))
    check_splines(scenario, breaks, control_points)
    if len(breaks) + 2 != scenario.discretisation.control_points:
        raise ValueError(f"breaks of shape {breaks.shape} do not fit the control points asked for")
    if np.abs(control_points).max() > _FARTHEST:
        raise ValueError(f"control_points beyond {_FARTHEST:g} rad or m are no gait")
    gait = Gait(scenario, breaks, control_points, solution, forces=_forces(file))
    if not np.allclose(numbers(file, "knots", gait.knots.shape), gait.knots, rtol=0.0, atol=1e-9):
        raise ValueError("knots do not fit the breaks")
    return gait


def _forces(file: Mapping[str, Any]) -> GroundForces | None:
    """Return the forces of the ground that were measured, if the file has any."""
    if "measured_force" not in file:
        return None
    n = len(numbers(file, "measured_force"))
    if not 2 <= n <= _MOST_TIMES:
        raise ValueError(f"measured_force has {n} times, must have 2 to {_MOST_TIMES}")
    return GroundForces(*(numbers(file, f"measured_{x}", (n, *_FORCES[x])) for x in _FORCES))


def check_splines(scenario: Scenario, breaks: FloatArray, control_points: FloatArray) -> None:
    """Refuse pieces and control points that make no splines over the step.

    Raises
    ------
    ValueError
        With the name of the array.
    """
    T = scenario.walk.step_time
    if breaks.ndim != 1 or not breaks.size:
        raise ValueError(f"breaks of shape {breaks.shape} are no list of times")
    if not np.allclose(breaks[[0, -1]], [0.0, T], rtol=0.0, atol=1e-9 * T):
        raise ValueError(f"breaks do not go from 0 to the step time {T:g} s")
    fewest = DEGREE if scenario.discretisation.mirrored else 1
    if len(breaks) <= fewest or np.any(np.diff(breaks) < _CLOSEST * T):
        raise ValueError("breaks are too few, too close or do not increase")
    if control_points.shape != (len(breaks) + 2, N_DOF):
        raise ValueError(f"control_points of shape {control_points.shape} do not fit")


def _samples(file: Mapping[str, Any], gait: Gait) -> Samples:
    times = gait.fine_times
    if not np.allclose(numbers(file, "t", times.shape), times, rtol=0.0, atol=1e-12):
        raise ValueError("t is not the grid of the samples")
    K = len(times)
    return Samples(times, **{name: numbers(file, name, (K, *_SHAPES[name])) for name in _SHAPES})
