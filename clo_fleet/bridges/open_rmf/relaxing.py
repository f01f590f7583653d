"""Corridors moved a little, so that robots have more space: coordinate descent on the harm of the network."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from clo_fleet.bridges.open_rmf.cells import rounded
from clo_fleet.bridges.open_rmf.corridors import SHORTEST_STUB, SHORTEST_WAY, Ground
from clo_fleet.bridges.open_rmf.lanes import Network, Way
from clo_fleet.world.model import Point
from clo_fleet.world.outlines import length

__all__ = ["relaxed"]

STEPS = (0.4, 0.2, 0.1)  # [m]
PASSES = 4  # at most, with each step
DRIFT_PRICE = 0.5  # [m2] of harm that each metre counts for that a point is away from where its lane was drawn
ASIDE = tuple((math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)) for k in range(8))


@dataclass(frozen=True, slots=True)
class _Handle:
    """A node, or the bend of that number in a way."""

    node: str = ""
    way: int = -1
    bend: int = -1


def relaxed(network: Network, ground: Ground) -> Network:
    """The network with junctions and bends moved where that does less harm; what is right at a door stays in line."""
    handles = [_Handle(node=node) for node in network.nodes if node not in network.doors]
    handles += [_Handle(way=k, bend=bend) for k, way in enumerate(network.ways) for bend in range(len(way.via))]
    drawn = {handle: _place(network, handle) for handle in handles}
    away = dict.fromkeys(handles, 0.0)
    best = ground.harm(network)
    for step in STEPS:
        for _ in range(PASSES):
            before = best
            for handle in handles:
                for network_moved, place in list(_shifts(network, handle, step)):
                    drift = DRIFT_PRICE * math.dist(place, drawn[handle])
                    harm = ground.harm(network_moved) + sum(away.values()) - away[handle] + drift
                    if harm < best - 1e-6:
                        network, best = network_moved, harm
                        away[handle] = drift
            if best > before - 0.01:
                break
    return network


def _place(network: Network, handle: _Handle) -> Point:
    return network.nodes[handle.node] if handle.node else network.ways[handle.way].via[handle.bend]


def _shifts(network: Network, handle: _Handle, step: float) -> Iterator[tuple[Network, Point]]:
    """The network with the point moved by a step each way that it may go, and where the point is then."""
    x, y = _place(network, handle)
    door = _door_before(network, handle)
    directions = ASIDE
    if door is not None:
        ux, uy = ((x - door[0]) / math.dist((x, y), door), (y - door[1]) / math.dist((x, y), door))
        directions = ((ux, uy), (-ux, -uy))
    for dx, dy in directions:
        place = rounded((x + step * dx, y + step * dy))
        if door is not None and math.dist(place, door) < SHORTEST_STUB:
            continue
        moved = _with(network, handle, place)
        if all(length(moved.line(way)) >= SHORTEST_WAY for way in moved.ways):
            yield moved, place


def _with(network: Network, handle: _Handle, place: Point) -> Network:
    if handle.node:
        return Network({**network.nodes, handle.node: place}, network.ways, network.doors)
    ways = list(network.ways)
    via = ways[handle.way].via
    ways[handle.way] = replace(ways[handle.way], via=(*via[: handle.bend], place, *via[handle.bend + 1 :]))
    return Network(network.nodes, tuple(ways), network.doors)


def _door_before(network: Network, handle: _Handle) -> Point | None:
    """The door whose corridor runs straight up to the point."""

    def doors(way: Way, number: int) -> Iterator[Point]:
        line = network.line(way)
        if number == 1 and way.start in network.doors:
            yield line[0]
        if number == len(line) - 2 and way.end in network.doors:
            yield line[-1]

    for k, way in enumerate(network.ways):
        if handle.way == k:
            return next(doors(way, handle.bend + 1), None)
        if handle.node in way.ends:
            number = 0 if way.start == handle.node else len(way.via) + 1
            found = next(doors(way, number), None)
            if found is not None:
                return found
    return None
