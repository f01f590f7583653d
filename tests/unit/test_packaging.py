"""What is locked, shipped and ignored, and what importing costs: claims about the project's own files."""

import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from zipfile import ZipFile

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import clo_fleet

ROOT = Path(__file__).parents[2]
LOCK = (ROOT / "constraints.txt").read_text(encoding="utf-8")
PIN = re.compile(r"([a-z0-9][a-z0-9._-]*)==([^\s;]+)(?: ; [^\\]+)?( \\\n    --hash=sha256:[0-9a-f]{64})+\n")


def requirements() -> Iterator[Requirement]:
    """Everything that pyproject.toml asks for: to run, to build, and in every extra."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = project["project"]["optional-dependencies"].values()
    for group in (project["build-system"]["requires"], project["project"]["dependencies"], *extras):
        yield from map(Requirement, group)


def run(*command: str, where: Path) -> str:
    """The standard output of a command that must succeed."""
    return subprocess.run(command, check=True, capture_output=True, text=True, cwd=where).stdout


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The project's own files with one map, world, batch and kept study, and the output of a run."""
    shutil.copytree(ROOT / "clo_fleet", tmp_path / "clo_fleet", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "LICENSE", ".gitignore"):
        shutil.copy(ROOT / name, tmp_path)
    for name in (
        "README.md",
        "maps/hall.yaml",
        "maps/hall.net.xml.gz",
        "worlds/hall.yaml",
        "worlds/hall.pddl",
        "runs/sweep.yaml",
        "runs/paper/table.csv",
        "runs/hall-0/events.jsonl",
        "runs/hall-0/world.yaml",
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    return tmp_path


def test_lock_is_pins_and_hashes_alone() -> None:
    """Each line of the lock is a comment, an exact version or a hash of it: no address, path or option."""
    assert re.sub(r"^#.*\n", "", PIN.sub("", LOCK), flags=re.MULTILINE) == "\n"


def test_lock_satisfies_every_requirement() -> None:
    """What pyproject.toml asks for to run, to build and in any extra is locked at a version that it allows."""
    locked = {name: pinned for name, pinned, _ in PIN.findall(LOCK)}
    unmet = [str(need) for need in requirements() if locked.get(canonicalize_name(need.name), "") not in need.specifier]
    assert unmet == []


def test_version_is_written_once() -> None:
    """The installed distribution takes its version from the package."""
    assert version("clo-fleet") == clo_fleet.__version__


def test_wheel_ships_maps_worlds_and_batches_but_no_results(checkout: Path, tmp_path: Path) -> None:
    """A pip user gets what a checkout has beside the package, inside it, and nothing that runs wrote."""
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", "dist", where=checkout)
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    names = [name for name in ZipFile(wheel).namelist() if ".dist-info/" not in name]
    assert {name for name in names if name.startswith("clo_fleet/shipped/")} == {
        "clo_fleet/shipped/maps/hall.yaml",
        "clo_fleet/shipped/maps/hall.net.xml.gz",
        "clo_fleet/shipped/worlds/hall.yaml",
        "clo_fleet/shipped/worlds/hall.pddl",
        "clo_fleet/shipped/runs/sweep.yaml",
    }
    assert "clo_fleet/py.typed" in names
    assert all(name.startswith("clo_fleet/") for name in names)


def test_git_keeps_batches_and_studies_and_ignores_what_runs_write(checkout: Path) -> None:
    """The work tree stays clean after a run; specifications and kept studies are committed."""
    run("git", "init", "--quiet", where=checkout)
    kept = run("git", "ls-files", "--others", "--exclude-standard", "runs", where=checkout)
    assert kept.split() == ["runs/paper/table.csv", "runs/sweep.yaml"]


def test_idea_needs_only_the_standard_library() -> None:
    """Importing every module of clo_fleet.clo loads no third-party module."""
    modules = sorted(f"clo_fleet.clo.{path.stem}" for path in (ROOT / "clo_fleet" / "clo").glob("[!_]*.py"))
    code = f"import sys, {', '.join(modules)}; print(*{{name.partition('.')[0] for name in sys.modules}})"
    loaded = set(run(sys.executable, "-S", "-c", code, where=ROOT).split())
    assert loaded - sys.stdlib_module_names - {"__main__"} == {"clo_fleet"}
