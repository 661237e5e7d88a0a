"""The walk as C3D: markers, force plates, events and who walks, for gait software.

It goes on for three steps, to the second strike of the right heel: both sides have a whole cycle.
All is in mm and the axes of OpenSim (x forward, y up, z right), in single precision: 1e-4 mm.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray
from human_gait.body.person import Body
from human_gait.body.skeleton import SIDES, SIDES_IN_WORDS
from human_gait.exceptions import ResultError
from human_gait.export.events import foot_events
from human_gait.export.markers import MILLIMETRES, marker_positions, marker_set
from human_gait.export.notes import Note
from human_gait.export.opensim_format import AXES, to_opensim
from human_gait.export.rules import check_count, check_names, check_numbers
from human_gait.walk.gait import Gait, Samples

STEPS = 3
"""How many steps the file holds."""

_MOST_FRAMES = 65_535  # what 16 bits count
_LONGEST_NAME = 127
_LINE = 120  # characters: a text of the file has at most 255
_LARGEST = float(np.finfo(np.float32).max)
_ANALOG_RATE = 500  # of force plates, at least, [Hz]
_MARGIN = 0.1  # of a plate around the feet, [m]
_CHANNELS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
_PLATE: FloatArray = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""(3, 3) axes of a plate, by columns: forward, right, down."""


@dataclass(frozen=True, eq=False)
class _Plate:
    """A force plate below all steps of one foot.

    Attributes
    ----------
    corners : (4, 3) array, [mm]
        From the middle (+, +), (-, +), (-, -), (+, -) along its axes.
    channels : (K, 6) array, [N], [N mm]
        Force on the foot and its moment about the middle of the plate, along its axes.
    """

    corners: FloatArray
    channels: FloatArray


def frame_count(gait: Gait, rate: float, name: str) -> int:
    """Return how many frames the file of a name has, which are counted before they are made.

    Raises
    ------
    ResultError
        If the format cannot count them.
    """
    length = STEPS * gait.step_time
    frames = int(np.ceil(length * rate - 1e-9)) + 1
    most = int((_MOST_FRAMES - 2) / length)
    check_count(name, "frames", frames, _MOST_FRAMES, f"at most {most} a second of this walk")
    return frames


def save_c3d(gait: Gait, rate: float, note: Note, path: Path) -> None:
    """Write ``STEPS`` steps of a gait as C3D, `rate` frames a second.

    Raises
    ------
    ResultError
        If the format cannot hold it.
    """
    import ezc3d  # noqa: PLC0415, 0.2 s to import

    frames = frame_count(gait, rate, path.name)
    per_frame = int(np.ceil(_ANALOG_RATE / rate))
    now = gait.instants(np.arange(frames * per_frame) / (rate * per_frame))
    file = ezc3d.c3d()
    _add_points(file, gait.body, now.q[::per_frame], rate, path.name)
    _add_plates(file, [_plate(now, f) for f in range(len(SIDES))], rate * per_frame, path.name)
    _add_events(file, gait, (frames - 1) / rate)
    _add_subject(file, gait)
    _add_trial(file, frames, rate, note)
    _write(file, path)


def _add_points(file: Any, body: Body, q: FloatArray, rate: float, name: str) -> None:
    markers = marker_set(body)
    places = to_opensim(marker_positions(body, q)) * MILLIMETRES
    check_names(name, [marker.name for marker in markers], r"\s:", _LONGEST_NAME)
    check_numbers(name, {"place": places}, _LARGEST)
    file["data"]["points"] = np.concatenate([places.T, np.ones((1, len(markers), len(q)))])
    point = file["parameters"]["POINT"]
    point["RATE"]["value"], point["UNITS"]["value"] = [rate], ["mm"]
    point["LABELS"]["value"] = [marker.name for marker in markers]
    point["DESCRIPTIONS"]["value"] = [f"on {marker.segment}" for marker in markers]
    file.add_parameter("POINT", "X_SCREEN", [AXES["forward"]])
    file.add_parameter("POINT", "Y_SCREEN", [AXES["up"]])


def _plate(now: Samples, f: int) -> _Plate:
    """Return the plate of a foot, with the moments that its force has about the middle."""
    ground = to_opensim(now.points[:, f].reshape(-1, 3))
    low, high = ground.min(axis=0) - _MARGIN, ground.max(axis=0) + _MARGIN
    middle, half = (low + high) / 2, (high - low) / 2
    middle[1] = half[1] = 0.0
    signs = np.array([[1, 0, 1], [-1, 0, 1], [-1, 0, -1], [1, 0, -1]])
    force = to_opensim(now.grf[:, f])
    moment = np.cross(to_opensim(now.cop[:, f]) - middle, force) * MILLIMETRES
    moment[:, 1] += now.yaw_moment[:, f] * MILLIMETRES
    loaded = force.any(axis=1, keepdims=True)
    channels = np.concatenate([force @ _PLATE, np.where(loaded, moment, 0.0) @ _PLATE], axis=1)
    return _Plate((middle + signs * half) * MILLIMETRES, channels)


