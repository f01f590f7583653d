"""Who helped whom, read off a log."""

from clo_fleet.clo.task import Fact
from clo_fleet.study.event_log import Recorded
from clo_fleet.study.metrics import helps
from clo_fleet.world.events import ActionCalledOff, ActionEnded, ActionStarted, Event, StepsLeftOut

CUP: Fact = ("at-object", "cup", "b")
PUT = ActionStarted("r2", 4, "place(r2, cup, b)")
CALLED_OFF = ActionCalledOff("r1", 0, "move(r1, b, a)", "nothing that is left needs it", CUP, "r2", 0)
LEFT_OUT = StepsLeftOut("r1", ((1, "grasp(r1, cup, a)"),), "nothing that is left needs it", CUP, "r2", 0)


def log(*events: Event) -> list[Recorded]:
    """r2 puts the cup down at time 0; the rest happens at time 1."""
    return [(0, 0.0, PUT), *((number, 1.0, event) for number, event in enumerate(events, start=1))]


def ended(ending: str) -> ActionEnded:
    """How the drive that was called off ended."""
    return ActionEnded("r1", 0, "move(r1, b, a)", ending, "", 0)


def test_an_action_that_was_stopped_for_anothers_sake_is_a_help() -> None:
    """By whose action and by which fact is known."""
    (help_,) = helps(log(CALLED_OFF, ended("cancelled")))
    assert (help_.by, help_.robot, help_.fact) == ("r2", "r1", "(at-object cup b)")
    assert (help_.kind, help_.action, help_.dropped) == ("delivered", "place(r2, cup, b)", ("move(r1, b, a)",))


def test_what_one_fact_spares_at_one_moment_is_one_help() -> None:
    """The action under way comes first."""
    both = ("move(r1, b, a)", "grasp(r1, cup, a)")
    assert [help_.dropped for help_ in helps(log(CALLED_OFF, LEFT_OUT, ended("cancelled")))] == [both]


def test_an_action_that_could_not_be_stopped_any_more_is_none() -> None:
    """It was called off and came to its end all the same, or has not ended yet."""
    assert helps(log(CALLED_OFF, ended("finished"))) == ()
    assert [help_.dropped for help_ in helps(log(CALLED_OFF, LEFT_OUT))] == [("grasp(r1, cup, a)",)]


def test_what_nobody_or_the_robot_itself_did_is_none() -> None:
    """Nor is what became needless without a fact."""
    alone = ActionCalledOff("r1", 0, "move(r1, b, a)", "the goals hold already", None, None, None)
    by_nobody = StepsLeftOut("r1", ((1, "grasp(r1, cup, a)"),), "", CUP, None, None)
    by_itself = StepsLeftOut("r1", ((1, "grasp(r1, cup, a)"),), "", CUP, "r1", 0)
    assert helps(log(alone, ended("cancelled"), by_nobody, by_itself)) == ()
