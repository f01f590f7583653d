"""What robots count on when messages can be lost."""

import json
from dataclasses import replace

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.plan import number
from clo_fleet.clo.task import Action, Fact
from clo_fleet.fleet.announcements import Announcement
from clo_fleet.fleet.hearsay import Hearsay
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.model import ObjectId, Radio, RobotId
from clo_fleet.world.vocabulary import Names, Vocabulary

R1, R2, R3 = RobotId("r1"), RobotId("r2"), RobotId("r3")
AT_L1: Fact = ("at-object", "cup", "l1")
AT_L2: Fact = ("at-object", "cup", "l2")
WORDS = Vocabulary(fleet_binding(), Names(robots=("r1", "r2", "r3"), objects=("cup",), rooms=("l1", "l2")))
LOSSY = Radio(loss=0.2, repeat=5.0, promise=20.0)


def held(robot: str) -> Fact:
    """The cup in the robot's hand."""
    return ("holding", robot, "cup")


def delivering(robot: RobotId) -> Announcement:
    """A robot with the cup in hand that is about to put it down in l1."""
    place = Action(schema="place", args=(), needs=(), adds=frozenset({AT_L1}), deletes=frozenset({held(robot)}))
    return Announcement(
        robot=robot,
        place="l1",
        plan=number([place]),
        moving=False,
        goals=(),
        beliefs=frozenset(),
        in_hand=(ObjectId("cup"),),
    )


def idle(robot: RobotId) -> Announcement:
    """The same robot with nothing left to do."""
    return replace(delivering(robot), plan=(), in_hand=())


def test_a_promise_counts_until_nothing_has_been_heard_of_it_for_a_while() -> None:
    """Repeated it goes on counting; unheard it lapses once, and counts again when it is heard again."""
    hearsay = Hearsay(LOSSY, WORDS)
    hearsay.heard(R1, delivering(R2), 0.0)
    assert hearsay.promised(R1, 0.0) == {AT_L1}
    hearsay.heard(R1, delivering(R2), 15.0)
    assert hearsay.lapsed(34.8) == ()
    assert hearsay.lapsed(35.0) == (R1,)
    assert hearsay.promised(R1, 35.0) == frozenset()
    assert hearsay.lapsed(40.0) == ()
    hearsay.heard(R1, delivering(R2), 50.0)
    assert hearsay.promised(R1, 50.0) == {AT_L1}
    assert hearsay.known(R1, R2) == delivering(R2)
    assert hearsay.known(R1, R3) is None


def test_nothing_lapses_and_nobody_repeats_when_every_message_arrives() -> None:
    """A delay alone changes nothing about that."""
    hearsay = Hearsay(Radio(delay=3.0), WORDS)
    hearsay.say(delivering(R2), 0.0)
    hearsay.heard(R1, delivering(R2), 3.0)
    assert hearsay.promised(R1, 900.0) == {AT_L1}
    assert hearsay.lapsed(900.0) == ()
    assert hearsay.to_repeat(900.0) == ()


def test_robots_repeat_what_they_last_said_and_did() -> None:
    """Not before it is time, and with all their deeds, the last of each object."""
    hearsay = Hearsay(LOSSY, WORDS)
    hearsay.say(delivering(R2), 1.0)
    assert hearsay.to_repeat(5.8) == ()
    hearsay.did(R2, [Flip(AT_L2, True), Flip(held("r2"), False)], 2.0)
    hearsay.did(R2, [Flip(held("r2"), True), Flip(AT_L2, False)], 4.0)
    (said,) = hearsay.to_repeat(6.0)
    (deed,) = hearsay.say(said, 6.0).deeds
    assert deed.time == 4.0
    assert {(flip.fact, flip.value) for flip in deed.flips} == {(held("r2"), True), (AT_L2, False)}
    assert hearsay.to_repeat(10.8) == ()


