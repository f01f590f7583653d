"""Checkpoints and ``run.json``: what is kept, and when nobody can go on."""

import gzip
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from clo_fleet.errors import CloFleetError
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.checkpoints import CheckpointError
from clo_fleet.study.event_log import EventLog, line
from clo_fleet.study.event_reading import EventLogError, recorded
from clo_fleet.study.run import CheckpointEveryError, Run
from clo_fleet.study.run_file import ResumeError, RunInUseError, held
from clo_fleet.study.shipped import copy_out
from clo_fleet.world.world_file import read_world


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory, fleet_planners: PlannerPool) -> Path:
    """A folder with copies of the shipped files, and in ``run`` a run of ``hello`` that was stopped after 7.4 s."""
    folder = tmp_path_factory.mktemp("stopped")
    copy_out(folder)
    source = folder / "worlds/hello.yaml"
    with Run(
        read_world(source), out=folder / "run", checkpoint_every=2.0, source=source, planners=fleet_planners
    ) as run:
        run.step(37)
    return folder


@pytest.fixture
def folder(stopped: Path, tmp_path: Path) -> Path:
    """A copy of that to spoil, with the place of the world's file in ``run.json`` made good."""
    copy = shutil.copytree(stopped, tmp_path / "copy")
    run_file = copy / "run/run.json"
    run_file.write_text(run_file.read_text(encoding="utf-8").replace(str(stopped), str(copy)), encoding="utf-8")
    return copy


def checkpoints(folder: Path) -> list[Path]:
    """The data files of the checkpoints, the oldest first."""
    return sorted((folder / "run/checkpoints").glob("*.json.gz"))


def test_the_last_two_are_kept_and_nothing_else(folder: Path) -> None:
    """Two files each; what was being written when somebody was killed is gone after the next."""
    assert sorted(path.name for path in (folder / "run/checkpoints").iterdir()) == [
        "0000004.0.json.gz",
        "0000004.0.traffic.xml.gz",
        "0000006.0.json.gz",
        "0000006.0.traffic.xml.gz",
    ]
    (folder / "run/checkpoints/.partial-x.json.gz").touch()
    with Run.resumed(folder / "run") as run:
        assert run.resumed_at == 6.0
        run.step(10)
        assert run.time == 8.0
    assert [path.name for path in (folder / "run/checkpoints").glob(".*")] == []
    assert len(list((folder / "run/checkpoints").iterdir())) == 4


def _torn(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-20])


def _other_traffic(path: Path) -> None:
    path.with_name(path.name.replace(".json.gz", ".traffic.xml.gz")).write_bytes(b"")


def _no_traffic(path: Path) -> None:
    path.with_name(path.name.replace(".json.gz", ".traffic.xml.gz")).unlink()


def _other_format(path: Path) -> None:
    path.write_bytes(gzip.compress(b'{"format": "clo-fleet/checkpoint/0"}'))


def _no_json(path: Path) -> None:
    path.write_bytes(gzip.compress(b"nonsense"))


def _keys_missing(path: Path) -> None:
    path.write_bytes(gzip.compress(b'{"format": "clo-fleet/checkpoint/1"}'))


@pytest.mark.parametrize("spoil", [_torn, _other_traffic, _no_traffic, _other_format, _no_json, _keys_missing])
def test_a_damaged_checkpoint_is_passed_over(folder: Path, spoil: Callable[[Path], None]) -> None:
    """The one before it serves; if both are damaged, that is said of each."""
    older, newer = checkpoints(folder)
    spoil(newer)
    assert Run.resumed(folder / "run").resumed_at == 4.0
    spoil(older)
    with pytest.raises(CheckpointError, match=r"0000006.*0000004") as caught:
        Run.resumed(folder / "run")
    assert caught.value.path == folder / "run/checkpoints"


def test_a_state_that_is_none_of_this_world_is_refused(folder: Path) -> None:
    """With the file's name; nothing is executed or guessed."""
    for path in checkpoints(folder):
        plain = json.loads(gzip.decompress(path.read_bytes()))
        plain["state"]["robots"] = {}
        path.write_bytes(gzip.compress(json.dumps(plain).encode()))
    with pytest.raises(CheckpointError, match="no state of this world"):
        Run.resumed(folder / "run")


def test_a_log_that_does_not_reach_a_checkpoint_is_gone_on_with_from_the_one_before(folder: Path) -> None:
    """After a power failure the log may be shorter than it was; a foreign one is refused."""
    log = folder / "run/events.jsonl"
    newest = json.loads(gzip.decompress(checkpoints(folder)[1].read_bytes()))
    log.write_bytes(log.read_bytes()[: newest["log"]["size"] - 1])
    assert Run.resumed(folder / "run").resumed_at == 4.0
    log.write_bytes(b'{"id":0}\n' * 100)
    with pytest.raises(CheckpointError, match="is not the log"):
        Run.resumed(folder / "run")


def test_without_a_checkpoint_a_run_begins_anew(folder: Path) -> None:
    """It was stopped before the first. All the while ``run.json`` stays: who is stopped again can go on again."""
    shutil.rmtree(folder / "run/checkpoints")
    before = (folder / "run/run.json").stat()
    with Run.resumed(folder / "run") as run:
        assert run.resumed_at is None
        assert run.log == ()
    after = (folder / "run/run.json").stat()
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


