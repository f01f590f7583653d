"""Lines near a point are found by their distance, not by their ends."""

from clo_fleet.sim.nearby import Nearby

LINES = {"far": [(0.0, 9.0), (9.0, 9.0)], "by": [(-5.0, 1.0), (5.0, 1.0)], "at": [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0)]}


def test_lines_within_a_distance_are_found_in_order() -> None:
    """Also those whose ends are far away; the same again when asked again."""
    nearby = Nearby(LINES)
    for _ in range(2):
        assert nearby.names((0.0, 0.0), 1.0) == ("at", "by")
        assert nearby.names((0.0, 0.0), 0.5) == ("at",)
        assert nearby.names((0.0, 0.0), 9.0) == ("at", "by", "far")
    assert nearby.names((50.0, 50.0), 1.0) == ()
