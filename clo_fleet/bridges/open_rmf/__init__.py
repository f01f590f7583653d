"""Maps of Open-RMF buildings: `import_building` makes a map of a ``.building.yaml`` file.

=====================================================  ===========================================================
Open-RMF                                               clo-fleet
=====================================================  ===========================================================
level                                                  map
cell (floors less walls and doors) with most lanes     the hub: its lanes become corridors
any other cell with a door                             room
door between the hub and a cell                        door, with a straight stub of corridor to a junction
door between two other cells                           door between two rooms
lane in the hub                                        corridor with a lane for each direction, one if one-way
``pickup_dispenser``, ``dropoff_ingestor``,            spawn point in its room; where it is in the hub, in a *bay*,
``spawn_robot_name``; named places to hold or park     a virtual room made for it (see `bays`)
model (furniture)                                      none, as files do not say how large it is
=====================================================  ===========================================================

What a map says differs from the drawing where robots of this fleet need it: corridors are two lanes side by side, so
doors onto them are widened to 1.3-1.6 m, lanes bend to leave doorways and bays free, vertices within 0.25 m are one,
and lanes that lead to no door are left out. `Imported.skipped` tells all that is missing or was changed.
"""

from clo_fleet.bridges.open_rmf.importing import Imported, import_building, import_to_folder
from clo_fleet.bridges.open_rmf.reading import OpenRmfError

__all__ = ["Imported", "OpenRmfError", "import_building", "import_to_folder"]