def test_of_what_several_robots_did_the_latest_counts() -> None:
    """Whoever says it last; and what the listener knows better itself it does not believe."""
    hearsay = Hearsay(LOSSY, WORDS)
    hearsay.did(R2, [Flip(AT_L1, True)], 10.0)
    hearsay.did(R3, [Flip(held("r3"), True)], 20.0)
    for robot in (R3, R2):
        hearsay.heard(R1, hearsay.say(idle(robot), 30.0), 30.0)
    assert hearsay.news(R1) == (Flip(held("r3"), True),)
    hearsay.learnt(R1, [AT_L2], 25.0)
    assert hearsay.news(R1) == ()


def test_late_news_of_what_one_knows_better_is_no_news() -> None:
    """A message that was sent before the listener saw for itself is not believed."""
    hearsay = Hearsay(Radio(delay=5.0), WORDS)
    hearsay.learnt(R1, [held("r1")], 4.0)
    flips = [Flip(AT_L1, True), Flip(("prepared", "cup"), True)]
    assert hearsay.fresh(R1, flips, 3.0) == flips[1:]
    assert hearsay.fresh(R1, flips, 4.0) == flips


def test_hearsay_survives_being_saved() -> None:
    """Restored from plain data it says, counts and knows the same."""
    hearsay = Hearsay(LOSSY, WORDS)
    hearsay.did(R2, [Flip(AT_L1, True)], 10.0)
    hearsay.heard(R1, hearsay.say(delivering(R2), 12.0), 12.0)
    hearsay.learnt(R1, [AT_L2], 5.0)
    hearsay.promised(R1, 12.0)
    other = Hearsay(LOSSY, WORDS)
    other.restore(json.loads(json.dumps(hearsay.state())))
    assert other.state() == hearsay.state()
    for each in (hearsay, other):
        assert each.lapsed(32.0) == (R1,)
        assert each.news(R1) == (Flip(AT_L1, True),)
        assert [said.robot for said in each.to_repeat(17.0)] == [R2]
        assert each.said(R2) == delivering(R2)
        assert each.said(R3) is None
        assert each.known(R1, R2) == delivering(R2)


def test_with_a_perfect_radio_one_book_serves_for_all() -> None:
    """What is said is known and counts at once, to everybody but who said it; also after a save."""
    hearsay = Hearsay(Radio(), WORDS)
    hearsay.say(delivering(R2), 0.0)
    other = Hearsay(Radio(), WORDS)
    other.restore(json.loads(json.dumps(hearsay.state())))
    for each in (hearsay, other):
        assert each.known(R1, R2) == delivering(R2)
        assert each.promised(R1, 900.0) == each.promises_of(R2) == {AT_L1}
        assert each.promised(R2, 900.0) == frozenset()
        assert each.sayings(R1) == (delivering(R2),)
        assert each.sayings(R2) == Hearsay(LOSSY, WORDS).sayings(R1) == ()
        assert each.to_say_again(R1) == Hearsay(LOSSY, WORDS).to_say_again(R1) == ()
        assert each.heard(R1, delivering(R2), 0.0)
        each.say(idle(R2), 1.0)
        assert each.promised(R1, 1.0) == frozenset()


def test_with_a_slow_radio_that_loses_nothing_what_was_said_is_said_again_to_who_could_not_hear_it() -> None:
    """By the others, as they do not repeat it by themselves."""
    hearsay = Hearsay(Radio(delay=0.5), WORDS)
    hearsay.say(delivering(R2), 0.0)
    assert hearsay.to_repeat(900.0) == ()
    assert hearsay.to_say_again(R1) == (delivering(R2),)
    assert hearsay.to_say_again(R2) == ()


def test_nobody_counts_for_long_on_what_was_said_before_its_radio_failed() -> None:
    """The time begins anew with each failure; saved in between, it goes on."""
    hearsay = Hearsay(Radio(promise=20.0), WORDS)
    assert hearsay.cut_off({R1}, 5.0) == hearsay.cut_off({R1}, 24.8) == ()
    again = Hearsay(Radio(promise=20.0), WORDS)
    again.restore(json.loads(json.dumps(hearsay.state())))
    for each in (hearsay, again):
        assert each.cut_off({R1, R2}, 25.0) == (R1,)
        assert each.cut_off((), 25.2) == each.cut_off({R1}, 25.4) == ()
