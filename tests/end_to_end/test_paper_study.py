"""A longer study (``make study``): improving a plan in ROOMS against planning again at every step."""

from collections.abc import Callable
from itertools import product
from statistics import mean

import pytest

from clo_fleet.paper.catalogue import PROBABILITIES, SIZES
from clo_fleet.paper.crew import Crew
from clo_fleet.paper.episode import PAPER_LIMITS
from clo_fleet.paper.rows import Row, Run

SEEDS = 20


@pytest.mark.study
def test_clo_improve_executes_no_more_actions_than_replan(capsys: pytest.CaptureFixture[str]) -> None:
    """ROOMS, means of 20 seeds. Prints the table, with the time for deciding as a share of that for planning again."""
    cells = tuple(product(SIZES, PROBABILITIES))
    strategies = ("clo-improve", "replan")
    runs = [
        Run("rooms", *cell, name, "in-process", seed) for cell in cells for name in strategies for seed in range(SEEDS)
    ]
    with Crew(PAPER_LIMITS) as crew:
        rows = {row.run: row for row in crew.rows(runs)}

    def over_seeds(cell: tuple[int, float], strategy: str, figure: Callable[[Row], float]) -> float:
        return mean(figure(rows[Run("rooms", *cell, strategy, "in-process", seed)]) for seed in range(SEEDS))

    assert all(row.done for row in rows.values())
    actions = {}
    for cell in cells:
        actions[cell] = tuple(over_seeds(cell, name, lambda row: row.executed) for name in strategies)
        deciding = over_seeds(cell, "clo-improve", lambda row: row.wall_deciding - row.wall_first_deciding)
        planning = over_seeds(cell, "replan", lambda row: row.wall_planning - row.wall_first_planning)
        with capsys.disabled():
            print(
                f"rooms {cell[0]:3} {cell[1]:.1f}: clo-improve {actions[cell][0]:6.2f}, replan {actions[cell][1]:6.2f}",
                end="",
            )
            print(f" actions; deciding {deciding:.4f} s, planning {planning:.3f} s: {deciding / planning:.2%}")
    assert all(ours <= theirs for ours, theirs in actions.values())
