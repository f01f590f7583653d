"""What a replay knows beside the log."""

import json
from pathlib import Path

from clo_fleet.study.replay.scene import SCENE_FORMAT, scene, write_scene
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world


def test_a_scene_tells_what_the_words_of_its_domain_mean() -> None:
    """Who has what in hand, and what is done to objects."""
    found = scene(read_world(shipped("worlds") / "cooking.yaml"))
    assert found["holding"] == {"has": (1, 2)}
    assert "has-cut" in found["effects"]


def test_a_scene_holds_what_does_not_change(tmp_path: Path) -> None:
    """Everything of the building that one can see, everybody in it, and goals; it survives its file."""
    world = read_world(shipped("worlds") / "office.yaml")
    write_scene(world, tmp_path / "scene.json")
    found = json.loads((tmp_path / "scene.json").read_text())
    assert found == json.loads(json.dumps(scene(world)))
    assert found["format"] == SCENE_FORMAT
    assert len(found["rooms"]) == len(world.map.rooms)
    assert {robot["id"]: len(robot["goals"]) for robot in found["robots"]} == {
        robot.id: len(robot.goals) for robot in world.robots
    }
    assert {item["id"] for item in found["objects"] if item["facts"]} == {
        item.id for item in world.objects if item.prepared
    }
    assert [path.name for path in tmp_path.iterdir()] == ["scene.json"]
