"""A mission that is rebuilt from what was saved goes on as the one that saved it, which is rebuilt as well."""

import json
from pathlib import Path

import pytest

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.fleet.mission import Mission
from clo_fleet.fleet.saved import Saved
from clo_fleet.study.event_log import EventLog
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world

EVERY = 20  # ticks between two savings
ON = 15  # ticks after which two missions are compared


def plain(mission: Mission) -> object:
    """All that the mission remembers, as another process reads it; nothing in it is more than JSON can say."""
    return json.loads(json.dumps(mission.state(), allow_nan=False))


def save(mission: Mission, folder: Path) -> Saved:
    """The mission as it stands."""
    traffic = folder / f"{mission.time:g}.xml.gz"
    mission.save_traffic(traffic)
    return Saved(state=json.loads(json.dumps(mission.state())), traffic=traffic, wall=mission.wall())


@pytest.mark.parametrize("name", ["three_rooms", "half_heard", "dialog"])
def test_every_saved_state_is_the_state_and_goes_on_alike(name: str, tmp_path: Path) -> None:
    """State right after rebuilding equals the saved one; ticks later, live and rebuilt missions agree in all."""
    world = read_world(shipped("worlds") / f"{name}.yaml")
    saved: list[tuple[Saved, int]] = []
    later: dict[int, object] = {}
    log = EventLog()
    with Mission(world, STRATEGIES["clo"], log) as mission:
        for tick in range(1, 6 * EVERY + 1):
            mission.step()
            later[tick] = plain(mission)
            if tick % EVERY == 0:
                saved.append((save(mission, tmp_path), len(log.events)))
                mission.rebuild(saved[-1][0])
                assert plain(mission) == saved[-1][0].state
    for number, (state, count) in enumerate(saved[:-1], start=1):
        again = EventLog()
        again.events += log.events[:count]
        with Mission(world, STRATEGIES["clo"], again, saved=state) as mission:
            assert plain(mission) == state.state
            for tick in range(1, ON + 1):  # both are asked in every tick: to say how far one has driven adds it up
                mission.step()
                assert plain(mission) == later[number * EVERY + tick]
        assert again.events == log.events[: len(again.events)]
