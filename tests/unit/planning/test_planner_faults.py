"""What befalls planners."""

import json

from clo_fleet.planning.planner_faults import PlannerFaults
from clo_fleet.world.model import RobotId

R1, R2 = RobotId("r1"), RobotId("r2")


def test_a_fault_strikes_once() -> None:
    """The next question is answered."""
    faults = PlannerFaults({R1})
    assert not faults.strikes(R2)
    assert faults.strikes(R1)
    assert not faults.strikes(R1)


def test_faults_survive_a_round_trip() -> None:
    """Who is doomed and who is slow is plain data."""
    faults, other = PlannerFaults({R1}, {R2: 3.0}), PlannerFaults()
    other.restore(json.loads(json.dumps(faults.state())))
    assert other == faults
    assert (other.delay(R1), other.delay(R2)) == (0.0, 3.0)
