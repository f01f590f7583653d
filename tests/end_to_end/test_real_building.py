"""A fleet on a real building, from the Open-RMF file to the goals."""

import subprocess
import sys
from pathlib import Path

import pytest

from clo_fleet.bridges.open_rmf import import_to_folder
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.world.map_file import read_map
from clo_fleet.world.places import zones
from clo_fleet.world.random_worlds import random_world
from clo_fleet.world.world_file import read_world

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "maps" / "open-rmf"
BUILDING = FOLDER / "office.building.yaml"
pytestmark = pytest.mark.skipif(not BUILDING.exists(), reason=f"needs the Open-RMF building {BUILDING}")

WORLD = """
format: clo-fleet/world/1
map: ../maps/office.yaml
until_s: 1200
skills: {partner_wait_s: 240}
robots:
  r1: {at: tinyrobot1_charger, goals: [(holding r1 coke), (at-object box hardware_2), (at-object parcel coe)]}
  r2: {at: tinyrobot2_charger, goals: [(at-object parcel coe), (prepared coke)]}
  r3: {at: hardware_2, goals: [(at-object box hardware_2), (prepared tool)]}
  r4: {at: supplies, goals: [(holding r1 tool), (prepared box)]}
objects:
  coke: {room: pantry, at_m: [17.6, -5.4]}
  box: {room: supplies, at_m: [7.3, -3.9]}
  parcel: {room: hardware_2, at_m: [22.0, -10.5]}
  tool: {room: coe, at_m: [4.5, -8]}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The imported map, and a world on it."""
    folder = tmp_path_factory.mktemp("rmf")
    words = [sys.executable, "-m", "clo_fleet.cli", "import-map", str(BUILDING), "-o", str(folder / "maps")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=110, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "3 cells" in done.stdout
    assert "left out: model" in done.stdout
    (folder / "worlds").mkdir()
    (folder / "worlds" / "fleet.yaml").write_text(WORLD, encoding="utf-8")
    return folder


def test_imported_map_is_one_network_with_rooms_to_work_in(folder: Path) -> None:
    """All lanes are connected: one zone, on which every room has a door."""
    building = read_map(folder / "maps" / "office.yaml")
    assert len(zones(building)) == 1
    assert {room.id for room in building.rooms} == {room for door in building.doors for room in door.rooms}


@pytest.mark.parametrize("strategy", ["clo", "replan", "replan-on-failure"])
def test_four_robots_with_overlapping_goals_finish(folder: Path, strategy: str, fleet_planners: PlannerPool) -> None:
    """Every goal is reached; with clo, some by the help of others, and without planning again."""
    with Run(read_world(folder / "worlds" / "fleet.yaml"), strategy, planners=fleet_planners) as run:
        result = run.finish()
    assert result.outcome == "goals_reached"
    if strategy == "clo":
        assert len(result.helps) >= 3
        assert all(robot.planner_calls <= 1 + robot.repairs_refused for robot in result.robots.values())


@pytest.mark.parametrize("name", ["battle_royale", "triple_H"])
def test_a_random_fleet_finishes_in_the_other_buildings(tmp_path: Path, name: str, fleet_planners: PlannerPool) -> None:
    """Their places are all on the open floor, so that every room is a bay, with space for a robot or two."""
    imported, _ = import_to_folder(FOLDER / f"{name}.building.yaml", tmp_path)
    assert imported.skipped == ()
    assert len(imported.building.rooms) == len(imported.building.spawn_points) == 8
    world = random_world(imported.building, robots=3, objects=5, seed=1)
    with Run(world, "clo", planners=fleet_planners) as run:
        result = run.finish()
    assert result.outcome == "goals_reached"
    assert result.helps
