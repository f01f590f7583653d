"""The paper's numbers, as we have typed them."""

import re
from pathlib import Path

import pytest

from clo_fleet.paper.reference import PLAN_LENGTHS, TABLE, reported

PAPER = Path(__file__).resolve().parents[4] / "shared" / "paper"


@pytest.mark.skipif(not PAPER.is_dir(), reason=f"no source of the paper in {PAPER}")
def test_the_table_is_the_papers() -> None:
    """Every number of the printed table, and the lengths of the first plans, against the paper's source."""
    source = "".join(path.read_text(encoding="utf-8") for path in sorted(PAPER.iterdir()))
    printed = {}
    for size, probability, cells in re.findall(r"p-(\d+) & (0\.\d) & ([^\\]*)\\\\", source):
        numbers = [cell.strip() for cell in cells.split("&")]
        printed[int(size), float(probability)] = tuple(None if text == "-" else float(text) for text in numbers)
    assert printed == TABLE
    lengths = [
        tuple(map(int, four)) for four in re.findall(r"(\d+), (\d+), (\d+) and (\d+)\s+actions, respectively", source)
    ]
    assert lengths == list(PLAN_LENGTHS.values())


def test_a_cell_says_where_it_stands() -> None:
    """Strategies that the paper does not have are compared with nothing."""
    cell = reported("dialog", 40, 0.1, "replan")
    assert cell is not None
    assert (cell.executed, cell.cell) == (None, "Borrajo and Veloso 2024, Table V, p-40 0.1, DIALOG REPLAN")
    assert reported("rooms", 5, 0.1, "replan-on-failure") is None
    assert reported("rooms", 6, 0.1, "clo") is None
