"""Worlds read with other values than their files say."""

from pathlib import Path

import pytest

from clo_fleet.study.shipped import shipped
from clo_fleet.world.changes import changed
from clo_fleet.world.faults import FileFaultsError
from clo_fleet.world.world_file import read_world
from clo_fleet.world.yaml_file import Value, read_yaml

OFFICE = shipped("worlds") / "office.yaml"


def test_a_change_puts_a_value_in_whether_the_file_has_the_key_or_not() -> None:
    """Nested keys are made where they are missing; what is not named stays."""
    world = read_world(OFFICE, {"radio.loss": 0.25, "until_s": 60, "skills.prepare_s": 9})
    assert (world.radio.loss, world.until, world.skills.prepare) == (0.25, 60.0, 9.0)
    assert world.robots == read_world(OFFICE).robots


def test_a_fleet_is_its_first_robots(tmp_path: Path) -> None:
    """In the order of the file."""
    file = read_yaml(OFFICE)
    robots = changed(file, {"fleet_size": 2}).content["robots"]
    assert isinstance(robots, dict)
    everybody = file.content["robots"]
    assert isinstance(everybody, dict)
    assert list(robots) == list(everybody)[:2]


def test_an_item_of_a_list_is_named_by_its_index(tmp_path: Path) -> None:
    """From 0."""
    path = tmp_path / "file.yaml"
    path.write_text("disturbances: [{at_s: 1}, {at_s: 2}]\n")
    content = changed(read_yaml(path), {"disturbances.1.at_s": 5}).content
    assert content == {"disturbances": ({"at_s": 1}, {"at_s": 5})}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"fleet_size": 0}, "a fleet_size from 1 to the file's 4 robots"),
        ({"fleet_size": 5}, "a fleet_size from 1 to the file's 4 robots"),
        ({"fleet_size": True}, "a fleet_size from 1"),
        ({"map.name": "x"}, "keys below it, for the change of map.name"),
        ({"disturbances.7.at_s": 1.0}, "disturbances"),
        ({"radio.lost": 0.5}, "did you mean loss?"),
        ({"radio.loss": 2}, "a number of at most 1"),
    ],
)
def test_a_change_that_does_not_fit_is_a_fault_of_the_file(changes: dict[str, Value], said: str) -> None:
    """In the words of the file's own checks."""
    with pytest.raises(FileFaultsError, match=said.replace("?", r"\?")):
        read_world(OFFICE, changes)
