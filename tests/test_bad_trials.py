"""Files of trials that are damaged, or lie, are read or refused in one line that names them."""

import random
import re

import pytest

from human_gait.exceptions import TrialError
from human_gait.trials.profile import Profile
from human_gait.trials.reading import READERS, read_file, read_trial
from human_gait.trials.recording import Recording
from human_gait.trials.stated import Stated, stated

FILES = (
    *("coordinates.mot", "ground_reaction.mot", "joint_torques.sto", "markers.trc", "markers.c3d"),
    *("joint_angles.csv", "ground_reaction.csv"),
)
HEAD = 60  # lines, or a part, of a file that is damaged: enough for header and rows


def some(folder, name):
    """The beginning of an exported file, which is read soon."""
    content = (folder / name).read_bytes()
    return content if name.endswith("c3d") else b"\n".join(content.split(b"\n")[:HEAD]) + b"\n"


def told(path, given=None):
    """What reading a file says: nothing, or the line of its error."""
    try:
        found = read_file(path, given or Stated())
    except TrialError as error:
        line = str(error)
        assert "\n" not in line
        assert line.startswith(f"{path}: ")
        return line
    assert isinstance(found, Recording | Profile)
    return ""


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_ends_early_is_read_or_told(exported, tmp_path, name):
    content, path = some(exported[1], name), tmp_path / name
    lines = []
    for share in (0.0, 0.001, 0.01, 0.1, 0.3, 0.5, 0.7, 0.93, 0.999):
        path.write_bytes(content[: int(share * len(content))])
        lines.append(told(path))
    assert lines[0]
    assert sum(map(bool, lines)) >= 3


@pytest.mark.parametrize("name", FILES)
def test_a_file_with_other_bytes_is_read_or_told(exported, tmp_path, name):
    content, path, chance = some(exported[1], name), tmp_path / name, random.Random(name)
    found = 0
    for _ in range(25):
        damaged = bytearray(content)
        for _ in range(chance.choice((1, 3, 10))):
            damaged[chance.randrange(min(len(damaged), 9000))] = chance.randrange(256)
        path.write_bytes(bytes(damaged))
        found += bool(told(path))
    assert found >= 3


@pytest.mark.parametrize("name", [name for name in FILES if not name.endswith("c3d")])
@pytest.mark.parametrize("way", ["crlf", "mac", "bom", "utf-16", "latin-1", "blank", "comments"])
def test_however_a_text_is_written_it_is_read(exported, tmp_path, name, way):
    content, path = some(exported[1], name), tmp_path / name
    path.write_bytes(content)
    wanted = read_file(path, Stated())
    text = content.decode()
    lines = text.splitlines()
    with_name = text.replace("Coordinates", "Übung", 1)
    path.write_bytes(
        {
            "crlf": content.replace(b"\n", b"\r\n"),
            "mac": content.replace(b"\n", b"\r"),
            "bom": b"\xef\xbb\xbf" + content,
            "utf-16": text.encode("utf-16"),
            "latin-1": with_name.encode("latin-1"),
            "blank": "\n".join([*lines[:-3], "", lines[-3], "   ", *lines[-2:], "", ""]).encode(),
            "comments": "\n".join([*lines[:-3], "# of the day", *lines[-3:]]).encode(),
        }[way]
    )
    assert read_file(path, Stated()) == wanted


@pytest.mark.parametrize("record", [b"\0\2+X", b"\0\0\0\0", b"\1\xff+X"])
def test_a_c3d_record_that_would_end_the_library_is_told(exported, tmp_path, record):
    """A text without a dimension, or longer than its record, which ezc3d follows into nowhere."""
    content, path = some(exported[1], "markers.c3d"), tmp_path / "markers.c3d"
    at = content.index(b"X_SCREEN") + len(b"X_SCREEN\x08\x00\xff")
    assert content[at] == 1
    path.write_bytes(content[:at] + record + content[at + len(record) :])
    assert "X_SCREEN" in told(path)


def test_a_c3d_parameter_that_became_a_group_is_told(exported, tmp_path):
    """What is left of its data is no group, and nothing may be between records."""
    content, path = some(exported[1], "markers.c3d"), tmp_path / "markers.c3d"
    assert b"\x02DESCRIPTIONS" in content
    path.write_bytes(content.replace(b"\x02DESCRIPTIONS", b"\xbeDESCRIPTIONS", 1))
    assert "DESCRIPTIONS" in told(path)


