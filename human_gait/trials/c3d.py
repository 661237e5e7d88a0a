"""C3D: markers, joint angles and moments of models, force plates, events, who walks.

Points, plates of all types and their corners are read by ezc3d. Lengths have the unit of the file;
the screen of its parameters, X_SCREEN and Y_SCREEN, tells forward and up.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.exceptions import TrialError, shown
from human_gait.export.events import FootEvent
from human_gait.trials.axes import DIRECTIONS, Axes, axes_of, check_forward, check_upright
from human_gait.trials.c3d_records import check_c3d
from human_gait.trials.force_columns import check_vertical, on_the_foot
from human_gait.trials.recording import NEWTON_METRES, PER_MASS, Plate, Recording
from human_gait.trials.stated import ANGLE, LENGTH, MOMENT, Stated
from human_gait.trials.text import bytes_of

_OUTPUT = re.compile(r".*(Angles|Moment|Force|Power|GRF|Score|CentreOfMass|CenterOfMass)s?")
_KINDS = {"ANGLES": "Angles", "MOMENTS": "Moment", "FORCES": "Force", "POWERS": "Power"}
_PER_MASS_BELOW = 10.0
"""Peak of moments [N m] below which they are those per kilogram, whatever the unit of the file."""

_FAULTS = (OSError, RuntimeError, ValueError, IndexError, KeyError, TypeError, AttributeError)


def read_c3d(path: Path, stated: Stated) -> Recording:
    """Read a .c3d file.

    Raises
    ------
    TrialError
        If it is none, or leaves units or axes open.
    """
    opened = _opened(path)
    file, told = opened
    try:
        return _recording(path, file, stated, told)
    except (KeyError, IndexError, ValueError, TypeError) as error:
        message = f"has parameters that contradict each other ({error})"
        raise TrialError(f"{path}: {message}: is the file whole?") from None


def _opened(path: Path) -> tuple[Any, str]:
    """Return a file, and why its force plates cannot be made out, if so."""
    check_c3d(path, bytes_of(path))
    import ezc3d  # noqa: PLC0415, 0.2 s to import

    try:
        return ezc3d.c3d(str(path), extract_forceplat_data=True), ""
    except _FAULTS as error:
        told = " ".join(str(error).split())
    try:  # plates that cannot be made out are no reason to refuse the markers
        return ezc3d.c3d(str(path)), told
    except _FAULTS:
        raise TrialError(f"{path}: is no whole C3D file: {told}") from None


def _recording(path: Path, file: Any, stated: Stated, broken: str) -> Recording:
    group = file["parameters"]["POINT"]
    rate = float(_values(group, "RATE")[0])
    if not 0.0 < rate < 1e6:
        raise TrialError(f"{path}: POINT:RATE = {rate!r}: must be the frames a second")
    axes = axes_of(path, stated.up, stated.forward, _screen(file))
    points = np.asarray(file["data"]["points"][:3], dtype=np.float64)
    labels = _labels(path, file, points.shape[1])
    outputs = _outputs(group, labels)
    first = float(file["header"]["points"]["first_frame"])
    time = np.asarray((first + np.arange(points.shape[2])) / rate, dtype=np.float64)
    scale = LENGTH[_unit(path, "POINT:UNITS", _word(group, "UNITS"), LENGTH, stated)]
    markers = {
        label: axes.here(points[:, k].T * scale)
        for k, label in enumerate(labels)
        if label not in outputs
    }
    if not stated.up:
        check_upright(path, markers, axes)
    if not stated.forward:
        check_forward(path, markers, axes)
    plates: tuple[Plate, ...] = ()
    notes: tuple[str, ...] = (f"the force plates are left out: {broken}",)
    if not broken:
        plates, notes = _plates(path, file, axes, stated, first / rate)
    angles, moments, unit, said = _modelled(path, group, labels, outputs, points, stated)
    others = [name for name, kind in outputs.items() if kind not in ("Angles", "Moment")]
    return Recording(
        path,
        time,
        angles=angles,
        markers=markers,
        plates=plates,
        moments=moments,
        moment_unit=unit,
        mass=_mass(file),
        events=tuple(_events(file)),
        ignored=tuple(others),
        notes=(*notes, *said),
    )


def _values(group: Any, name: str) -> Any:
    return group[name]["value"] if name in group else []


def _word(group: Any, name: str) -> str:
    values = _values(group, name)
    return re.sub(r"[\s.*·]", "", str(values[0])) if len(values) else ""


def _unit(
    path: Path, key: str, word: str, kinds: Mapping[str, float], stated: Stated, asked: str = "mm|m"
) -> str:
    """Return the unit that is stated or that the file has."""
    unit = stated.unit(kinds) or word
    if unit not in kinds:
        message = f"{key} = {shown(word)}: must be one of {', '.join(kinds)}"
        raise TrialError(f"{path}: {message}: give --units {asked}")
    return unit


def _screen(file: Any) -> Axes | None:
    """Return the axes that the parameters of the screen tell: its right is forward, its top up."""
    found = []
    for name in ("Y_SCREEN", "X_SCREEN"):
        word = _word(file["parameters"]["POINT"], name).lower().removeprefix("+")
        if word not in DIRECTIONS:
            return None
        found.append(word)
    up, forward = found
    return Axes(up, forward) if up[-1] != forward[-1] else None


def _labels(path: Path, file: Any, count: int) -> list[str]:
    """Return the labels of the points, without the subject's name where that leaves them unlike."""
    group = file["parameters"]["POINT"]
    whole: list[str] = []
    for k, key in enumerate(["LABELS", *(f"LABELS{n}" for n in range(2, 20))]):
        if k and key not in group:
            break
        whole += [str(label).strip() for label in _values(group, key)]
    if len(whole) < count:
        message = f"POINT:LABELS has {len(whole)} names for {count} points"
        raise TrialError(f"{path}: {message}: is the file whole?")
    whole = whole[:count]
    short = [label.rpartition(":")[2] for label in whole]
    labels = short if len(set(short)) == len(short) else whole
    if len(set(labels)) < len(labels):
        twice = next(label for label in labels if labels.count(label) > 1)
        raise TrialError(f"{path}: POINT:LABELS: the name {shown(twice)} is there twice")
    return labels


