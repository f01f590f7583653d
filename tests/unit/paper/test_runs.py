"""Which runs make up a study."""

from collections import Counter

import pytest

from clo_fleet.paper.runs import ARMS, Selection, UnknownNameError, narrowed, quick, runs


def test_every_cell_of_the_paper_is_studied_with_every_strategy() -> None:
    """Three domains, four problems, three probabilities; REPLAN through unified-planning as well."""
    found = runs(Selection(seeds=1))
    assert len(found) == len(set(found)) == 3 * 4 * 3 * len(ARMS)


def test_costly_cells_get_fewer_seeds_but_never_none() -> None:
    """REPLAN in DIALOG, and all that goes through unified-planning; the others get all of them."""
    seeds = Counter((run.domain, run.size, run.strategy, run.route) for run in runs(Selection(probabilities=(0.1,))))
    assert set(seeds.values()) == {20, 7, 5, 4, 2, 1}
    assert [seeds["dialog", size, "replan", "in-process"] for size in (5, 10, 20, 40)] == [20, 7, 5, 2]
    assert [seeds["dialog", size, "replan", "unified-planning"] for size in (5, 10, 20, 40)] == [4, 2, 1, 1]
    assert seeds["rooms", 40, "replan", "in-process"] == seeds["dialog", 40, "clo", "in-process"] == 20


def test_quick_is_the_two_smaller_problems_with_three_seeds() -> None:
    """Through unified-planning the smallest one only."""
    found = runs(quick())
    assert {run.size for run in found} == {5, 10}
    assert {run.seed for run in found} == {0, 1, 2}
    assert {run.size for run in found if run.route == "unified-planning"} == {5}


def test_a_study_stopped_early_has_all_cells_alike() -> None:
    """All runs of a seed come before those of the next."""
    seeds = [run.seed for run in runs(quick())]
    assert seeds == sorted(seeds)


@pytest.mark.parametrize(
    ("names", "problems"),
    [
        (["rooms/p-05"], {("rooms", 5)}),
        (["p-40"], {("rooms", 40), ("dialog", 40), ("cooking", 40)}),
        (["cooking", "rooms/p-10"], {("cooking", 5), ("cooking", 10), ("cooking", 20), ("cooking", 40), ("rooms", 10)}),
        ([], set(Selection().problems)),
    ],
)
def test_problems_are_named_by_domain_size_or_both(names: list[str], problems: set[tuple[str, int]]) -> None:
    """No name means all of them."""
    assert set(narrowed(Selection(), problems=names).problems) == problems


def test_strategies_and_seeds_can_be_chosen() -> None:
    """A strategy asked for by name is run in all sizes asked for, quick or not."""
    chosen = narrowed(quick(), strategies=["clo", "replan-unified-planning"], seeds=1, problems=["rooms/p-10"])
    assert {(run.size, run.strategy, run.seed) for run in runs(chosen)} == {(10, "clo", 0), (10, "replan", 0)}


@pytest.mark.parametrize(("problems", "strategies"), [(["p-06"], []), (["kitchen"], []), ([], ["guess"])])
def test_unknown_names_are_refused_with_those_that_there_are(problems: list[str], strategies: list[str]) -> None:
    """The error says what would be right."""
    with pytest.raises(UnknownNameError, match=r"expected one of .*(p-05|clo)") as caught:
        narrowed(Selection(), problems=problems, strategies=strategies)
    assert caught.value.name == (*problems, *strategies)[0]
