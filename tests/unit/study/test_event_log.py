"""The event log as a file."""

import json
from pathlib import Path

import pytest

from clo_fleet.study.event_log import EventLog, EventLogError, read_events
from clo_fleet.world.events import FactChanged, GoalsReached, RunEnded, kind


def test_line_has_id_time_kind_and_fields(tmp_path: Path) -> None:
    """Facts are written as PDDL writes them."""
    path = tmp_path / "events.jsonl"
    with EventLog(path) as log:
        assert log.record(0.2, FactChanged(("holding", "r1", "o2"), True, "r2", 7)) == 0
        assert log.record(0.4, GoalsReached("r1")) == 1
    assert [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] == [
        {"id": 0, "t": 0.2, "kind": "fact_changed", "fact": "(holding r1 o2)", "value": True, "by": "r2", "cause": 7},
        {"id": 1, "t": 0.4, "kind": "goals_reached", "robot": "r1"},
    ]


def test_torn_last_line_is_left_out(tmp_path: Path) -> None:
    """A run that was cut short can be read."""
    path = tmp_path / "events.jsonl"
    with EventLog(path) as log:
        log.record(0.0, GoalsReached("r1"))
    path.write_text(path.read_text(encoding="utf-8") + '{"id":1,"t":0.', encoding="utf-8")
    assert [event["kind"] for event in read_events(path)] == ["goals_reached"]


def test_torn_line_in_the_middle_is_named(tmp_path: Path) -> None:
    """What is no event is refused with its line."""
    path = tmp_path / "events.jsonl"
    path.write_text('{"id":0}\nnonsense\n{"id":2}\n', encoding="utf-8")
    with pytest.raises(EventLogError, match=r"events\.jsonl:2"):
        read_events(path)


def test_kinds_are_words() -> None:
    """The class's name, in small letters."""
    assert kind(RunEnded("goals_reached", "")) == "run_ended"