def _outputs(group: Any, labels: Sequence[str]) -> dict[str, str]:
    """Return the points that are no markers but computed, with their kind."""
    found = {}
    for key, kind in _KINDS.items():
        for label in _values(group, key):
            found[str(label).strip().rpartition(":")[2]] = kind
    for label in labels:
        if label not in found and (matched := _OUTPUT.fullmatch(label)):
            found[label] = matched[1]
    return {label: found[label] for label in labels if label in found}


def _modelled(
    path: Path,
    group: Any,
    labels: Sequence[str],
    outputs: Mapping[str, str],
    points: FloatArray,
    stated: Stated,
) -> tuple[dict[str, FloatArray], dict[str, FloatArray], str, tuple[str, ...]]:
    """Return angles and moments of a model by label and axis, the unit of moments, and notes."""
    angles, moments = (
        {
            f"{label}.{axis}": points[i, labels.index(label)]
            for label, kind in outputs.items()
            if kind == wanted
            for i, axis in enumerate("xyz")
        }
        for wanted in ("Angles", "Moment")
    )
    if angles:
        word = _word(group, "ANGLE_UNITS")
        factor = ANGLE[_unit(path, "POINT:ANGLE_UNITS", word, ANGLE, stated, "deg|rad")]
        angles = {name: factor * x for name, x in angles.items()}
    if not moments:
        return angles, {}, NEWTON_METRES, ()
    word = _word(group, "MOMENT_UNITS")
    kind = _unit(path, "POINT:MOMENT_UNITS", word, MOMENT, stated, "Nm|Nmm|Nm/kg|Nmm/kg")
    moments = {name: MOMENT[kind] * x for name, x in moments.items()}
    per_mass, notes = kind.endswith("/kg"), list[str]()
    peak = max(float(np.nanmax(np.abs(x), initial=0.0)) for x in moments.values())
    if not per_mass and peak < _PER_MASS_BELOW and not stated.unit(MOMENT):
        per_mass = True
        notes.append(f"moments up to {peak:.1f} N m are taken as those per kilogram")
    return angles, moments, PER_MASS if per_mass else NEWTON_METRES, tuple(notes)


def _plates(
    path: Path, file: Any, axes: Axes, stated: Stated, start: float
) -> tuple[tuple[Plate, ...], tuple[str, ...]]:
    """Return the force plates as ezc3d computes them, in the axes here, and notes."""
    found = []
    for k, platform in enumerate(file["data"]["platform"], start=1):
        force = axes.here(np.asarray(platform["force"], dtype=np.float64).T)
        time = start + np.arange(len(force)) / float(
            _values(file["parameters"]["ANALOG"], "RATE")[0]
        )
        length = LENGTH[_plain(path, platform["unit_position"], LENGTH)]
        moment = MOMENT[_plain(path, platform["unit_moment"], MOMENT)]
        loaded = np.abs(force[:, 1]) > stated.threshold
        point = axes.here(np.asarray(platform["center_of_pressure"]).T * length)
        free = axes.here(np.asarray(platform["Tz"]).T * moment)[:, 1]
        found.append(
            Plate(
                time,
                force,
                np.where(loaded[:, None], point, np.nan),
                np.where(loaded, free, 0.0),
                str(k),
            )
        )
    plates, told = on_the_foot(found)
    if not stated.up:
        check_vertical(path, plates, axes)
    return plates, (told,) if told else ()


def _plain(path: Path, word: str, kinds: Mapping[str, float]) -> str:
    unit = re.sub(r"[\s.*·]", "", word)
    if unit not in kinds:
        message = f"the force plates are in {shown(word)}: must be one of {', '.join(kinds)}"
        raise TrialError(f"{path}: {message}")
    return unit


def _events(file: Any) -> Iterator[FootEvent]:
    """Yield strikes and offs of the feet, in the order of time."""
    group = file["parameters"].get("EVENT", {})
    labels, contexts = _values(group, "LABELS"), _values(group, "CONTEXTS")
    times = np.asarray(_values(group, "TIMES"), dtype=np.float64).reshape(2, -1)
    seconds = times[0] * 60.0 + times[1]
    words = {"foot strike": True, "foot off": False}
    known = zip(seconds.tolist(), contexts, labels, strict=False)
    for time, context, label in sorted(known):
        side, what = str(context).strip().lower(), str(label).strip().lower()
        if side in ("left", "right") and what in words:
            yield FootEvent(time, side, words[what])


def _mass(file: Any) -> float | None:
    """Return the mass of the walker, [kg], by the names that gait software uses."""
    group = file["parameters"].get("PROCESSING", {})
    for name in group:
        if name.lower() in ("bodymass", "mass", "weight") and len(_values(group, name)):
            mass = float(_values(group, name)[0])
            return mass if 1.0 < mass < 500.0 else None
    return None
