"""What a replay's page is given."""

import base64
import json
from pathlib import Path
from typing import Any

import pytest

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.event_log import read_events
from clo_fleet.study.replay.page import NoReplayError, view
from clo_fleet.study.replay.recording import piece
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, fleet_planners: PlannerPool) -> Path:
    """A run of the paper's worked example."""
    out = tmp_path_factory.mktemp("three_rooms")
    with Run(read_world(shipped("worlds") / "three_rooms.yaml"), out=out, planners=fleet_planners) as run:
        run.finish()
    return out


def samples(text: str) -> list[list[int]]:
    """The samples of a track, as the page reads them."""
    numbers, value, factor = [], 0, 1
    for byte in base64.b64decode(text):
        value += (byte & 127) * factor
        factor *= 128
        if byte < 128:
            numbers.append(-(value + 1) // 2 if value % 2 else value // 2)
            value, factor = 0, 1
    rows, last = [], [0, 0, 0, 0]
    for index in range(0, len(numbers), 4):
        last = [before + now for before, now in zip(last, numbers[index : index + 4], strict=True)]
        rows.append(last)
    return rows


def test_every_pose_of_the_log_is_in_a_track(folder: Path) -> None:
    """To a tenth of a second, a centimetre and a hundredth of a radian."""
    events = read_events(folder / "events.jsonl")
    found = piece(events)
    expected: dict[str, list[list[int]]] = {}
    for event in events:
        for name, *pose in (*event.get("robots", ()), *event.get("objects", ())) if event["kind"] == "poses" else ():
            row = [round(10 * event["t"]), *(round(100 * value) for value in pose)]
            expected.setdefault(name, []).append(row)
    assert {name: samples(track) for name, track in found["tracks"].items()} == expected
    assert found["until"] == events[-1]["t"]


def test_pieces_of_a_log_tell_what_the_whole_tells(folder: Path) -> None:
    """Wherever it is cut; each piece's tracks begin anew."""
    events = read_events(folder / "events.jsonl")
    whole = piece(events)
    cut = len(events) // 3
    first, second = piece(events[:cut]), piece(events[cut:])
    assert first["marks"] + second["marks"] == whole["marks"]
    assert first["facts"] + second["facts"] == whole["facts"]
    plans = {name: first["plans"].get(name, []) + second["plans"].get(name, []) for name in whole["plans"]}
    assert plans == whole["plans"]
    for name, track in whole["tracks"].items():
        parts = [samples(found["tracks"][name]) for found in (first, second) if name in found["tracks"]]
        assert [row for part in parts for row in part] == samples(track)
    assert (first["outcome"], second["outcome"]) == (None, ["goals_reached", "all goals hold"])


def test_a_help_names_who_helped_whom_and_what_was_dropped(folder: Path) -> None:
    """The gift of the worked example, and the fate of each of r1's six steps."""
    found = piece(read_events(folder / "events.jsonl"))
    ((_, by, robot, fact, dropped),) = found["helps"]
    assert (by, robot, fact) == ("r2", "r1", "(holding r1 o2)")
    assert dropped == ["move(r1, l1, l2)", "prepare(r1, o2, l2)", "grasp(r1, o2, l2)"]
    whats = [entry[1] for entry in found["plans"]["r1"]]
    assert whats.count("finished") == 3
    assert whats.count("dropped") == 1
    assert ["(holding r1 o2)", True] in [entry[1:] for entry in found["facts"]]


def test_a_page_carries_texts_as_data_only(folder: Path, tmp_path: Path) -> None:
    """A name that is markup stays inside the data, and the page may load and call nothing."""
    scene = json.loads((folder / "scene.json").read_text())
    evil = "</script><script>alert(1)</script>[[script]]"
    scene["rooms"][0]["id"] = evil
    lines = (folder / "events.jsonl").read_text().replace('"world":"three_rooms"', f'"world":{json.dumps(evil)}')
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    (tmp_path / "events.jsonl").write_text(lines)
    text = view(tmp_path).read_text()
    assert "alert(1)" not in text.replace("&lt;script&gt;alert(1)", "")
    assert text.count("<script") == 2
    assert "default-src 'none'" in text
    assert "connect-src" not in text
    assert "http" not in text.replace("http-equiv", "").replace("http://www.w3.org/2000/svg", "")


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("scene.json", None, "has no scene.json"),
        ("events.jsonl", None, "has no events.jsonl"),
        ("scene.json", "{", "is no JSON"),
        ("scene.json", '{"format": "other"}', "is not of the format clo-fleet/scene/2"),
    ],
)
def test_a_folder_without_a_run_is_told(
    folder: Path, tmp_path: Path, name: str, content: str | None, said: str
) -> None:
    """With what is missing, and nothing is written."""
    for file in ("scene.json", "events.jsonl"):
        (tmp_path / file).write_bytes((folder / file).read_bytes())
    (tmp_path / name).unlink()
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(NoReplayError, match=said):
        view(tmp_path)
    assert not (tmp_path / "run.html").exists()


def test_a_run_that_was_cut_short_is_shown_as_far_as_it_got(folder: Path, tmp_path: Path) -> None:
    """A torn last line is left out."""
    (tmp_path / "scene.json").write_bytes((folder / "scene.json").read_bytes())
    log = (folder / "events.jsonl").read_bytes()
    (tmp_path / "events.jsonl").write_bytes(log[: len(log) // 2])
    assert view(tmp_path).exists()
    found: dict[str, Any] = piece(read_events(tmp_path / "events.jsonl"))
    assert found["outcome"] is None


def test_a_robot_that_waits_says_for_whom_until_it_goes_on() -> None:
    """Once for each reason; the next action ends it."""
    events: list[dict[str, Any]] = [
        {"t": 1.0, "kind": "waiting", "robot": "r1", "why": "door d, after robot r2", "on": ["r2"]},
        {"t": 2.0, "kind": "waiting", "robot": "r1", "why": "door d, after robot r2", "on": ["r2"]},
        {"t": 3.0, "kind": "waiting", "robot": "r1", "why": "door d, after robot r3", "on": ["r3"]},
        {"t": 4.0, "kind": "action_started", "robot": "r1", "step": 1, "action": "a()"},
    ]
    waits = [[1.0, "door d, after robot r2", ["r2"]], [3.0, "door d, after robot r3", ["r3"]], [4.0, "", []]]
    assert piece(events)["waits"] == {"r1": waits}
