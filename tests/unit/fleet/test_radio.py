"""The radio tells who is in range, after a while, most of the time, and the same way again."""

import json

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.fleet.radio import Listener, RadioChannel
from clo_fleet.world.model import Radio, RobotId

A, B, C = (Listener(RobotId(name), (x, 0.0)) for name, x in (("a", 0.0), ("b", 5.0), ("c", 50.0)))
NEWS = (Flip(("prepared", "o1"), True, Cause("a", "prepare(a, o1, l1)", 7)),)


def test_others_in_range_hear_once_and_after_the_delay() -> None:
    """Not the sender, not who is too far, not before the delay is over, and not twice."""
    channel = RadioChannel(Radio(range=10.0, delay=1.0), seed=0)
    channel.tell(2.0, A, NEWS, (A, B, C))
    assert channel.due(2.8) == {}
    assert channel.due(3.0) == {"b": list(NEWS)}
    assert channel.due(4.0) == {}


def test_silent_radio_tells_nothing() -> None:
    """Where facts are not passed on, nobody hears any."""
    channel = RadioChannel(Radio(facts=False), seed=0)
    channel.tell(0.0, A, NEWS, (A, B, C))
    assert channel.due(9.0) == {}


def test_what_is_lost_depends_on_the_seed_alone() -> None:
    """About the given share is lost; the same seed loses the same messages, another seed others."""

    def heard(seed: int) -> list[int]:
        channel = RadioChannel(Radio(loss=0.3), seed=seed)
        arrived = []
        for number in range(300):
            channel.tell(number, A, NEWS, (B,))
            arrived += [number] * bool(channel.due(number))
        return arrived

    assert heard(1) == heard(1)
    assert heard(1) != heard(2)
    assert 180 <= len(heard(1)) <= 240


def test_messages_under_way_survive_being_saved() -> None:
    """A channel restored from plain data delivers what the first one had in the air."""
    channel = RadioChannel(Radio(delay=5.0), seed=0)
    channel.tell(0.0, A, NEWS, (B,))
    other = RadioChannel(Radio(delay=5.0), seed=0)
    other.restore(json.loads(json.dumps(channel.state())))
    assert other.due(5.0) == {"b": list(NEWS)}
