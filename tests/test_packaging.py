"""What is installed, and what is published as source, holds everything that is needed there."""

import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCENARIOS = {path.name for path in (ROOT / "scenarios").glob("*.toml")}
STUDIES = {f"studies/{path.name}" for path in (ROOT / "scenarios" / "studies").iterdir()}


def build(target, folder):
    """Build what `target` says and return it."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (built,) = folder.iterdir()
    return built


def sources():
    """Return the files that people wrote, from the top of the source."""
    folders = ("benchmarks", "docs", "human_gait", "scenarios", "tests", "urdf")
    git = shutil.which("git")
    if git and (ROOT / ".git").exists():
        command = [git, "ls-files", *folders]
        listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
        return set(listed.stdout.splitlines())
    files = {path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file()}
    return {path.relative_to(ROOT).as_posix() for path in files if path.suffix != ".pyc"}


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Return a folder that holds what the wheel installs."""
    wheel, folder = build("wheel", tmp_path_factory.mktemp("wheel")), tmp_path_factory.mktemp("lib")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def test_the_wheel_holds_the_scenarios_as_they_are_and_the_schema(installed):
    data = installed / "human_gait" / "data"
    held = {str(path.relative_to(data / "scenarios")) for path in (data / "scenarios").rglob("*.*")}
    assert held == SCENARIOS | STUDIES
    for name in held:
        assert (data / "scenarios" / name).read_bytes() == (ROOT / "scenarios" / name).read_bytes()
    assert (data / "scenario.schema.json").is_file()
    assert {path.name.split("-")[0] for path in installed.iterdir()} == {"human_gait"}


def test_a_scenario_is_found_by_name_where_only_the_wheel_is_installed(installed, tmp_path):
    code = (
        "import human_gait as hg; from human_gait.scenario import scenario_file;"
        "print(hg.load_scenario('normal').name, hg.__file__, scenario_file('normal'), sep='\\n')"
    )
    command = [sys.executable, "-c", code]
    path = {"PYTHONPATH": str(installed)}
    told = subprocess.run(command, cwd=tmp_path, env=path, check=True, capture_output=True)
    name, package, file = told.stdout.decode().splitlines()
    assert name == "normal"
    assert Path(package).is_relative_to(installed)  # or it would be the checkout that answers
    assert Path(file) == installed / "human_gait" / "data" / "scenarios" / "normal.toml"


def test_the_source_archive_holds_all_that_the_tests_name(tmp_path):
    with tarfile.open(build("sdist", tmp_path)) as archive:
        packed = {name.partition("/")[2] for name in archive.getnames()}
    assert sources() - packed == set()
    assert {"README.md", "Makefile", "pyproject.toml", ".gitignore"} <= packed


def test_an_editable_installation_holds_no_copies_that_would_grow_old(tmp_path):
    code = "import sys; from hatchling.build import build_editable; build_editable(sys.argv[1])"
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], cwd=ROOT, check=True)
    (wheel,) = tmp_path.iterdir()
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert [name for name in names if name.startswith("human_gait/")] == []
    assert any(name.endswith(".pth") for name in names)
