"""A marker set on the body, as optical motion capture would see it: TRC and C3D.

Names and sites are those of the Plug-in Gait full-body set, 39 markers; where they are on the
segments is in ``data/markers.csv``. Markers are fixed to their segments: there is no skin.
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
from human_gait.export.opensim_format import AXES, to_opensim
from human_gait.values import Value

_MILLIMETRES = 1000.0
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


def save_trc(body: Body, t: FloatArray, q: FloatArray, rate: float, path: Path) -> None:
    """Write the markers as TRC, in mm and the axes of OpenSim, at t (K,) [s], postures (K, 55)."""
    names = [marker.name for marker in marker_set(body)]
    places = to_opensim(marker_positions(body, q)).reshape(len(t), -1) * _MILLIMETRES
    counts = f"{len(t)}\t{len(names)}\tmm\t{rate:g}\t1\t{len(t)}"
    header = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "\t".join(_TRC_COUNTS),
        f"{rate:g}\t{rate:g}\t{counts}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, len(names) + 1) for axis in "XYZ"),
        "",
    ]
    rows = [
        "\t".join([str(k), f"{time:.9g}", *(f"{x:.9g}" for x in row)])
        for k, (time, row) in enumerate(zip(t.tolist(), places.tolist(), strict=True), start=1)
    ]
    path.write_text("\n".join([*header, *rows, ""]), encoding="utf-8")


def save_c3d(body: Body, q: FloatArray, rate: float, path: Path) -> None:
    """Write the markers as C3D, in mm and the axes of OpenSim, at postures (K, 55) `rate` a second.

    C3D numbers are of single precision: 1e-4 mm.
    """
    import ezc3d  # noqa: PLC0415, 0.2 s to import

    markers = marker_set(body)
    places = to_opensim(marker_positions(body, q)) * _MILLIMETRES
    file = ezc3d.c3d()
    file["data"]["points"] = np.concatenate([places.T, np.ones((1, len(markers), len(q)))])
    point = file["parameters"]["POINT"]
    point["RATE"]["value"], point["UNITS"]["value"] = [rate], ["mm"]
    point["LABELS"]["value"] = [marker.name for marker in markers]
    point["DESCRIPTIONS"]["value"] = [f"on {marker.segment}" for marker in markers]
    file.add_parameter("POINT", "X_SCREEN", [AXES["forward"]])
    file.add_parameter("POINT", "Y_SCREEN", [AXES["up"]])
    file.write(str(path))
