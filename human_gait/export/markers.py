"""A marker set on the body, as optical motion capture would see it, and TRC.

Names and sites are those of the Plug-in Gait full-body set, 39 markers, and 8 more without which
the markers would not tell toes, spine and neck; where they are on the segments is in
``data/markers.csv``. Markers are fixed to their segments: there is no skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human_gait import data
from human_gait.arrays import FloatArray
from human_gait.body.joints import segment_frames
from human_gait.body.person import Body
from human_gait.body.skeleton import SEGMENTS
from human_gait.export.notes import Note
from human_gait.export.opensim_format import to_opensim
from human_gait.export.rules import check_names, check_numbers, check_times
from human_gait.values import Value

MILLIMETRES = 1000.0
"""In a metre."""

_TRC_COUNTS = (
    *("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units"),
    *("OrigDataRate", "OrigDataStartFrame", "OrigNumFrames"),
)
_OUTWARD = {"l": 1.0, "r": -1.0}  # the tables are those of the left side


@dataclass(frozen=True, eq=False)
class Marker(Value):
    """One marker.

    Attributes
    ----------
    name : str
        ``LASI``, ``C7``, ...
    segment : str
        One of ``skeleton.SEGMENTS``.
    position : (3,) array, [m]
        From the proximal joint of the segment, in anatomical axes (x left, y up, z forward).
    """

    name: str
    segment: str
    position: FloatArray


def marker_set(body: Body) -> tuple[Marker, ...]:
    """Return the markers of a body."""
    found = []
    for row in data.rows("markers"):
        place = np.array([body.measures.length(row[axis]) for axis in "xyz"])
        if row["side"] == "mid":
            found.append(Marker(row["name"], row["segment"], place))
            continue
        for side, out in _OUTWARD.items():
            segment = row["segment"]
            on = segment if segment in SEGMENTS else f"{segment}_{side}"
            found.append(Marker(side.upper() + row["name"], on, place * [out, 1.0, 1.0]))
    return tuple(found)


def marker_positions(body: Body, q: FloatArray) -> FloatArray:
    """Return where the markers are in the world, (K, n, 3), [m], at postures q (K, 55)."""
    markers, names = marker_set(body), list(SEGMENTS)
    on = segment_frames(body, q)[:, [names.index(marker.segment) for marker in markers]]
    local = np.array([marker.position for marker in markers])
    return np.asarray(np.einsum("kmij,mj->kmi", on[..., :3, :3], local) + on[..., :3, 3])


def save_trc(body: Body, t: FloatArray, q: FloatArray, rate: float, note: Note, path: Path) -> None:
    """Write the markers as TRC, in mm and the axes of OpenSim, at t (K,) [s], postures (K, 55).

    The format has no place for a note but the end of its first line, behind the name of the file.
    """
    names = [marker.name for marker in marker_set(body)]
    places = to_opensim(marker_positions(body, q)).reshape(len(t), -1) * MILLIMETRES
    check_names(path.name, names, r"\s")
    check_numbers(path.name, {"place": places})
    counts = f"{len(t)}\t{len(names)}\tmm\t{rate:g}\t1\t{len(t)}"
    header = [
        "\t".join(["PathFileType", "4", "(X/Y/Z)", path.name, *note.short()]),
        "\t".join(_TRC_COUNTS),
        f"{rate:g}\t{rate:g}\t{counts}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, len(names) + 1) for axis in "XYZ"),
        "",
    ]
    times = [f"{time:.9g}" for time in t.tolist()]
    check_times(path.name, times)
    rows = [
        "\t".join([str(k), time, *(f"{x:.9g}" for x in row)])
        for k, (time, row) in enumerate(zip(times, places.tolist(), strict=True), start=1)
    ]
    path.write_text("\n".join([*header, *rows, ""]), encoding="utf-8")