def _add_plates(file: Any, plates: Sequence[_Plate], rate: float, name: str) -> None:
    """Add the plates as those of type 2: six channels each, about the middle of the surface."""
    channels = np.concatenate([plate.channels for plate in plates], axis=1)
    check_numbers(name, {"force plates": channels}, _LARGEST)
    n = channels.shape[1]
    file["data"]["analogs"] = channels.T[None]
    analog, platform = (file["parameters"][group] for group in ("ANALOG", "FORCE_PLATFORM"))
    labels = [f"{channel}_{side}" for side in SIDES for channel in _CHANNELS]
    analog["RATE"]["value"], analog["GEN_SCALE"]["value"] = [rate], [1.0]
    analog["LABELS"]["value"] = labels
    analog["DESCRIPTIONS"]["value"] = [
        f"plate of the {side} foot" for side in SIDES_IN_WORDS for _ in _CHANNELS
    ]
    analog["UNITS"]["value"] = [
        unit for _ in SIDES for unit in ("N", "N", "N", "Nmm", "Nmm", "Nmm")
    ]
    analog["SCALE"]["value"], analog["OFFSET"]["value"] = np.ones(n), np.zeros(n, dtype=int)
    platform["USED"]["value"], platform["TYPE"]["value"] = [len(plates)], [2] * len(plates)
    platform["CORNERS"]["value"] = np.stack([plate.corners.T for plate in plates], axis=2)
    platform["ORIGIN"]["value"] = np.zeros((3, len(plates)))
    platform["CHANNEL"]["value"] = np.arange(1, n + 1).reshape(len(plates), -1).T


def _add_events(file: Any, gait: Gait, end: float) -> None:
    """Add heel strikes and toe offs, in the words of gait software."""
    events = foot_events(gait, end)
    words = {True: ("Foot Strike", 1), False: ("Foot Off", 2)}
    minutes, seconds = zip(*(divmod(event.time, 60.0) for event in events), strict=True)
    values = {
        "USED": len(events),
        "CONTEXTS": [event.side.capitalize() for event in events],
        "LABELS": [words[event.strike][0] for event in events],
        "DESCRIPTIONS": ["from the phases of the scenario"] * len(events),
        "TIMES": np.array([minutes, seconds]),
        "SUBJECTS": [_short(gait.scenario.name)] * len(events),
        "ICON_IDS": [words[event.strike][1] for event in events],
        "GENERIC_FLAGS": [0] * len(events),
    }
    _add_group(file, "EVENT", values)


def _add_subject(file: Any, gait: Gait) -> None:
    """Add who walks: name, mass [kg], stature and legs [mm], under the names of gait software.

    A leg reaches from the spine of the ilium to the ankle, as one measures it.
    """
    subject, body = gait.scenario.subject, gait.body
    names = [marker.name for marker in marker_set(body)]
    places = marker_positions(body, np.zeros((1, 55)))[0] * MILLIMETRES
    at = dict(zip(names, places, strict=True))
    values = {"Bodymass": subject.mass, "Height": subject.stature * MILLIMETRES}
    for side in SIDES:
        spine, ankle = (at[f"{side.upper()}{name}"] for name in ("ASI", "ANK"))
        values[f"{side.upper()}LegLength"] = float(np.linalg.norm(spine - ankle))
    _add_group(file, "PROCESSING", {name: [value] for name, value in values.items()})
    about = {
        "USED": 1,
        "IS_STATIC": 0,
        "USES_PREFIXES": 0,
        "NAMES": [_short(gait.scenario.name)],
        "MARKER_SETS": ["Plug-in Gait FullBody and 8 more"],
    }
    _add_group(file, "SUBJECTS", about)


def _add_trial(file: Any, frames: int, rate: float, note: Note) -> None:
    """Add the first and the last frame, and what the file was made from."""
    ends = {"ACTUAL_START_FIELD": 1, "ACTUAL_END_FIELD": frames}
    fields = {name: [frame % 2**16, frame // 2**16] for name, frame in ends.items()}
    _add_group(file, "TRIAL", {**fields, "CAMERA_RATE": [float(rate)]})
    _add_group(file, "MANUFACTURER", {"COMPANY": ["human_gait"], "SOFTWARE": ["human_gait"]})
    said = note.entries()
    scenario = json.dumps(said.pop("scenario", {}), separators=(",", ":"))
    said["scenario"] = scenario.replace(" ", "\\u0020")  # which would be lost where a line ends
    _add_group(file, "HUMAN_GAIT", {name.upper(): _lines(text) for name, text in said.items()})


def _short(name: str) -> str:
    """Return as much of a name as readers take; the whole is in the note."""
    return name.encode()[:_LONGEST_NAME].decode(errors="ignore")


def _lines(text: str) -> list[str]:
    plain = text.encode("ascii", "backslashreplace").decode()
    return [plain[k : k + _LINE] for k in range(0, len(plain), _LINE)]


def _add_group(file: Any, group: str, values: dict[str, Any]) -> None:
    """Add parameters; lists of whole numbers as such, which ezc3d would make others of."""
    from ezc3d import ezc3d  # noqa: PLC0415, 0.2 s to import

    for name, value in values.items():
        file.add_parameter(group, name, value)
        if isinstance(value, list) and isinstance(value[0], int):
            file["parameters"][group][name]["type"] = ezc3d.INT


def _write(file: Any, path: Path) -> None:
    """Write it elsewhere first: the library takes UTF-8 alone, and says nothing of a full disk."""
    usual = tempfile.gettempdir()
    with tempfile.TemporaryDirectory(dir=usual if _is_utf8(usual) else "/tmp") as folder:
        whole = Path(folder) / path.name
        file.write(str(whole))
        content = whole.read_bytes()
    least = 4 * (file["data"]["points"].size + file["data"]["analogs"].size)
    if len(content) < least:
        raise ResultError(f"{path.name}: cannot be written: no space left for temporary files")
    path.write_bytes(content)


def _is_utf8(path: str) -> bool:
    try:
        path.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True
