"""A longer study (``make study``): repairs on all IPC problems at hand."""

from pathlib import Path

import pytest

from clo_fleet.study.repair_study import Settings, study
from clo_fleet.study.repair_tables import rows, tables
from clo_fleet.study.summary import show

IPC = Path(__file__).resolve().parents[3] / "shared" / "pddl"


@pytest.mark.study
@pytest.mark.skipif(not IPC.is_dir(), reason=f"no IPC domains in {IPC}")
def test_most_broken_plans_are_repaired_and_no_repaired_plan_is_invalid(capsys: pytest.CaptureFixture[str]) -> None:
    """Of the broken plans that need not go back at least 95% after one foreign action, 90% after five."""
    result = study([IPC], Settings())
    with capsys.disabled():
        show(tables(result))
    assert result.skipped == ()
    assert not any(trial.valid is False for trial in result.trials)
    repaired = {row.surprise: row.repaired_of_possible for row in rows(result.trials) if row.domain == "all"}
    assert repaired["1 action"] >= 0.95
    assert repaired["5 actions"] >= 0.9