def _edited(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_what_has_changed_since_is_named(folder: Path) -> None:
    """World, map, network and version; a comment in a file changes nothing."""
    world, run_file = folder / "worlds/hello.yaml", folder / "run/run.json"
    _edited(world, "map:", "# a comment\nmap:")
    assert Run.resumed(folder / "run").resumed_at == 6.0
    building = read_world(world).map
    assert building.network is not None
    content = building.network.read_bytes()
    building.network.write_bytes(gzip.compress(gzip.decompress(content) + b"\n"))
    with pytest.raises(ResumeError, match="its network changed"):
        Run.resumed(folder / "run")
    building.network.write_bytes(content)
    changed = replace(read_world(world), name="other")
    with pytest.raises(ResumeError, match="its world changed"):
        Run.resumed(folder / "run", changed)
    doors = tuple(replace(door, width=door.width + 0.01) for door in building.doors)
    with pytest.raises(ResumeError, match="its map changed"):
        Run.resumed(folder / "run", replace(read_world(world), map=replace(building, doors=doors)))
    _edited(run_file, '"version": "', '"version": "0.0.')
    with pytest.raises(ResumeError, match=r"begun with clo-fleet 0\.0\."):
        Run.resumed(folder / "run")


def test_the_worlds_file_may_have_moved(folder: Path) -> None:
    """If it is told where it is."""
    (folder / "worlds").rename(folder / "elsewhere")
    with pytest.raises((OSError, CloFleetError), match=r"hello\.yaml"):
        Run.resumed(folder / "run")
    assert Run.resumed(folder / "run", folder / "elsewhere/hello.yaml").resumed_at == 6.0


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("nonsense", "is damaged"),
        ("{}", "format: Field required"),
        ('{"format": 7}', "format: Input should be a valid string"),
    ],
)
def test_a_damaged_run_file_is_refused(folder: Path, content: str, reason: str) -> None:
    """In words that say where."""
    (folder / "run/run.json").write_text(content, encoding="utf-8")
    with pytest.raises(ResumeError, match=re.escape(reason)):
        Run.resumed(folder / "run")


def test_a_run_that_ended_or_was_not_saved_is_not_gone_on_with(folder: Path) -> None:
    """Each with its reason."""
    (folder / "run/result.json").touch()
    with pytest.raises(ResumeError, match="it has ended"):
        Run.resumed(folder / "run")
    with pytest.raises(ResumeError, match="--checkpoint-every"):
        Run.resumed(folder)


def test_a_world_made_in_code_has_to_be_given(folder: Path) -> None:
    """There is no file to read it from."""
    run_file = folder / "run/run.json"
    plain = json.loads(run_file.read_text(encoding="utf-8"))
    run_file.write_text(json.dumps(plain | {"source": None}), encoding="utf-8")
    with pytest.raises(ResumeError, match="made in code"):
        Run.resumed(folder / "run")
    assert Run.resumed(folder / "run", read_world(folder / "worlds/hello.yaml")).resumed_at == 6.0


def test_two_processes_do_not_write_to_one_run(folder: Path) -> None:
    """The second is refused, and the files stay as they are."""
    before = (folder / "run/events.jsonl").read_bytes()
    with held(folder / "run"), pytest.raises(RunInUseError), Run.resumed(folder / "run"):
        pass
    assert (folder / "run/events.jsonl").read_bytes() == before


@pytest.mark.parametrize("seconds", [0.0, 0.1, 0.3, -2.0])
def test_checkpoints_are_taken_between_ticks(folder: Path, seconds: float) -> None:
    """Every multiple of the tick is possible, nothing else."""
    with pytest.raises(CheckpointEveryError, match=r"expected a multiple of the tick, 0\.2 s"):
        Run(read_world(folder / "worlds/hello.yaml"), checkpoint_every=seconds)


def test_a_new_run_forgets_the_checkpoints_of_the_old(folder: Path) -> None:
    """Also if it saves none itself."""
    with Run(read_world(folder / "worlds/hello.yaml"), out=folder / "run", force=True):
        assert not checkpoints(folder)
        with pytest.raises(ResumeError, match="not run with"):
            Run.resumed(folder / "run")


def test_events_read_back_as_they_were_written(folder: Path) -> None:
    """So that a result can be counted from the whole log."""
    log = folder / "run/events.jsonl"
    lines = log.read_bytes().splitlines()
    events = recorded(log, lines)
    assert [line(*event).encode() for event in events] == lines
    assert len({type(event) for _, _, event in events}) > 5
    for bad in (b"{}", b'{"id":0,"t":0.0,"kind":"nonsense"}', b'{"id":1,"t":0.0,"kind":"goals_reached","robot":"r1"}'):
        with pytest.raises(EventLogError, match=r"events\.jsonl:1"):
            recorded(log, [bad])


def test_a_log_is_cut_back_only_to_what_it_was(tmp_path: Path, folder: Path) -> None:
    """A torn tail goes; a log that is another one stays untouched."""
    path = tmp_path / "events.jsonl"
    events = recorded(path, (folder / "run/events.jsonl").read_bytes().splitlines())
    with EventLog(path) as log:
        for _, time, event in events[:3]:
            log.record(time, event)
        mark = log.mark()
        log.record(events[3][1], events[3][2])
    with path.open("ab") as file:
        file.write(b'{"id":4,"t":')
    with EventLog() as again:
        again.go_on(path, mark)
        assert again.events == events[:3]
        assert again.record(events[3][1], events[3][2]) == 3
        assert again.mark().events == 4
    assert recorded(path, path.read_bytes().splitlines()) == events[:4]
    before = path.read_bytes()
    with EventLog() as other, pytest.raises(EventLogError):
        other.go_on(path, replace(mark, sha256="0"))
    assert path.read_bytes() == before
