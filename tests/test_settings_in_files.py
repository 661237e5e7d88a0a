"""Every setting of a scenario is in every exported file with a place for it.

All of them stand in the note of each file that can have one. Beside this a setting is where a
format has a place of its own for it; a new setting has to be put into ``PLACES``, or into
``NO_PLACE`` with the reason.
"""

import json
import re
import tempfile
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import ezc3d
import pytest
from exports import walking

from human_gait import cli
from human_gait.results.names import EXPORTED
from human_gait.settings.records import all_settings
from human_gait.walk.described import gait_digest
from human_gait.walk.gait_file import save_gait

BODY = ["human.urdf", "model.osim"]
MEASURES = [*BODY, "motion.bvh", "markers.trc"]
FORCES = ["ground_reaction.mot", "ground_reaction.csv"]
LIMITS = [*BODY]

PLACES = {  # a setting, another value, and the files that have a place of their own for it
    "name": ("another", ["markers.c3d"]),
    "subject.sex": ("female", MEASURES),
    "subject.stature": (1.6, [*MEASURES, "markers.c3d"]),
    "subject.mass": (60.0, [*BODY, "markers.c3d"]),
    "subject.thigh": (0.46, MEASURES),
    "subject.shank": (0.46, MEASURES),
    "subject.ankle_height": (0.09, MEASURES),
    "subject.foot": (0.3, MEASURES),
    "subject.hip_width": (0.2, MEASURES),
    "subject.shoulder_width": (0.4, MEASURES),
    "subject.upper_arm": (0.3, MEASURES),
    "subject.forearm": (0.3, MEASURES),
    "subject.hand": (0.2, [*BODY, "motion.bvh"]),
    "subject.head_and_neck": (0.25, MEASURES),
    "phases.double_support": (0.2, [*FORCES, "markers.c3d", "made_from.json"]),
    "phases.foot_flat": (0.1, FORCES),
    "phases.ball_off": (0.1, FORCES),
    "load.mass": (9.0, BODY),
    "load.position": ((0.0, 0.1, -0.2), BODY),
    "load.size": ((0.3, 0.3, 0.3), BODY),
    "load.model": ("force", BODY),
    "ground.friction": (0.3, ["human.urdf"]),
    "ground.sharing": ("parallel", FORCES),
    "ground.pivot_height": (2.0, FORCES),
    "ground.loading": ((0.3, 0.5, 1.0), FORCES),
    "objective.passive_torques": ("none", ["joint_torques.csv"]),
    "posture.pelvis_deg": (5.0, LIMITS),
    "posture.spine_deg": (2.0, LIMITS),
    "posture.neck_deg": (2.0, LIMITS),
    "posture.arms_deg": (10.0, LIMITS),
    "limits.frozen": (("wrist_flexion_r", "wrist_flexion_l"), LIMITS),
    "limits.<joint>": ((1.0, 70.0), LIMITS),
}
PRICES = (
    *("kind", "weighting", "knee", "arms", "passive_cost", "activation_time", "positive_work"),
    *("negative_work", "tendon_stiffness", "steady_trunk", "steady_head"),
)
_MOTION = "the motion is what follows from it"
_SOLVING = "how closely it is solved, which is no property of a walk"
NO_PLACE = {
    "walk.speed": _MOTION,
    "walk.step_length": _MOTION,
    "walk.step_width": _MOTION,
    "phases.heel_unloading": "bounds the pressure, which follows from it",
    "phases.mid_swing": _MOTION,
    "phases.heel_off": _MOTION,
    "posture.swing_knee": _MOTION,
    "posture.limbs": _MOTION,
    "posture.torques": _MOTION,
    "subject.percentile": "stature and mass, which follow from it, have theirs",
    "subject.strength": "bounds the torques, which follow from it",
    "ground.pad": "bounds the pressure, which follows from it",
    "ground.ball": _MOTION,
    "objective.formulation": "what other settings are by default, and those are there",
    **{f"objective.{key}": _MOTION for key in PRICES},
    "discretisation": _SOLVING,
    "tolerances": _SOLVING,
}
WITHOUT_NOTE = {  # and why
    "markers.trc": "the digest alone, behind its name: the format has a line for nothing else",
    "motion.bvh": "BVH has no comments",
    "joint_angles.csv": "a comment would be a row to most readers",
    "joint_torques.csv": "the same",
    "ground_reaction.csv": "the same",
    "joint_trajectory.csv": "the same",
}


@pytest.fixture(scope="module")
def gait():
    return walking("a rigid backpack")


def changed(gait, key, value):
    """The same motion, asked for by another scenario."""
    key = key.replace("<joint>", "knee_flexion_r")
    return replace(gait, scenario=gait.scenario.replace({key: value}))


def exported(gait, folder, formats=None):
    files = {path.name: path for path in gait.export(folder, formats, rate=10)}
    return {name: path.read_bytes() for name, path in files.items()}


def test_every_setting_has_a_place_or_a_reason():
    known = {*PLACES, *NO_PLACE}
    settings = {setting.dotted for setting in all_settings()}
    missing = {key for key in settings if not {key, key.split(".")[0]} & known}
    assert not missing, "say in which file it is, or why it is in none"
    assert all(any(key in (s, s.split(".")[0]) for s in settings) for key in known)
    assert not PLACES.keys() & NO_PLACE.keys()


