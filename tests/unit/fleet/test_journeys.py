"""A robot on its way through the corridors is left alone, and nothing is missed by that."""

from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world


def test_meters_are_the_same_however_often_one_looks() -> None:
    """Whoever asks for a robot wakes it; way and time come out alike, and so does what happens."""
    ends = []
    for often in (False, True):
        with Run(read_world(shipped("worlds") / "hello.yaml"), "clo") as run:
            while not run.done:
                run.step()
                if often:
                    run.mission.robot("r1")
            meters = [run.mission.robot(name).meters for name in ("r1", "r2")]
            ends.append((tuple(run.log), [(round(m.travelling, 6), round(m.distance, 6)) for m in meters]))
    assert ends[0] == ends[1]
    assert ends[0][1][0][1] > 10.0
