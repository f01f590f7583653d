"""A file of which one does not know yet whether it is a map or a world."""

from pathlib import Path

from clo_fleet.world.map_file import MAP_FORMAT, read_map
from clo_fleet.world.model import BuildingMap, World
from clo_fleet.world.world_file import read_world
from clo_fleet.world.yaml_file import read_yaml

__all__ = ["read_any"]


def read_any(path: Path) -> BuildingMap | World:
    """The map or the world that the file describes; told apart by ``format``, or else by having ``rooms``.

    Raises:
        FileFaultsError: with everything that is wrong with the file, and with a world's map.
    """
    content = read_yaml(path).content
    is_map = content.get("format") == MAP_FORMAT or ("rooms" in content and "robots" not in content)
    return read_map(path) if is_map else read_world(path)