@pytest.fixture(scope="module")
def usual(gait, tmp_path_factory):
    return exported(gait, tmp_path_factory.mktemp("usual"))


FORMATS_OF = {
    "human.urdf": "urdf",
    "model.osim": "osim",
    "motion.bvh": "bvh",
    "markers.trc": "trc",
    "markers.c3d": "c3d",
    "ground_reaction.mot": "grf",
    "ground_reaction.csv": "csv",
    "joint_torques.csv": "csv",
    "made_from.json": "bvh",
}


@pytest.mark.parametrize("key", PLACES)
def test_a_setting_is_where_the_format_has_a_place_for_it(gait, usual, tmp_path, key):
    value, files = PLACES[key]
    formats = sorted({FORMATS_OF[name] for name in files})
    found = exported(changed(gait, key, value), tmp_path, formats)
    for name in files:
        assert without_note(name, found[name]) != without_note(name, usual[name]), name


def test_every_setting_is_in_the_note_of_every_file_that_has_one(gait, tmp_path):
    own = replace(gait, scenario=gait.scenario.replace(all_changed(gait)))
    expected = gait_digest(own), own.scenario.to_dict()
    found = exported(own, tmp_path)
    assert set(found) == set(EXPORTED)
    for name, content in found.items():
        if name not in WITHOUT_NOTE:
            assert noted(name, content) == expected, name
    assert f"gait_digest={expected[0]}" in found["markers.trc"].decode().splitlines()[0]
    assert set(json.loads(found["made_from.json"])["files"]) == {*EXPORTED} - {"made_from.json"}


def all_changed(gait):
    """Another value for every setting that the splines do not rest on."""
    changes = {"name": "b é--", "limits.frozen": ("wrist_flexion_r",)}
    for setting in all_settings():
        if setting.section in ("", "limits", "walk") or setting.key in ("control_points",):
            continue
        now = getattr(getattr(gait.scenario, setting.section), setting.key)
        if setting.choices:
            others = [choice for choice in setting.choices if choice != now]
            if others and setting.key != "periodicity":
                changes[setting.dotted] = others[0]
        elif setting.count == 1:
            more = now + 0.1 * (setting.high - now)
            changes[setting.dotted] = int(more) if setting.whole else more
    return changes


def test_a_failed_walk_says_so_in_every_file_that_can(gait, tmp_path, capsys):
    failed = replace(
        gait,
        solution={"success": False, "solver": "new\x1b[2Jton\ud800", "status": "gave\nup\x1b[2J"},
    )
    said = "This is no walk: "
    found = exported(failed, tmp_path / "failed")
    for name in ("human.urdf", "model.osim", "external_loads.xml"):
        ET.fromstring(found[name])
    for name, content in found.items():
        whole = content.decode("latin-1")
        assert "\x1b" not in whole or name == "markers.c3d"
        assert (said in whole) == (name not in WITHOUT_NOTE or name == "markers.trc"), name
    for content in exported(gait, tmp_path / "walk", ["trc", "mot", "urdf"]).values():
        assert "no walk" not in content.decode()
    told = {"success": False, "solver": "newton", "status": "gave up"}
    save_gait(replace(gait, solution=told), tmp_path / "failed")
    assert cli.run(["export", str(tmp_path / "failed"), "--format", "bvh"]) == 0
    told = capsys.readouterr()
    assert said in told.err
    assert "\x1b" not in told.err
    assert "wrote 2 files" in told.out


def without_note(name, content):
    """What a file says by itself."""
    if name == "markers.c3d":
        groups = c3d_parameters(content)
        events, person = groups["EVENT"], groups["PROCESSING"]
        told = [str(events[key]["value"]) for key in ("TIMES", "LABELS", "CONTEXTS")]
        about = [person[key]["value"][0] for key in ("Bodymass", "Height", "LLegLength")]
        return [*told, *about, groups["SUBJECTS"]["NAMES"]["value"]]
    text = content.decode()
    if name == "made_from.json":
        return json.loads(text)["events"]
    return re.sub(r"(?m)^(# )?(gait_digest|scenario)=.*$|gait_digest=\w+", "", text)


def noted(name, content):
    """Digest and scenario in the note of a file."""
    if name == "markers.c3d":
        group = c3d_parameters(content)["HUMAN_GAIT"]
        scenario = "".join(group["SCENARIO"]["value"])
        return group["GAIT_DIGEST"]["value"][0], json.loads(scenario)
    text = content.decode()
    if name.endswith(".json"):
        said = json.loads(text)
        return said["gait_digest"], said["scenario"]
    lines = (line.removeprefix("# ") for line in text.splitlines())
    said = dict(line.split("=", 1) for line in lines if line.startswith(("gait_", "scenario=")))
    return said["gait_digest"], json.loads(said["scenario"])


def c3d_parameters(content):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.c3d"
        path.write_bytes(content)
        return ezc3d.c3d(str(path))["parameters"]
