"""One stride of a gait as files for other programs; ``docs/exports.md`` tells what each holds."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.export import opensim_tables, tables
from human_gait.export.bvh import save_bvh
from human_gait.export.c3d import frame_count, save_c3d
from human_gait.export.events import foot_events
from human_gait.export.markers import save_trc
from human_gait.export.notes import Note
from human_gait.export.opensim import save_model
from human_gait.export.ranges import JointRanges, joint_ranges
from human_gait.export.robot import robot_text
from human_gait.export.trajectory import (
    save_controller_trajectory,
    save_trajectory_csv,
    save_trajectory_json,
)
from human_gait.results import names
from human_gait.results.ours import given_path, our_folder
from human_gait.walk.gait import Gait, Samples, onward

RATE, OPENSIM_RATE = 100, 1000
"""Samples per second by default, [Hz]; OpenSim differentiates twice and needs more of them."""

RATES = (10, 10_000)
"""The lowest and the highest rate, [Hz]."""

MARGIN = 0.2
"""What OpenSim's motion and forces have before and after the stride, [s].

OpenSim differentiates and filters them, which needs neighbours.
"""


@dataclass(frozen=True)
class SampledStride:
    """One stride, from left heel strike to left heel strike, sampled evenly.

    Attributes
    ----------
    gait : Gait
    rate : float, [Hz]
    samples : Samples
        At k / rate, from 0 to 2 T.
    padded : Samples
        The same with ``MARGIN`` of the walk before and after.
    """

    gait: Gait
    rate: float
    samples: Samples
    padded: Samples

    @cached_property
    def note(self) -> Note:
        """What the files are made from."""
        return Note.of(self.gait)

    @cached_property
    def ranges(self) -> JointRanges:
        """How far the joints move, in the scenario and in these samples."""
        return joint_ranges(self.gait.scenario.subject, self.gait.scenario, self.samples)

    def about(self) -> dict[str, Any]:
        """Return what the files are made from, and when the feet meet and leave the ground."""
        events = foot_events(self.gait, 2 * self.gait.step_time)
        return self.note.entries() | {"events": [asdict(event) for event in events]}


def _mot(stride: SampledStride, folder: Path) -> None:
    opensim_tables.save_coordinates(stride.padded, stride.note, folder / names.OPENSIM_COORDINATES)


def _grf(stride: SampledStride, folder: Path) -> None:
    opensim_tables.save_ground_reaction(stride.padded, stride.note, folder / names.OPENSIM_FORCES)
    opensim_tables.save_external_loads(stride.note, folder / names.OPENSIM_LOADS)


def _sto(stride: SampledStride, folder: Path) -> None:
    opensim_tables.save_torques(stride.padded, stride.note, folder / names.OPENSIM_TORQUES)


def _osim(stride: SampledStride, folder: Path) -> None:
    save_model(stride.gait.body, stride.ranges, stride.note, folder / names.OPENSIM_MODEL)


def _trc(stride: SampledStride, folder: Path) -> None:
    now = stride.samples
    path = folder / names.MARKERS_TRC
    save_trc(stride.gait.body, now.t, now.q, stride.rate, stride.note, path)


def _c3d(stride: SampledStride, folder: Path) -> None:
    save_c3d(stride.gait, stride.rate, stride.note, folder / names.MARKERS_C3D)


def _bvh(stride: SampledStride, folder: Path) -> None:
    save_bvh(stride.gait.body, stride.samples.q, stride.rate, folder / names.ANIMATION)


def _csv(stride: SampledStride, folder: Path) -> None:
    tables.save_joint_angles(stride.samples, folder / names.ANGLES_TABLE)
    tables.save_joint_torques(stride.samples, folder / names.TORQUES_TABLE)
    tables.save_ground_reaction(stride.samples, folder / names.FORCES_TABLE)


def _urdf(stride: SampledStride, folder: Path) -> None:
    gait = stride.gait
    text = robot_text(gait.body, stride.ranges, gait.scenario.ground.friction, stride.note)
    (folder / names.ROBOT).write_text(text, encoding="utf-8")
    save_trajectory_csv(stride.samples, folder / names.TRAJECTORY_CSV)
    save_trajectory_json(stride.samples, stride.about(), folder / names.TRAJECTORY_JSON)
    path = folder / names.TRAJECTORY_CONTROLLER
    save_controller_trajectory(stride.samples, stride.ranges, stride.note, path)


FORMATS: Mapping[str, Callable[[SampledStride, Path], None]] = MappingProxyType(
    {
        "osim": _osim,
        "mot": _mot,
        "grf": _grf,
        "sto": _sto,
        "trc": _trc,
        "c3d": _c3d,
        "bvh": _bvh,
        "csv": _csv,
        "urdf": _urdf,
    }
)
"""What there is, by name: each writes its files to a folder."""

_FOR_OPENSIM = ("mot", "grf", "sto")


def export_gait(
    gait: Gait, folder: Path, formats: Collection[str] = tuple(FORMATS), rate: float | None = None
) -> list[Path]:
    """Write one stride of a gait to a folder, all files or none, and return their paths.

    Parameters
    ----------
    gait : Gait
    folder : Path
        Other files in it stay.
    formats : collection of str
        Names of ``FORMATS``; all by default.
    rate : float, [Hz]
        Samples per second, within ``RATES``; by default ``OPENSIM_RATE`` in the tables for OpenSim
        (mot, grf, sto) and ``RATE`` in all else.

    Raises
    ------
    ValueError
        If there is no such format or the rate is out of range.
    ResultError
        If the files cannot be written; what was there is then as it was.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise ValueError(f"no format is called {unknown[0]!r}: choose from {', '.join(FORMATS)}")
    rates = {name: _usual_rate(name) if rate is None else rate for name in formats}
    for hertz in rates.values():
        _check_rate(hertz)
    if "c3d" in rates:
        frame_count(gait, rates["c3d"], names.MARKERS_C3D)
    strides = {hertz: sampled(gait, hertz) for hertz in set(rates.values())}
    with our_folder(folder, solved=False) as new:
        for name, hertz in rates.items():
            FORMATS[name](strides[hertz], new)
        written = sorted(path.name for path in new.iterdir())
        _save_note(next(iter(strides.values())), written, new / names.MADE_FROM)
        written.append(names.MADE_FROM)
    return [folder / name for name in written]


