"""A run's MCAP file, read back with the library of the format."""

import json
import math
from pathlib import Path

import pytest

from clo_fleet.bridges.mcap_export import SCHEMAS, export
from clo_fleet.study.event_log import read_events
from clo_fleet.study.replay.page import NoReplayError
from clo_fleet.study.replay.scene import write_scene
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world

mcap = pytest.importorskip("mcap.reader", reason="needs the extra mcap")

EVENTS = (
    {"id": 0, "t": 0.0, "kind": "poses", "robots": [["r1", 1.5, 2.0, math.pi / 2]], "objects": [["o1", 3.0, 1.0, 0.0]]},
    {"id": 1, "t": 0.4, "kind": "plan_failed", "robot": "r1", "reason": "no_plan", "detail": ""},
    {"id": 2, "t": 1.2, "kind": "poses", "robots": [["r1", 1.75, 2.0, 0.0]], "objects": []},
)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A short run in the building of the worked example."""
    write_scene(read_world(shipped("worlds") / "three_rooms.yaml"), tmp_path / "scene.json")
    (tmp_path / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in EVENTS))
    return tmp_path


def test_every_message_can_be_read_back(run: Path) -> None:
    """Poses, what is drawn, what is said, and the log itself, at the times of the run."""
    number = export(run, run / "run.mcap")
    found: dict[str, list[tuple[int, dict[str, object]]]] = {}
    with (run / "run.mcap").open("rb") as stream:
        for schema, channel, message in mcap.make_reader(stream).iter_messages():
            assert json.loads(schema.data)["title"] == schema.name
            content = json.loads(message.data)
            assert content.keys() <= {*SCHEMAS[schema.name]} | (
                {*content} if schema.name == "clo_fleet.Event" else set()
            )
            found.setdefault(channel.topic, []).append((message.log_time, content))
    assert sum(map(len, found.values())) == number
    assert [content for _, content in found["/events"]] == read_events(run / "events.jsonl")
    (first, pose), (second, _) = found["/robots/r1/pose"]
    assert (first, second) == (0, 1_200_000_000)
    assert pose["pose"] == {
        "position": {"x": 1.5, "y": 2.0, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(math.pi / 4), "w": math.cos(math.pi / 4)},
    }
    ((said, log),) = found["/log"]
    assert (said, log["level"], log["name"]) == (400_000_000, 3, "r1")
    assert len(found["/building"]) == 1
    assert len(found["/fleet"]) == 2


def test_what_a_robot_carries_goes_with_it(tmp_path: Path) -> None:
    """Also through corridors, where the log only says where the robot is; until it is another's, or put down."""
    write_scene(read_world(shipped("worlds") / "cooking.yaml"), tmp_path / "scene.json")
    held = {"kind": "fact_changed", "fact": "(has c1 leek)"}
    events = (
        {"t": 1.0, **held, "value": True},
        {"t": 2.0, "kind": "poses", "robots": [["c1", 5.0, 3.0, 0.0], ["c2", 1.0, 1.0, 0.0]], "objects": []},
        {"t": 3.0, "kind": "fact_changed", "fact": "(has c2 leek)", "value": True},
        {"t": 3.0, **held, "value": False},
        {"t": 4.0, "kind": "poses", "robots": [["c1", 6.0, 3.0, 0.0], ["c2", 2.0, 1.0, 0.0]], "objects": []},
        {"t": 5.0, "kind": "poses", "robots": [["c2", 3.0, 1.0, 0.0]], "objects": [["leek", 3.1, 1.2, 0.0]]},
    )
    lines = (json.dumps({"id": number} | event) + "\n" for number, event in enumerate(events))
    (tmp_path / "events.jsonl").write_text("".join(lines))
    export(tmp_path, tmp_path / "run.mcap")
    found = []
    with (tmp_path / "run.mcap").open("rb") as stream:
        for _, _, message in mcap.make_reader(stream).iter_messages(topics=["/fleet"]):
            entities = {entity["id"]: entity for entity in json.loads(message.data)["entities"]}
            found.append(entities["leek"]["cylinders"][0]["pose"]["position"]["x"])
    assert found == [5.0, 2.0, 3.1]


def test_a_folder_without_a_run_leaves_nothing(tmp_path: Path) -> None:
    """Neither a file nor a part of one."""
    with pytest.raises(NoReplayError, match=r"has no scene\.json"):
        export(tmp_path, tmp_path / "run.mcap")
    assert list(tmp_path.iterdir()) == []
