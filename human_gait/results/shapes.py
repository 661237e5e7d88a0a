"""What the JSON files of a result have to hold, declared once: names and kinds of all that is read.

A shape is a type (``bool``, ``int``, ``float``, ``str``), a table of shapes by key, a `Many` of one
shape, a number `Between` two, or what may be null (`OrNull`) or missing (`Maybe`). What is not
declared is not read and may be anything.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias
from unicodedata import category

Shape: TypeAlias = "type | Mapping[str, Shape] | Many | OrNull | Between"

_LARGEST = 1e300  # of a number
_LONGEST = 2_000  # signs of a text
_MOST = 20_000  # in a list or a table
_SHOWN = 40
_STEERING = ("Cc", "Cf", "Cs")  # controls, marks of direction, halves of a pair of surrogates


@dataclass(frozen=True)
class Many:
    """A list of things of one shape, or a table of them by names that are free."""

    shape: Shape
    named: bool = False


@dataclass(frozen=True)
class OrNull:
    """What may be null."""

    shape: Shape


@dataclass(frozen=True)
class Maybe(OrNull):
    """What may be null, or missing in a table."""


@dataclass(frozen=True)
class Between:
    """A number from `low` to `high`."""

    low: float
    high: float


NUMBER = OrNull(float)
"""A number that is null where it is not finite, which JSON cannot tell."""

_TRIAL: Mapping[str, Shape] = {
    **dict.fromkeys(("start", "solver", "solver_status"), str),
    **dict.fromkeys(("converged", "success"), bool),
    "failed_checks": Many(str),
    "wall_time_s": float,
    "cost": NUMBER,
}
_CHECK: Mapping[str, Shape] = {
    "unit": str,
    "value": NUMBER,
    "limit": NUMBER,
    "time": float,
    "passed": bool,
    "equation": Maybe(str),
}
_VIOLATION: Mapping[str, Shape] = {
    "what": str,
    "value": NUMBER,
    "unit": str,
    "time_s": float,
    "equation": str,
}
_TRY: Mapping[str, Shape] = dict.fromkeys(("key", "change", "because"), str)
_DIAGNOSIS: Mapping[str, Shape] = {"not_kept": Many(str), "try": Many(_TRY)}

FOUND: Mapping[str, Shape] = {
    **dict.fromkeys(("start", "dynamics"), str),
    "success": bool,
    **dict.fromkeys(("seed", "iterations", "evaluations"), int),
}
"""How a gait was found: part of ``summary.json``, and since then of its own file."""

VERDICT: Mapping[str, Shape] = {
    "success": bool,
    "diagnosis": Maybe(_DIAGNOSIS),
}
"""Whether there is a walk, and else why not: part of ``summary.json``."""

ASKED: Mapping[str, Shape] = {
    "scenario": Maybe({}),
    **dict.fromkeys(
        ("walking_speed_m_per_s", "step_length_m", "body_mass_kg", "load_kg"), Maybe(float)
    ),
}
"""What was asked for: part of ``summary.json``."""

SUMMARY_SHAPE: Mapping[str, Shape] = {
    **FOUND,
    **VERDICT,
    "diagnosis": OrNull(_DIAGNOSIS),
    **ASKED,
    **dict.fromkeys(("solver", "solver_status"), str),
    **dict.fromkeys(("n_variables", "n_constraints"), int),
    "wall_time_s": float,
    "cost": NUMBER,
    "attempts": Many(_TRIAL),
    "checks": Many(_CHECK, named=True),
    "violations": Many(_VIOLATION, named=True),
    "versions": Many(str, named=True),
}
"""``summary.json``."""

_BOUND: Mapping[str, Shape] = {
    **dict.fromkeys(("constraint", "what", "meaning", "step"), str),
    **dict.fromkeys(("time_s", "saving"), float),
}
EXPLANATION_SHAPE: Mapping[str, Shape] = {
    "cost": Maybe(float),
    "step_time_s": Between(1e-3, 1e3),
    "shapes": Many(_BOUND),
}
"""``explanation.json``."""

RESULT_SHAPE: Mapping[str, Shape] = {
    "success": bool,
    "solver_status": str,
    "cost": NUMBER,
    "wall_time_s": float,
    "evaluations": int,
}
"""What ``agreement.json`` takes of each ``summary.json``."""

_ESTIMATE: Mapping[str, Shape] = {
    **dict.fromkeys(("from", "unit", "constraint"), str),
    **dict.fromkeys(("cost_error", "largest_violation", "time_s"), float),
}
MEASURED_SHAPE: Mapping[str, Shape] = {
    "what": str,
    "files": Many(str),
    "not_kept": Many(str),
}
"""What a gait was fitted to, if it was measured."""

SOLUTION_SHAPE: Mapping[str, Shape] = {
    **{key: Maybe(shape) for key, shape in FOUND.items()},
    **dict.fromkeys(("solver", "status", "digest"), Maybe(str)),
    **dict.fromkeys(("cost", "wall_time_s"), Maybe(float)),
    "own_bounds": Maybe(Many(_BOUND)),
    "estimate": Maybe(_ESTIMATE),
    "measured": Maybe(MEASURED_SHAPE),
    "tracked": Maybe({"what": str, "weight": float}),
}
"""How a gait was found, in its own file; a gait that was made by hand knows less."""

GAITS: Mapping[str, Shape] = {
    "gait": Maybe(str),
    "gaits": Maybe(Many(str, named=True)),
    "digest": Maybe(str),
    "files": Maybe(Many(str, named=True)),
}
"""What a sealed file tells of what it belongs to (`sealed`)."""


def faults(content: Any, shape: Shape, key: str = "") -> Iterator[str]:
    """Yield what in a content is not of a shape: its dotted key, and what it must be.

    Parameters
    ----------
    content : anything that JSON can tell
    shape : Shape
    key : str
        Of the content.
    """
    if isinstance(shape, OrNull):
        if content is not None:
            yield from faults(content, shape.shape, key)
    elif isinstance(shape, Many):
        yield from _faults_of_many(content, shape, key)
    elif isinstance(shape, Mapping):
        yield from _faults_of_table(content, shape, key)
    elif wanted := _fault(content, shape):
        yield f"{key or 'it'} must be {wanted}, not {_shown(content)}"


def _faults_of_many(content: Any, shape: Many, key: str) -> Iterator[str]:
    kind, word = (dict, "a table") if shape.named else (list, "a list")
    if not isinstance(content, kind):
        yield f"{key or 'it'} must be {word}, not {_shown(content)}"
    elif len(content) > _MOST:
        yield f"{key or 'it'} holds {len(content)} entries: at most {_MOST} can be"
    else:
        for name, one in content.items() if isinstance(content, dict) else enumerate(content):
            if shape.named and (wrong := _fault(name, str)):
                yield f"{key or 'it'}: a name in it must be {wrong}"
            yield from faults(one, shape.shape, f"{key}.{_cut(str(name))}" if key else str(name))


def _faults_of_table(content: Any, shape: Mapping[str, Shape], key: str) -> Iterator[str]:
    if not isinstance(content, dict):
        yield f"{key or 'it'} must be a table, not {_shown(content)}"
        return
    for name, inner in shape.items():
        dotted = f"{key}.{name}" if key else name
        if name in content:
            yield from faults(content[name], inner, dotted)
        elif not isinstance(inner, Maybe):
            yield f"it has no {dotted}"


def _fault(content: Any, kind: Any) -> str:
    """Return what a content would have to be; nothing if it is."""
    if isinstance(kind, Between):
        wanted = f"a number from {kind.low:g} to {kind.high:g}"
        return "" if not _fault(content, float) and kind.low <= content <= kind.high else wanted
    if kind is bool:
        return "" if isinstance(content, bool) else "true or false"
    if kind is str:
        return (
            "" if isinstance(content, str) and _is_text(content) else "a text without control signs"
        )
    if isinstance(content, bool) or not isinstance(content, int | float):
        return "a number"
    if kind is int and not (isinstance(content, int) and 0 <= content < 2**53):
        return "a whole number from 0 to 2^53"
    # an integer may be larger than any float: it is compared, not converted
    finite = isinstance(content, int) or math.isfinite(content)
    return "" if finite and abs(content) <= _LARGEST else f"a number up to {_LARGEST:g}"


def _is_text(text: str) -> bool:
    """Tell whether a text is one that a terminal can show: nothing in it steers the terminal."""
    return len(text) <= _LONGEST and not any(category(sign) in _STEERING for sign in text)


def _shown(content: Any) -> str:
    """Return a content in a few signs."""
    if isinstance(content, dict | list):
        return "a table" if isinstance(content, dict) else "a list"
    if isinstance(content, int) and abs(content) > _LARGEST:
        return "one of hundreds of digits"
    if isinstance(content, str):
        return f"the text {_cut(content)!r}"
    return {None: "null", True: "true", False: "false"}.get(content, str(content))


def _cut(text: str) -> str:
    short = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
    return "".join("?" if category(sign) in _STEERING else sign for sign in short)