def _save_note(stride: SampledStride, files: Sequence[str], path: Path) -> None:
    """Write what the files were made from, for those that have no place for it."""
    content = {"files": files, **stride.about()}
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def export(
    gait: Gait,
    folder: str | Path,
    formats: str | Collection[str] | None = None,
    rate: float | None = None,
) -> list[Path]:
    """Write one stride of a gait to a folder, as `Gait.export` says."""
    names = [formats] if isinstance(formats, str) else formats or tuple(FORMATS)
    return export_gait(gait, given_path(folder), names, rate)


def _usual_rate(name: str) -> float:
    """Return the samples per second of a format where none are asked for, [Hz]."""
    return OPENSIM_RATE if name in _FOR_OPENSIM else RATE


def sampled(gait: Gait, rate: float) -> SampledStride:
    """Return one stride of a gait, `rate` samples a second."""
    _check_rate(rate)
    last, more = (int(np.floor(time * rate + 1e-9)) for time in (2 * gait.step_time, MARGIN))
    t = np.arange(-more, last + more + 1) / rate
    padded = _around_zero(gait, t)
    return SampledStride(gait, rate, _cut(padded, slice(more, more + last + 1)), padded)


def _check_rate(rate: float) -> None:
    if not RATES[0] <= rate <= RATES[1]:
        raise ValueError(f"rate = {rate}: must be from {RATES[0]} to {RATES[1]} Hz")


def _around_zero(gait: Gait, t: FloatArray) -> Samples:
    """Return the gait at times t (K,) >= -2 T: as a stride later, moved back by its length."""
    later = gait.instants(t + 2 * gait.step_time)
    back = np.full(len(t), -2, dtype=np.intp)
    return onward(replace(later, t=t), back, gait.cycle)


def _cut(samples: Samples, part: slice) -> Samples:
    return Samples(**{name: values[part] for name, values in vars(samples).items()})
