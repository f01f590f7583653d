"""Crossings: which ways over a junction robots must not drive at once.

SUMO takes two ways over a junction for foes where their middle lines cross, and guesses from lane width and angle how
far robots on them are in each other's way. It overlooks ways that only pass too near one another, and where ways cross
at an acute angle it guesses too little: robots overlapped by up to 0.37 m. So each two ways are compared as robots
drive them, disc by disc, and what is found is written into the network: who are foes, and for both of them a `conflict`
that ends where the tail is clear of the other way.

All conflicts begin where the junction begins. So a robot waits outside until who is in its way has passed, and nobody
stands on the junction, but behind the next one on the same lane. If conflicts began where robots could touch, robots
would wait for one another on the junction in a circle: of 61 times that twelve crossed it at once, one froze.

Ways from the same lane or into the same lane are left to SUMO, which lets robots on them follow one another; so are the
two directions of a single lane, of which only one is ever used.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from clo_fleet.sim.vehicle import LENGTH, VEHICLE

__all__ = ["keep_apart"]

APART = VEHICLE["Width"] + 0.01  # [m] between the middles of two robots, so that they do not touch
STEP = 0.1  # [m] of way from one place that is compared to the next
BEGIN = 0.01  # [m] behind the beginning of the junction; SUMO forgets conflicts that begin at 0

_Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Over:
    """A way over a junction.

    Attributes:
        link: SUMO's connection.
        number: of the connection at its junction.
        fronts: places of a robot's front, from the beginning of the junction [m].
        middles: where the middle of the robot is then [m].
    """

    link: ET.Element
    number: int
    fronts: _Numbers
    middles: _Numbers


def keep_apart(network: ET.Element) -> None:
    """Tell a SUMO network where on its junctions robots would touch."""
    lanes = {lane.attrib["id"]: lane for lane in network.iterfind("edge/lane")}
    opposite = {edge.attrib["id"]: edge.attrib["bidi"] for edge in network.iterfind("edge[@bidi]")}
    links = {link.attrib["via"]: link for link in network.iterfind("connection[@via]")}
    for junction in network.iterfind("junction"):
        requests = {request.attrib["index"]: request for request in junction.iterfind("request")}
        for one, other in combinations(_ways_over(junction, links, lanes), 2):
            if _apart_anyway(one, other, opposite):
                continue
            for way, foe, end in _conflicts(one, other):
                _set_foe(requests[str(way.number)], foe.number)
                ends = {name: foe.link.attrib[name] for name in ("from", "to", "fromLane", "toLane")}
                ET.SubElement(way.link, "conflict", ends, startPos=f"{BEGIN:.3f}", endPos=f"{end:.3f}")


def _ways_over(
    junction: ET.Element, links: Mapping[str, ET.Element], lanes: Mapping[str, ET.Element]
) -> Iterator[_Over]:
    """The ways over a junction, as SUMO numbers them."""
    for number, via in enumerate(junction.attrib["intLanes"].split()):
        if via in links:
            link = links[via]
            before, after = (lanes[f"{link.attrib[end]}_{link.attrib[f'{end}Lane']}"] for end in ("from", "to"))
            yield _way_over(link, number, before, lanes[via], after)


def _way_over(link: ET.Element, number: int, before: ET.Element, over: ET.Element, after: ET.Element) -> _Over:
    """A way, from where the front of a robot comes onto the junction to where its tail has left it."""
    pieces = [_measured(lane) for lane in (before, over, after)]
    starts = np.cumsum([-pieces[0][0][-1], *(places[-1] for places, _ in pieces[:2])])
    places = np.concatenate([start + places for start, (places, _) in zip(starts, pieces, strict=True)])
    points = np.concatenate([points for _, points in pieces])
    fronts = np.arange(0.0, pieces[1][0][-1] + LENGTH, STEP)

    def at(place: _Numbers) -> _Numbers:
        return np.stack([np.interp(place, places, points[:, axis]) for axis in (0, 1)], axis=1)

    ahead = at(fronts) - at(fronts - LENGTH)
    ahead /= np.maximum(np.hypot(ahead[:, 0], ahead[:, 1]), 1e-9)[:, np.newaxis]
    return _Over(link, number, fronts, at(fronts) - LENGTH / 2 * ahead)


def _measured(lane: ET.Element) -> tuple[_Numbers, _Numbers]:
    """How far along a lane the points of its shape are, as SUMO counts its length, and these points [m]."""
    points = np.array([[float(number) for number in point.split(",")[:2]] for point in lane.attrib["shape"].split()])
    places = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    return places * (float(lane.attrib["length"]) / max(places[-1], 1e-9)), points


def _apart_anyway(one: _Over, other: _Over, opposite: Mapping[str, str]) -> bool:
    """Whether robots on the two ways follow one another, or never drive at the same time."""
    a, b = one.link.attrib, other.link.attrib
    same = a["from"] == b["from"] or a["to"] == b["to"]
    return same or opposite.get(a["from"]) == b["to"] or opposite.get(a["to"]) == b["from"]


def _conflicts(one: _Over, other: _Over) -> Iterator[tuple[_Over, _Over, float]]:
    """For each of two ways if robots on them could touch: way, foe, and where a tail is clear of the foe [m]."""
    between = one.middles[:, np.newaxis, :] - other.middles[np.newaxis, :, :]
    near = np.hypot(between[..., 0], between[..., 1]) < APART
    if near.any():
        for way, foe, axis in ((one, other, 1), (other, one, 0)):
            last = float(way.fronts[near.any(axis=axis)][-1])
            yield way, foe, max(last + STEP - LENGTH, 2 * BEGIN)


def _set_foe(request: ET.Element, foe: int) -> None:
    """Note in the request of a connection that another is its foe and goes first if it was there first."""
    for key in ("response", "foes"):
        bits = request.attrib[key]  # the last one is that of the first connection
        place = len(bits) - 1 - foe
        request.set(key, f"{bits[:place]}1{bits[place + 1 :]}")
