"""Which runs a batch file asks for, and what they are called."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from clo_fleet.study.batch.definition import Definition
from clo_fleet.study.batch.shard import Shard
from clo_fleet.study.batch.spec import Limits, read_batch
from clo_fleet.study.shipped import copy_out
from clo_fleet.world.faults import FileFaultsError

Write = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a batch file beside the shipped worlds."""
    copy_out(tmp_path)

    def text(content: str) -> Path:
        path = tmp_path / "batch.yaml"
        path.write_text("format: clo-fleet/batch/1\n" + content)
        return path

    return text


def test_all_combinations_are_run_each_once(write: Write) -> None:
    """2 worlds x 2 strategies x 3 seeds x 2 values; a world that is named twice adds nothing."""
    path = write(
        "worlds: [worlds/hello.yaml, worlds/office.yaml, worlds/hello.yaml]\nstrategies: [clo, replan]\nseeds: 3\n"
        "sweep: {radio.loss: [0, 0.5]}\nlimits: {wall_s: 9, memory_mb: 1024}\n"
    )
    batch = read_batch(path)
    assert len(batch.runs) == len({run.id for run in batch.runs}) == 2 * 2 * 3 * 2
    assert batch.swept == ("radio.loss",)
    assert batch.limits == Limits(9.0, 1 << 30)
    assert {run.seed for run in batch.runs} == {0, 1, 2}
    assert {run.read().radio.loss for run in batch.runs} == {0.0, 0.5}


def test_an_id_is_a_hash_of_what_defines_the_run_and_of_nothing_else(write: Write, tmp_path: Path) -> None:
    """A comment, another folder or another order change none; a value, a seed or the network does."""
    lines = "worlds: [worlds/hello.yaml]\nseeds: [4, 7]\n"
    before = [run.id for run in read_batch(write(lines)).runs]
    world = tmp_path / "worlds" / "hello.yaml"
    world.write_text(world.read_text() + "# a remark\n")
    (tmp_path / "elsewhere").mkdir()
    for folder in ("worlds", "maps"):
        (tmp_path / folder).rename(tmp_path / "elsewhere" / folder)
    path = write("worlds: [elsewhere/worlds/hello.yaml]\nseeds: [7, 4]\n")
    assert [run.id for run in read_batch(path).runs] == before[::-1]
    path = write("worlds: [elsewhere/worlds/hello.yaml]\nseeds: [4, 7]\nuntil_s: 17\n")
    assert not {run.id for run in read_batch(path).runs} & set(before)


def test_two_worlds_of_one_name_are_refused(write: Write, tmp_path: Path) -> None:
    """Their rows could not be told apart."""
    other = tmp_path / "worlds" / "other.yaml"
    other.write_text((tmp_path / "worlds" / "hello.yaml").read_text().replace("until_s: 120", "name: hello"))
    with pytest.raises(
        FileFaultsError, match=r"worlds\[1\]: got 'worlds/other.yaml', expected a world with another name"
    ):
        read_batch(write("worlds: [worlds/hello.yaml, worlds/other.yaml]\n"))


def test_a_definition_survives_json(write: Write) -> None:
    """Lists in changes included."""
    (run,) = read_batch(write("worlds: [worlds/hello.yaml]\nsweep: {radio.loss: [0.25]}\nseeds: [3]\n")).runs
    assert Definition.from_json(run.to_json()) == run
    assert json.loads(run.to_json())["changes"] == {"radio.loss": 0.25}
    assert run.read().seed == 3


def test_shards_are_a_batch_in_parts() -> None:
    """Every run is in exactly one of them, and they differ by at most one in size."""
    parts = [Shard(number, 3).part(range(10)) for number in (1, 2, 3)]
    assert sorted(run for part in parts for run in part) == list(range(10))
    assert [len(part) for part in parts] == [4, 3, 3]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("worlds: []\n", "at least 1 entries"),
        ("worlds: [worlds/none.yaml]\n", r"worlds\[0\]: got 'worlds/none.yaml', expected a world file that exists"),
        ("worlds: [/etc/passwd]\n", "named relative to this file"),
        ("worlds: [worlds/hello.yaml]\nstrategies: [cloo]\n", "did you mean clo"),
        ("worlds: [worlds/hello.yaml]\nseeds: 0\n", "how many seeds, from 1, or a list of seeds"),
        ("worlds: [worlds/hello.yaml]\nseeds: [-1]\n", "how many seeds"),
        ("worlds: [worlds/hello.yaml]\nseeds: 200000\n", "at most 100,000 runs"),
        ("worlds: [worlds/hello.yaml]\nsweep: {radio.loss: []}\n", "at least 1 entries"),
        ("worlds: [worlds/hello.yaml]\nsweep: {radio.loss: [0, 2]}\n", r"3:9: sweep.'radio.loss'\[1\]: got 2"),
        ("worlds: [worlds/hello.yaml]\nsweep: {radio.loss: [0, 2]}\n", "a number of at most 1"),
        ("worlds: [worlds/hello.yaml]\nsweap: {}\n", "did you mean sweep"),
    ],
)
def test_a_faulty_file_is_told_with_its_place(write: Write, content: str, said: str) -> None:
    """Before anything is run."""
    with pytest.raises(FileFaultsError, match=said.replace("?", r"\?")) as caught:
        read_batch(write(content))
    assert "batch.yaml:" in str(caught.value)
