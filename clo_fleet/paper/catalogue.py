"""The paper's domains by name, and what was varied in the study."""

from collections.abc import Mapping
from types import MappingProxyType

from clo_fleet.paper.cooking import Cooking
from clo_fleet.paper.dialog import Dialog
from clo_fleet.paper.rooms import Rooms
from clo_fleet.paper.settings import Setting

__all__ = ["PROBABILITIES", "SETTINGS", "SIZES"]

SIZES = (5, 10, 20, 40)
PROBABILITIES = (0.1, 0.2, 0.5)
_ALL: tuple[Setting, ...] = (Rooms(), Dialog(), Cooking())
SETTINGS: Mapping[str, Setting] = MappingProxyType({setting.name: setting for setting in _ALL})