MOT = "m\ninDegrees=yes\nendheader\ntime\tknee_angle_r\n0\t1\n1\t2\n"
TRC = (
    "PathFileType\t4\t(X/Y/Z)\ta.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n100\t100\t2\t2\tmm\n"
    "Frame#\tTime\tRHEE\t\t\tLHEE\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n"
    "1\t0.00\t1\t2\t3\t4\t5\t6\n2\t0.01\t1\t2\t3\t4\t5\t6\n"
)
CSV = "time_s,knee_flexion_r_deg\n0,1\n1,2\n"
PROFILE = "gait_cycle_percent,knee_flexion_mean_deg\n0,1\n50,2\n100,3\n"
VICON = (
    "Model Outputs\n100\n,,A:RKneeAngles,,,B:LKneeAngles,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n"
    ",,deg,deg,deg,deg,deg,deg\n1,0,1,2,3,4,5,6\n2,0,1,2,3,4,5,6\n"
)
BAD = [
    ("a.mot", MOT, "endheader", "", "no line 'endheader'"),
    ("a.mot", MOT, "yes", "perhaps", r"inDegrees = \"perhaps\": must be yes or no"),
    ("a.mot", MOT, "inDegrees=yes", "version=7", r"version = \"7\": must be 1, 2 or 3"),
    ("a.mot", MOT, "inDegrees=yes", "DataType=Vec3", "must be double"),
    ("a.mot", MOT, "time", "zeit", "line 4: no column is called time"),
    (
        "a.mot",
        MOT,
        "time\tknee_angle_r",
        "time\ttime",
        r"line 4: the column \"time\" is there twice",
    ),
    ("a.mot", MOT, "1\t2", "1\tx", r"line 6, column knee_angle_r: \"x\": must be a number"),
    ("a.mot", MOT, "1\t2", "1\t1,5", r"line 6, column knee_angle_r: \"1,5\""),
    ("a.mot", MOT, "1\t2", "1\tinf", "row 2, column knee_angle_r: is infinite"),
    ("a.mot", MOT, "1\t2", "1\t2\t3", "line 6: has 3 columns, the header has 2"),
    ("a.mot", MOT, "1\t2", "1", "line 6: has 1 columns, the header has 2"),
    ("a.mot", MOT, "1\t2", "-1\t2", "time = -1 in row 2: must be after 0"),
    ("a.mot", MOT, "1\t2", "0\t2", "time = 0 in row 2: must be after 0"),
    ("a.mot", MOT, "1\t2", "nan\t2", "time in row 2: missing"),
    ("a.mot", MOT, "0\t1\n1\t2\n", "", "has no row of numbers"),
    ("a.mot", MOT, "knee_angle_r", "ground_force_vx", "the plate has no force along y, z"),
    ("a.trc", TRC, "Frame#", "Bild", "no line that begins with 'Frame#'"),
    ("a.trc", TRC, "mm", "feet", r"Units = \"feet\": must be one of mm, cm, m: give --units mm"),
    ("a.trc", TRC, "LHEE", "RHEE", r"line 4: the column \"RHEE\" is there twice"),
    ("a.trc", TRC, "\tLHEE\t\t", "", "line 7: has 8 columns, the header has 5"),
    ("a.trc", TRC, "0.01", "0.00", "Time = 0 in row 2: must be after 0"),
    (
        "a.csv",
        CSV,
        "time_s",
        "frame",
        "no column is called time_s or gait_cycle_percent, but frame",
    ),
    ("a.csv", CSV, CSV, "# only\n", "has no line but comments"),
    (
        "a.csv",
        VICON,
        "B:LKnee",
        "B:RKnee",
        r"line 3: \"A:RKneeAngles\" and \"B:RKneeAngles\" are of two subjects",
    ),
    ("a.csv", VICON, "\n2,0", "\n1,0", "the time by Frame = 0 in row 2: must be after 0"),
    ("a.csv", VICON, "\n2,0", "\n,0", "the time by Frame in row 2: missing"),
    ("a.csv", CSV, "1,2", '1,"a,b"', r"line 3, column knee_flexion_r_deg: \"a,b\""),
    ("a.csv", CSV, "time_s,", "time_s,,", "line 1: column 2 has no name"),
    ("a.csv", PROFILE, "50,", "500,", "gait_cycle_percent: must rise within 0 to 100"),
    ("a.csv", PROFILE, "50,2\n100,3\n", "", "gait_cycle_percent: must rise within 0 to 100"),
]


@pytest.mark.parametrize(("name", "text", "old", "new", "message"), BAD)
def test_what_is_wrong_is_named(tmp_path, name, text, old, new, message):
    path = tmp_path / name
    path.write_text(text)
    assert not told(path)
    path.write_text(text.replace(old, new, 1))
    assert re.search(message, told(path)), told(path)


def test_what_is_missing_in_a_row_is_no_number_but_a_gap(tmp_path):
    path = tmp_path / "a.trc"
    path.write_text(TRC.replace("1\t2\t3\t4\t5\t6\n2", "1\t2\t3\t\t\t\n2"))
    found = read_trial(path).markers
    assert [bool(x) for x in (found["LHEE"] != found["LHEE"]).all(axis=1)] == [True, False]
    path.write_text(TRC.replace("1\t2\t3\t4\t5\t6\n2", "0\t0\t0\tNaN\t\tNA\n2"))
    found = read_trial(path).markers
    assert (found["LHEE"][0] != found["LHEE"][0]).all()
    assert (found["RHEE"][0] != found["RHEE"][0]).all()


@pytest.mark.parametrize("name", ["missing.mot", "folder.csv", "a.xlsx", "empty.trc"])
def test_a_file_that_is_none_is_told(tmp_path, name):
    path = tmp_path / name
    if name == "folder.csv":
        path.mkdir()
    elif name != "missing.mot":
        path.write_text(" \n")
    line = told(path)
    assert line
    if name == "a.xlsx":
        assert all(ending in line for ending in READERS)


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("units", "furlong"),
        ("up", "north"),
        ("forward", "xy"),
        ("map", ["knee_flexion_deg"]),
        ("events", "0.5"),
        ("events", "1.5,0.5"),
        ("events", "a,b"),
        ("feet", ["1=left"]),
        ("mass", 0.0),
        ("side", "both"),
    ],
)
def test_an_option_that_cannot_be_is_told_by_its_name(option, value):
    with pytest.raises(TrialError) as found:
        stated(**{option: value})
    assert str(found.value).startswith(f"--{option} = ")
    assert "\n" not in str(found.value)
