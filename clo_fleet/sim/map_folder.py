"""Buildings made by programs become files: the map, and the SUMO network of its corridors beside it."""

import re
from dataclasses import replace
from pathlib import Path

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.network import NetworkBuildError, build_network
from clo_fleet.sim.network_check import check_network
from clo_fleet.world.map_file import write_map
from clo_fleet.world.model import BuildingMap
from clo_fleet.world.yaml_file import FileWriteError

__all__ = ["MapExistsError", "MapNameError", "write_building"]

FILE_NAME = re.compile(r"[^\W_][\w .+-]{0,99}")  # no folder, nothing hidden


class MapNameError(CloFleetError):
    """A building's name cannot be that of a file.

    Attributes:
        name: the name.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.name = name

    def __str__(self) -> str:
        return (
            f"name of the map: got {self.name!r}, expected letters, digits, '_', '-' and '.', a letter or digit first"
        )


class MapExistsError(CloFleetError):
    """A map of that name is there already.

    Attributes:
        path: the map.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.path = path

    def __str__(self) -> str:
        return f"{self.path} exists already; nothing was overwritten"


def write_building(building: BuildingMap, folder: Path, *, force: bool = False) -> tuple[BuildingMap, Path]:
    """Write ``NAME.yaml`` and ``NAME.net.xml.gz``, each in one step; the building with its network, and its file.

    Args:
        building: the building; without corridors it gets no network.
        folder: made if it is not there.
        force: whether a map of that name may be overwritten.

    Raises:
        MapNameError: if the building's name cannot be that of a file.
        MapExistsError: if there is such a map and ``force`` is not given.
        NetconvertMissingError, NetworkBuildError: if the network cannot be built, or would not be the map's.
        FileWriteError: if the files cannot be written.
    """
    if not FILE_NAME.fullmatch(building.name):
        raise MapNameError(building.name)
    target = folder / f"{building.name}.yaml"
    if target.exists() and not force:
        raise MapExistsError(target)
    network = target.with_suffix(".net.xml.gz")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if building.corridors:
            build_network(building, network)
            if faults := check_network(building, network):
                network.unlink()
                raise NetworkBuildError(building.name, f"its corridors are too crooked or too short: {faults[0]}")
            building = replace(building, network=network)
    except OSError as error:
        raise FileWriteError(network, error.strerror or str(error)) from error
    write_map(building, target)
    return building, target
