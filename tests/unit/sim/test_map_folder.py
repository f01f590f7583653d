"""Buildings written as files."""

from dataclasses import replace
from pathlib import Path

import pytest

from clo_fleet.sim.map_folder import MapExistsError, MapNameError, write_building
from clo_fleet.sim.network_check import check_network
from clo_fleet.world.buildings import Measures, grid, line, ring
from clo_fleet.world.map_file import read_map
from clo_fleet.world.model import BuildingMap
from clo_fleet.world.yaml_file import FileWriteError


@pytest.mark.parametrize(
    "building",
    [grid(4, 3), grid(2, 2, Measures(two_lane=True)), ring(3), ring(16), line(2)],
    ids=lambda building: building.name,
)
def test_the_map_reads_back_with_a_network_of_its_own(tmp_path: Path, building: BuildingMap) -> None:
    """What was written is what was built, and netconvert kept every corridor."""
    written, path = write_building(building, tmp_path / "maps")
    assert read_map(path) == written
    assert written == replace(building, network=tmp_path / "maps" / f"{building.name}.net.xml.gz")
    assert written.network is not None
    assert check_network(written, written.network) == ()


def test_what_is_there_is_overwritten_by_force_alone(tmp_path: Path) -> None:
    """Without it both files stay as they were."""
    _, path = write_building(line(2, name="hall"), tmp_path)
    before = {file: file.read_bytes() for file in tmp_path.iterdir()}
    with pytest.raises(MapExistsError, match="nothing was overwritten"):
        write_building(line(3, name="hall"), tmp_path)
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == before
    write_building(line(3, name="hall"), tmp_path, force=True)
    assert len(read_map(path).rooms) == 3


@pytest.mark.parametrize("name", ["../hall", "a/b", "", ".hidden", "a\nb", "/etc/hall", "x" * 200])
def test_no_name_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    """The name is refused before anything is made."""
    with pytest.raises(MapNameError):
        write_building(replace(line(2), name=name), tmp_path / "maps")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    """As when a file is in its place."""
    (tmp_path / "maps").touch()
    with pytest.raises(FileWriteError, match="maps"):
        write_building(line(2), tmp_path / "maps")
