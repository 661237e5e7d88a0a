"""What a type checker sees of the package: every public name, and every attribute of a class."""

import dataclasses
import inspect
import re
import subprocess
import sys

import pytest

import human_gait as hg

WITHOUT_TYPES = {
    *("offer_hessian", "Motion.count", "Motion.index", "Rows.count", "Rows.index"),
    *("pinocchio_model", "Body.model", "Body.pinocchio_model"),
    *("Gait.to_dataframe", "Scenario.replace", "Study.table", "Study.to_dataframe"),
}
"""What returns a thing of a package that has no types, or takes things of any type."""

CLASSES = sorted(name for name in hg.__all__ if inspect.isclass(getattr(hg, name)))


def public_attributes(name):
    """Attributes of an instance: members of the class and fields of a dataclass."""
    kind = getattr(hg, name)
    fields = dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()
    return sorted({*dir(kind), *(item.name for item in fields)} - set(dir(object)))


def questions():
    """What is asked to be revealed, by what it is about."""
    asked = {name: f"hg.{name}" for name in [*hg.__all__, "__version__"]}
    for name in CLASSES:
        for attribute in public_attributes(name):
            if not attribute.startswith("_"):
                asked[f"{name}.{attribute}"] = f"cast(hg.{name}, thing).{attribute}"
    return asked


def checked(folder, cache, lines):
    """What mypy --strict says of a script of a user, who has no settings of ours, by line."""
    script = folder / "script.py"
    script.write_text("\n".join(lines) + "\n")
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file=", f"--cache-dir={cache}"]
    run = subprocess.run(
        [*command, "--no-error-summary", script],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        timeout=600,
    )
    assert not run.stderr
    found = {}
    for line in run.stdout.splitlines():
        if match := re.match(r"script\.py:(\d+): (\w+): (.*)", line):
            number, kind, text = match.groups()
            found.setdefault(int(number), []).append((kind, text))
    return found


@pytest.fixture(scope="module")
def cache(pytestconfig):
    return pytestconfig.cache.mkdir("mypy")


def is_any(revealed):
    """Whether a type has nothing to say: it is Any, or that of a function that takes or returns it.

    Tables of anything, as of JSON, and arrays of any shape are types.
    """
    text, inside = revealed, 1
    while inside:
        text, inside = re.subn(r"\[[^\[\]]*\]", "", text)
    return re.search(r"\bAny\b", text) is not None


def test_every_public_name_has_a_type(tmp_path, cache):
    asked = questions()
    head = ["from typing import cast", "import human_gait as hg", "thing: object = None"]
    found = checked(tmp_path, cache, [*head, *(f"reveal_type({what})" for what in asked.values())])
    loose = {}
    for number, name in enumerate(asked, start=len(head) + 1):
        says = found.pop(number, [("error", "nothing")])
        revealed = " ".join(text for _, text in says)
        if any(kind != "note" for kind, _ in says) or (is_any(revealed) != (name in WITHOUT_TYPES)):
            loose[name] = revealed
    assert loose == {}
    assert found == {}


def test_a_name_that_does_not_exist_is_an_error(tmp_path, cache):
    found = checked(tmp_path, cache, ["import human_gait as hg", "hg.predikt", "hg.Gait.speeed"])
    assert "predikt" in found[2][0][1]
    assert "speeed" in found[3][0][1]


def test_a_script_of_a_user_has_no_errors(tmp_path, cache):
    script = """
import human_gait as hg

def tell(now: hg.Iterate) -> None:
    print(now.number, now.cost)

gait = hg.predict("scenario.toml", solver="newton", seed=1, progress=tell)
again: hg.Gait = hg.predict(gait.scenario, warm_from=gait, progress=True)
checks = hg.verify(gait)
print(checks.passed, checks["joint limits exceeded"].value, checks[0].name, checks[:3].failed)
knee = gait["knee_flexion_r"].max() + gait.q(0.25)[gait.joint_names.index("knee_flexion_r")]
print(knee, gait.muscle_torque([0.1, 0.2]).shape, gait.to_dataframe())
files = gait.export(gait.save("out/mine") / "export", "csv", rate=100)
print(files[0].name, hg.load("out/mine") == gait, hg.compare("out/mine").scores[0].r)
print(hg.report([gait, "out/mine"], out="report.html").name, hg.explain(gait).bounds[0].saving)
found: hg.Energy = hg.energy("out/mine")
print(found.cost_of_transport, found.joints[0].positive, found.spine[0].mean, found.to_dict())
trial: hg.Recording = hg.read_trial("walk.mot", "forces.mot", units="deg", forward="-x")
print(trial.angles["knee_angle_r"].max(), trial.plates[0].force.shape, trial.rate)
print(hg.compare(gait, with_=["walk.mot"], side="l", mass=70.0, events=[0.5, 1.6]).own.notes)
shown = hg.play(gait, inline=True)
plant, model = hg.drake_plant(gait), hg.pinocchio_model(hg.Subject.default("female"))
"""
    assert checked(tmp_path, cache, script.splitlines()) == {}
