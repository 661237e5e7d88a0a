"""Measured people in our body: own exports come back, and what is not kept is said."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from walking import guessed_gait

import human_gait as hg
from human_gait.body.joints import segment_frames
from human_gait.body.limits import joint_limits
from human_gait.body.person import make_body
from human_gait.body.skeleton import DOF_NAMES, PRISMATIC, SEGMENTS, index
from human_gait.cli import run
from human_gait.exceptions import TrialError
from human_gait.export.markers import marker_positions, marker_set
from human_gait.trials.calls import fit, strikes_given
from human_gait.trials.contacts import contacts
from human_gait.trials.feet_forces import by_foot, mean_forces, strikes_by_forces
from human_gait.trials.fitting import fitted
from human_gait.trials.inverse_kinematics import MarkedBody, Seen, postures
from human_gait.trials.marker_names import segment_of, sites
from human_gait.trials.motion import Person
from human_gait.trials.recording import Plate, Recording
from human_gait.trials.scaling import scaled
from human_gait.trials.steps import cut, turned, turned_points
from human_gait.walk.described import no_walk
from human_gait.walk.gait_file import load_gait

GUESS = guessed_gait()
GAIT = replace(GUESS, control_points=np.clip(GUESS.control_points, *joint_limits(GUESS.scenario)))
BODY, T = GAIT.body, GAIT.step_time
NAMES = [marker.name for marker in marker_set(BODY)]
STRIDE = np.linspace(0.0, 2.0 * T, 101)
STRIKES = strikes_given(f"left:0,{T},{2 * T}")
FILES = {
    "angles": ("coordinates.mot", "ground_reaction.mot"),
    "markers": ("markers.trc", "ground_reaction.mot"),
    "c3d": ("markers.c3d",),
}
LEGS = [index(f"{joint}_{side}") for joint in ("hip_flexion", "knee_flexion") for side in "rl"]


def frames(rate=100.0, strides=1):
    return np.arange(round(2 * T * strides * rate) + 1) / rate


def places(t, body=BODY):
    return marker_positions(body, GAIT.q(t))


def plates(t):
    now = GAIT.instants(t)
    point = np.where(now.grf[..., 1:2] > 0.0, now.cop, np.nan)
    return tuple(
        Plate(t, now.grf[:, f], point[:, f], now.yaw_moment[:, f], "rl"[f]) for f in (0, 1)
    )


def trial(markers):
    return Recording(Path("trial.trc"), frames(), markers=markers, plates=plates(frames(1000.0)))


def named(x, keep=None):
    return {NAMES[i]: x[:, i] for i in (range(len(NAMES)) if keep is None else keep)}


def angles_of(q=None, t=None):
    """A trial with all our coordinates, under the forces of the walk."""
    t = frames() if t is None else t
    columns = dict(zip(DOF_NAMES, (GAIT.q(t) if q is None else q).T, strict=True))
    return Recording(Path("trial.mot"), t, angles=columns, plates=plates(frames(1000.0)))


def fitted_angles(recording, **options):
    return fitted(recording, **{"base": GAIT.scenario, "strikes": STRIKES, **options})


def fit_of(markers, **options):
    given = {"base": GAIT.scenario, "strikes": STRIKES, **options}
    return fitted(trial(markers), **given)


def angle_error(found, t=STRIDE):
    """Largest difference of every turning DOF over the stride, [deg]."""
    apart = np.abs(GAIT.q(t) - found.q(t * found.step_time / T))
    return np.rad2deg(apart[:, ~PRISMATIC].max(axis=0))


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    GAIT.export(folder, ["mot", "grf", "trc", "c3d"])
    return folder


@pytest.fixture(scope="module")
def measured(exported):
    return fit([exported / name for name in FILES["markers"]])


@pytest.fixture(scope="module")
def saved(measured, tmp_path_factory):
    return measured.save(tmp_path_factory.mktemp("out") / "measured")


@pytest.mark.parametrize("kind", FILES)
def test_own_exports_come_back(exported, measured, kind):
    """Angles within 0.5 deg, torques within 1 % of the peak; c3d has force plates of its own."""
    files = [exported / name for name in FILES[kind]]
    found = measured if kind == "markers" else fit(files)
    assert angle_error(found).max() < 0.5
    t = STRIDE[(STRIDE % T > 0.01) & (STRIDE % T < T - 0.01)]  # at strikes forces jump
    off = np.abs(GAIT.tau(t) - found.tau(t))[:, 6:].max(axis=0)
    peak = np.abs(GAIT.tau(STRIDE)).max()
    assert off.max() < 0.01 * peak
    assert found.scenario.subject.stature == pytest.approx(GAIT.scenario.subject.stature, abs=1e-3)
    assert found.scenario.walk.step_length == pytest.approx(0.66, abs=1e-4)


def test_angles_come_back_without_what_lies_beside(exported, tmp_path):
    """Strikes by the forces alone, other splines."""
    files = [tmp_path / name for name in FILES["markers"]]
    for path in files:
        path.write_bytes((exported / path.name).read_bytes())
    found = fit(files)
    assert found.scenario.discretisation.control_points == 14
    assert np.sort(angle_error(found))[-1] < 2.0
    assert np.median(angle_error(found)) < 0.2
    assert found.scenario.subject.mass == pytest.approx(78.4, rel=0.01)


def test_markers_move_as_their_derivatives_say():
    rng = np.random.default_rng(0)
    q, along = GAIT.q([0.1, 0.3]), rng.normal(size=55)
    body = MarkedBody(BODY, sites([*NAMES, "SACR"], BODY))
    step = 1e-6 * along
    moved = (body.places(q + step) - body.places(q - step)) / 2e-6
    np.testing.assert_allclose(body.linearised(q)[1] @ along, moved, atol=1e-8)
    np.testing.assert_allclose(body.places(q)[:, :-1], marker_positions(BODY, q), atol=1e-12)


def test_postures_are_found_from_markers():
    q = GAIT.q(frames(20.0))
    seen = Seen(sites(NAMES, BODY), marker_positions(BODY, q))
    found = postures(BODY, seen)
    assert np.rad2deg(np.abs(found.q - q)[:, 3:].max()) < 0.01
    assert found.told.min() > 0.9


def test_a_marker_that_is_not_seen_for_a_while_does_not_count():
    q = GAIT.q(frames(20.0))
    x = marker_positions(BODY, q)
    x[3:6, NAMES.index("LKNE")] = np.nan
    found = postures(BODY, Seen(sites(NAMES, BODY), x))
    assert np.rad2deg(np.abs(found.q - q)[:, 3:].max()) < 0.01


def unseen(t, start, frames_, keep=()):
    """Markers of a walk, but for some frames only a few."""
    x = places(t)
    gone = [i for i, name in enumerate(NAMES) if name not in keep]
    x[start : start + frames_, gone] = np.nan
    return named(x)


@pytest.mark.parametrize("keep", [(), ("LASI", "RASI", "LPSI", "RPSI", "C7", "RKNE", "RANK")])
def test_frames_with_too_few_markers_do_not_count(keep):
    found = fit_of(unseen(frames(), 40, 8, keep))
    assert angle_error(found).max() < 1.0
    told = found.solution["measured"]["not_kept"]
    assert "8 of 111 frames have too few markers of the legs: left out" in told


def test_a_step_with_a_long_gap_does_not_count():
    t = frames(strides=2)
    floor = plates(frames(1000.0, strides=2))
    strikes = strikes_given("left:" + ",".join(str(k * T) for k in range(5)))
    whole = Recording(Path("trial.trc"), t, markers=unseen(t, 20, 14), plates=floor)
    found = fitted(whole, base=GAIT.scenario, strikes=strikes)
    assert "the mean of 3 steps" in found.solution["measured"]["what"]
    assert angle_error(found).max() < 1.0
    with pytest.raises(TrialError, match=r"without 0.190 to 0.340 s, where frames are missing"):
        fit_of(unseen(frames(), 20, 14))


def test_most_markers_with_noise_still_show_a_walk():
    """5 mm in each direction, 28 of 47 markers: legs within 3 deg, and the residual is told."""
    rng = np.random.default_rng(2)
    keep = sorted(rng.permutation(len(NAMES))[:28])
    x = places(frames())
    found = fit_of(named(x + rng.normal(0.0, 0.005, x.shape), keep))
    off = np.rad2deg(GAIT.q(STRIDE) - found.q(STRIDE * found.step_time / T))
    assert np.sqrt((off[:, LEGS] ** 2).mean(axis=0)).max() < 3.0
    story = " ".join(found.solution["measured"]["not_kept"])
    assert "over, which nothing gives to the pelvis" in story
    assert float(story.split("markers are ")[1].split()[0]) == pytest.approx(8.0, abs=3.0)


def test_what_no_marker_tells_is_taken_from_the_other_side_or_named():
    """Right of the knee there is none, and none on the toes of both sides."""
    lost = {"RKNE", "RTIB", "RANK", "RHEE", "RTOE", "RHLX", "LHLX"}
    found = fit_of(named(places(frames()), [i for i, name in enumerate(NAMES) if name not in lost]))
    assert angle_error(found)[[index(f"knee_flexion_{side}") - 3 for side in "rl"]].max() < 1.0
    told = " ".join(found.solution["measured"]["not_kept"])
    assert "no marker tells right toe extension, left toe extension: taken as at rest" in told


@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_lengths_follow_from_markers(noise):
    person = replace(BODY.subject, stature=1.80, thigh=0.46, shank=0.42, upper_arm=0.31)
    x = marker_positions(make_body(person), GAIT.q(frames(20.0)))
    x += np.random.default_rng(0).normal(0.0, noise, x.shape)
    seen = Seen(sites(NAMES, BODY), x)
    found = scaled(hg.Subject.default("male"), hg.Load(), seen, stature_known=False)
    for name in ("stature", "thigh", "shank", "upper_arm"):
        assert getattr(found, name) == pytest.approx(getattr(person, name), abs=1e-4 + 2 * noise)


def test_of_few_markers_the_stature_alone_follows():
    person = hg.Subject("male", 1.9, 78.4)
    keep = [NAMES.index(name) for name in ("LASI", "RASI", "LPSI", "RPSI", "C7", "LSHO", "RSHO")]
    x = marker_positions(make_body(person), GAIT.q(frames(20.0)))[:, keep]
    seen = Seen(sites([NAMES[i] for i in keep], BODY), x)
    found = scaled(hg.Subject.default("male"), hg.Load(), seen, stature_known=False)
    assert found.stature == pytest.approx(1.9, abs=0.02)
    assert found.forearm / found.stature == pytest.approx(person.forearm / 1.9, rel=0.01)


def test_a_standing_trial_places_markers_that_are_no_sites():
    """Clusters on the limbs; knees and ankles are marked while standing only."""
    cluster = {
        "R.Thigh.Upper": "thigh_r",
        "L.Thigh.Upper": "thigh_l",
        "R.Shank.Rear": "shank_r",
        "L.Shank.Rear": "shank_l",
        "R.Shank.Front": "shank_r",
        "L.Shank.Front": "shank_l",
    }

    def seen(q):
        frame = segment_frames(BODY, q)
        found = named(marker_positions(BODY, q))
        for k, (name, segment) in enumerate(cluster.items()):
            on, at = frame[:, list(SEGMENTS).index(segment)], [0.05, -0.1 - 0.02 * k, 0.04]
            found[name] = on[:, :3, :3] @ at + on[:, :3, 3]
        return found

    standing = np.zeros((5, 55))
    standing[:, index("pelvis_ty")] = 0.93
    static = Recording(Path("static.trc"), np.arange(5) / 100.0, markers=seen(standing))
    hidden = {"LKNE", "RKNE", "LANK", "RANK", "LTIB", "RTIB", "LTHI", "RTHI"}
    walking = {name: x for name, x in seen(GAIT.q(frames())).items() if name not in hidden}
    found = fit_of(walking, static=static)
    assert angle_error(found).max() < 0.5
    assert found.solution["measured"]["markers"]["R.Thigh.Upper"] == "on the thigh_r"


def test_a_trial_that_goes_elsewhere_is_the_same_walk():
    """Turned, moved away and back, on plates without a name for their foot."""
    t, yaw, away = frames(1000.0), 2.0, np.array([3.0, 0.0, -1.0])
    q = turned(GAIT.q(frames()), yaw)
    q[:, [index("pelvis_tx"), index("pelvis_tz")]] += away[[0, 2]]
    floor = tuple(
        Plate(
            t,
            turned_points(one.force, yaw),
            turned_points(one.point, yaw) + away,
            one.free_moment,
            f"plate {k}",
        )
        for k, one in enumerate(plates(t))
    )
    found = fitted_angles(replace(angles_of(q), plates=floor))
    here = fitted_angles(angles_of())
    np.testing.assert_allclose(found.control_points, here.control_points, atol=1e-3)
    np.testing.assert_allclose(found.tau(STRIDE), here.tau(STRIDE), atol=1.0)


def test_a_treadmill_is_a_walk_over_ground_seen_from_the_belt():
    speed = GAIT.scenario.walk.speed
    q = GAIT.q(frames())
    q[:, index("pelvis_tz")] -= speed * frames()
    forces = tuple(
        replace(one, point=one.point - speed * one.time[:, None] * [0.0, 0.0, 1.0])
        for one in plates(frames(1000.0))
    )
    belt = replace(angles_of(q), plates=forces)
    with pytest.raises(TrialError, match=r"trial.mot: the walker moves on by .* \(--speed\)"):
        fitted_angles(belt)
    found = fitted_angles(belt, speed=speed)
    assert angle_error(found).max() < 0.5
    assert np.abs(found.tau(STRIDE) - GAIT.tau(STRIDE)).max() < 3.0


def test_turning_the_whole_body_turns_its_markers():
    q = GAIT.q([0.1, 0.2])
    apart = marker_positions(BODY, turned(q, 1.1)) - turned_points(marker_positions(BODY, q), 1.1)
    assert np.abs(apart).max() < 1e-12


def test_forces_that_the_motion_does_not_take_are_left_over_at_the_pelvis():
    t = frames(1000.0)
    pushed = tuple(
        replace(one, force=one.force + (one.force[:, 1:2] > 0.0) * [0.0, 0.0, 30.0])
        for one in plates(t)
    )
    found = fitted_angles(replace(angles_of(), plates=pushed))
    alone = found.tau(0.5 * T)[index("pelvis_tz")]
    assert abs(alone) == pytest.approx(30.0, abs=3.0)
    checks = {check.name: check for check in hg.verify(found)}
    assert checks["torques off Drake's"].passed
    assert checks["unbalanced force or moment"].verdict == "note"


def test_without_forces_they_are_those_that_the_motion_takes():
    found = fitted_angles(replace(angles_of(), plates=()))
    assert found.forces is None
    assert "those that the motion takes" in " ".join(found.solution["measured"]["not_kept"])
    assert np.abs(found.tau(STRIDE)[:, :6]).max() < 1e-9


def test_a_contact_is_what_rises_from_nothing_and_falls_to_it():
    up = np.array([3.0, 2.0, 4.0, 3.0, 5.0, 12.0, 60.0, 500.0, 90.0, 8.0, 2.0, 3.0, 2.0])
    force = np.stack([0 * up, up, 0 * up], axis=1)
    (found,) = contacts(Plate(np.arange(13.0), force, 0.0 * force, 0.0 * up))
    assert np.flatnonzero(found).tolist() == [3, 4, 5, 6, 7, 8, 9, 10]


def dipped(plate, newton=5.0):
    """A plate that carries next to nothing for one sample in the middle of each stance."""
    force = plate.force.copy()
    for on in contacts(plate):
        if on.sum() > 9:
            force[np.flatnonzero(on)[on.sum() // 2]] = [0.0, newton, 0.0]
    return replace(plate, force=force)


def test_a_dip_in_a_stance_is_no_strike():
    known = plates(frames(1000.0, strides=3))
    assert strikes_by_forces([dipped(one) for one in known]) == strikes_by_forces(known)


def test_two_plates_with_a_contact_each_are_an_overground_trial():
    """They tell two strikes, so that the motion tells them all; the forces count as measured."""
    t, one_each = frames(strides=2), []
    for plate in plates(frames(1000.0, strides=2)):
        on = next(c for c in contacts(plate) if not c[0] and not c[-1])
        one_each.append(replace(plate, force=np.where(on[:, None], plate.force, 0.0)))
    trial_ = replace(angles_of(t=t), plates=tuple(one_each))
    found = fitted_angles(trial_, strikes=())
    assert "; strikes from the motion; forces measured in" in found.solution["measured"]["what"]
    assert found.step_time == pytest.approx(T, abs=0.02)
    assert found.forces is not None
    one = replace(trial_, events=STRIKES[:1])
    assert fitted_angles(one, strikes=()).solution["measured"] == found.solution["measured"]
    whole = replace(trial_, plates=plates(frames(1000.0, strides=2)))
    told = fitted_angles(whole, strikes=()).solution["measured"]["what"]
    assert "strikes from the forces" in told
    assert "strikes as given" in fitted_angles(trial_).solution["measured"]["what"]


def test_one_frame_is_no_walk():
    with pytest.raises(TrialError, match="no whole stride"):
        fitted_angles(angles_of(t=frames()[:1]), strikes=())
    one = {name: x[:1] for name, x in named(places(frames())).items()}
    still = Recording(Path("a.trc"), frames()[:1], markers=one)
    with pytest.raises(TrialError, match="no whole stride"):
        fitted(still, base=GAIT.scenario)


def test_contacts_share_no_sample():
    up = np.concatenate([np.full(200, 500.0), np.geomspace(15, 2, 30), np.geomspace(2, 15, 31)[1:]])
    up = np.concatenate([up, np.full(200, 500.0)])
    force = np.stack([0 * up, up, 0 * up], axis=1)
    both = contacts(Plate(np.arange(len(up)) / 1000.0, force, 0.0 * force, 0.0 * up))
    assert len(both) == 2
    assert np.sum(both, axis=0).tolist() == [1] * len(up)


def test_beyond_the_record_of_a_plate_nothing_acts():
    """A plate that is switched off in the middle of a stance tells no step after it."""
    q, t = GAIT.q(frames()), frames()
    steps = cut(BODY, t, q, STRIKES, 0.0, "walk")
    short = []
    for one in plates(frames(1000.0)):
        on = one.time < 0.5 * T
        short.append(Plate(one.time[on], one.force[on], one.point[on], one.free_moment[on]))
    assert mean_forces(short, steps) == (None, 0)


def test_contacts_go_to_the_nearer_foot():
    t = frames(1000.0)
    both = [replace(one, name="") for one in plates(t)]
    right, left = by_foot(BODY, frames(), GAIT.q(frames()), both[::-1])
    for found, known in zip((right, left), plates(t), strict=True):
        np.testing.assert_allclose(found.force, known.force, atol=25.0)


def test_names_of_other_marker_sets_are_known():
    names = ["Ann:LASI", "R.ASIS", "V.Sacral", "R.Knee.Lat", "LeftHeel", "R.Thigh.Front", "C7"]
    found = {site.name: site.ours for site in sites(names, BODY)}
    assert found == {
        "Ann:LASI": ("LASI",),
        "R.ASIS": ("RASI",),
        "V.Sacral": ("LPSI", "RPSI"),
        "R.Knee.Lat": ("RKNE",),
        "LeftHeel": ("LHEE",),
        "C7": ("C7",),
    }
    assert segment_of("R.Thigh.Front") == "thigh_r"
    assert segment_of("L_Shank2") == "shank_l"
    assert segment_of("Wand") == ""


def test_names_can_be_given():
    given = {"Hip1": "RASI", "LASI": ""}
    assert [site.ours for site in sites(["Hip1", "LASI", "C7"], BODY, given)] == [
        ("RASI",),
        ("C7",),
    ]
    with pytest.raises(TrialError, match=r"--map Hip=RASI: no marker of the file is called 'Hip'"):
        sites(["Hip1"], BODY, {"Hip": "RASI"})
    with pytest.raises(TrialError, match=r"--map Hip1=RASIS: .*did you mean 'RASI'"):
        sites(["Hip1"], BODY, {"Hip1": "RASIS"})


def test_a_file_without_a_walk_is_refused_in_one_line():
    with pytest.raises(TrialError, match="--speed = nan: must be at most 3 m/s"):
        fitted_angles(angles_of(), speed=np.nan)
    some = named(places(frames()), range(5))
    with pytest.raises(TrialError, match=r"5 of its 5 markers are known, it takes 8"):
        fit_of(some)
    angles = {name: np.zeros(3) for name in DOF_NAMES[3:]}
    with pytest.raises(TrialError, match=r"no markers, and 3 of our 55 coordinates are missing"):
        fitted(Recording(Path("x.mot"), np.arange(3.0), angles=angles))
    with pytest.raises(TrialError, match="no whole stride: it takes three strikes"):
        fitted_angles(angles_of(t=frames()[:30]))
    one_side = {name: x for name, x in named(places(frames())).items() if name[0] != "R"}
    with pytest.raises(TrialError, match="no marker is known on both sides"):
        fit_of(one_side)


@pytest.mark.parametrize("text", ["1,2,3", "left:1,2", "left:1,x,3", "right:3,2,1"])
def test_strikes_are_three_times_in_their_order(text):
    with pytest.raises(TrialError, match="must be three or more strikes"):
        strikes_given(text)
    assert [one.side for one in strikes_given("right: 1, 2,3")] == ["right", "left", "right"]


def test_a_person_can_be_stated():
    person = Person(sex="female", stature=1.755, mass=70.0)
    found = fitted_angles(angles_of(), base=None, person=person)
    subject = found.scenario.subject
    assert (subject.sex, subject.stature, subject.mass) == ("female", 1.755, 70.0)


def test_the_folder_gives_the_measured_walk_back(measured, saved):
    found = hg.load(saved)
    assert found == measured
    assert found.forces == measured.forces
    assert json.loads((saved / "summary.json").read_text())["success"] is False
    assert measured != replace(measured, forces=None)


def test_every_command_says_that_it_is_no_prediction(saved, capsys):
    said = {}
    for words in ("verify", "explain", "report", "export --format bvh"):
        command, *options = words.split()
        assert run([command, str(saved), *options]) == 0
        told = capsys.readouterr()
        said[command] = " ".join((told.out + told.err).split())
        assert "found a walk" not in said[command]
    for command in ("verify", "explain", "export"):
        assert "This is a measured walk, no prediction" in said[command]
    page = (saved / "report.html").read_text()
    assert "a measured walk, no prediction." in page
    assert "no walk was found" not in page
    assert "a walk was found" not in page
    assert "markers is measured itself." in page


def test_the_checks_of_a_measured_walk_are_those_of_its_file(measured):
    checks = hg.verify(measured)
    assert checks.passed
    assert str(checks).startswith("a measured walk, no prediction: ")
    assert checks["measured, not predicted"].what.startswith("This is a measured walk")
    changed = replace(measured, control_points=measured.control_points + 0.01)
    assert not hg.verify(changed).passed
    assert "it was changed" in no_walk(changed) or "fails checks" in no_walk(changed)


def test_the_digest_covers_the_forces(measured):
    from human_gait.walk.described import gait_digest

    moved = replace(measured.forces, force=measured.forces.force + 1.0)
    assert gait_digest(replace(measured, forces=moved)) != gait_digest(measured)


def test_the_command_makes_a_result_and_tells_what_it_took_for_what(exported, tmp_path, capsys):
    target = tmp_path / "fitted"
    files = [str(exported / name) for name in FILES["markers"]]
    options = ["--map", "LTHI=", "--out", str(target), "--no-plots"]
    assert run(["fit", *files, *options]) == 0
    said = capsys.readouterr().out
    assert "markers left out: LTHI" in said
    assert "This is a measured walk, no prediction" in said
    assert load_gait(target).solution["measured"]["files"] == [files[0]]


def test_the_command_tells_a_mistake_in_one_line(exported, tmp_path, capsys):
    file = str(exported / "markers.trc")
    for wrong, told in (
        (["--map", "LASI"], "must be THEIRS=OURS"),
        (["--strikes", "1"], "strikes"),
    ):
        assert run(["fit", file, *wrong, "--out", str(tmp_path / "x")]) == 2
        assert told in capsys.readouterr().err
