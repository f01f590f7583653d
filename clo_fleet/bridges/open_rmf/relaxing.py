"""Corridors moved a little, so that robots have more space: coordinate descent on the harm of the network."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from clo_fleet.bridges.open_rmf.cells import rounded
from clo_fleet.bridges.open_rmf.corridors import SHORTEST_STUB, SHORTEST_WAY, Ground
from clo_fleet.bridges.open_rmf.lanes import Network
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
                for network_moved, place in list(_shifts(network, ground, handle, step)):
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


def _shifts(network: Network, ground: Ground, handle: _Handle, step: float) -> Iterator[tuple[Network, Point]]:
    """The network with the point moved by a step each way that it may go, and where the point is then."""
    for place in _places(network, ground, handle, step):
        moved = _with(network, handle, place)
        if all(length(moved.line(way)) >= SHORTEST_WAY for way in moved.ways):
            yield moved, place


def _places(network: Network, ground: Ground, handle: _Handle, step: float) -> Iterator[Point]:
    """Where the point may go: anywhere, or to and fro in front of its door; nowhere if it is in front of two."""
    x, y = _place(network, handle)
    doors = [ground.doors[door] for door in _doors_before(network, handle)]
    if not doors:
        yield from (rounded((x + step * dx, y + step * dy)) for dx, dy in ASIDE)
    elif len(doors) == 1:
        (door_x, door_y), heading = doors[0].position, doors[0].heading
        out = math.dist((x, y), (door_x, door_y))
        for reach in (out - step, out + step):
            if reach >= SHORTEST_STUB:
                yield rounded((door_x + reach * math.cos(heading), door_y + reach * math.sin(heading)))


def _with(network: Network, handle: _Handle, place: Point) -> Network:
    if handle.node:
        return Network({**network.nodes, handle.node: place}, network.ways, network.doors)
    ways = list(network.ways)
    via = ways[handle.way].via
    ways[handle.way] = replace(ways[handle.way], via=(*via[: handle.bend], place, *via[handle.bend + 1 :]))
    return Network(network.nodes, tuple(ways), network.doors)


def _doors_before(network: Network, handle: _Handle) -> set[str]:
    """The doors whose corridors run straight up to the point."""
    found = set()
    for k, way in enumerate(network.ways):
        if handle.way == k:
            places = [handle.bend + 1]
        else:
            places = [0] * (way.start == handle.node) + [len(way.via) + 1] * (way.end == handle.node)
        for place in places:
            found |= {way.start} if place == 1 else set()
            found |= {way.end} if place == len(way.via) else set()
    return found & network.doors
