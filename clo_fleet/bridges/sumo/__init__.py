"""Maps of SUMO road networks: `import_network` makes a map of a ``.net.xml`` file, or of ``.nod.xml`` and ``.edg.xml``.

=======================================================  =======================================================
SUMO                                                     clo-fleet
=======================================================  =======================================================
node, junction                                           junction
edges between two nodes, there and back                  corridor with a lane for each direction
two edges on one centre line (``bidi``)                  corridor with a single lane
edge without one back                                    one-way corridor
node where a single corridor ends (a dead end)           junction with a room at it
node named by the user                                   junction with a room at it
edge shorter than 1.2 m                                  none: its nodes become one junction
=======================================================  =======================================================

A room at a node is a square with a wide door, a straight spur of 3.5 m to 7 m away, where neither corridors nor other
rooms are: straight on from a dead end, else in the widest gap between corridors. Robots have to come back: only the
largest part of the network is kept in which every node can be reached from every other. What robots need not is left
out: lanes beside the first, edges for trains, ships and aircraft alone, traffic lights, connections (here all turns
are allowed), roundabouts' rights of way. `ImportedNetwork.skipped` tells it all.
"""

from clo_fleet.bridges.sumo.importing import ImportedNetwork, import_network
from clo_fleet.bridges.sumo.reading import SumoError, is_sumo_file

__all__ = ["ImportedNetwork", "SumoError", "import_network", "is_sumo_file"]
