"""Repairs on IPC problems: unified-planning's validator agrees with every plan that is called repaired."""

from pathlib import Path

import pytest

from clo_fleet.study.repair_study import Prepared, Settings, prepared, problems, trial

IPC = Path(__file__).resolve().parents[3] / "shared" / "pddl"
SETTINGS = Settings(episodes=12, seed=1)
PROBLEMS = (
    *("blocks/probBLOCKS-4-0", "driverlog/p01", "gripper/prob01", "logistics00/probLOGISTICS-4-0"),
    *("miconic/s2-3", "miconic-simpleadl/s5-0", "rovers/p01"),
)


@pytest.mark.skipif(not IPC.is_dir(), reason=f"no IPC domains in {IPC}")
@pytest.mark.parametrize("label", PROBLEMS)
def test_no_repaired_plan_is_invalid(label: str) -> None:
    """Whatever happens in a plan's way, what the repair returns reaches the goals of the original problem."""
    case = prepared(*problems([IPC], label)[0], SETTINGS)
    assert isinstance(case, Prepared)
    for number in range(SETTINGS.episodes):
        done = trial(case, case.episodes.episode(number), SETTINGS)
        assert done.valid is not False, f"{label}:{number}"
        assert done.repaired or done.broken
