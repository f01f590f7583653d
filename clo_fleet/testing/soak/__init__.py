"""Soaking: random worlds with random faults, each run under a witness, in a process with limits.

Every run has to end in a named outcome, in time, with every invariant whole in every tick; what does not is kept as a
world file that ``clo-fleet run`` plays again. ``make soak`` runs hundreds, ``python -m clo_fleet.testing.soak`` as many
as one likes.
"""

from clo_fleet.testing.soak.running import Limits, soak
from clo_fleet.testing.soak.verdict import Ending, Verdict
from clo_fleet.testing.soak.worlds import SoakWorld, write_soak_world

__all__ = ["Ending", "Limits", "SoakWorld", "Verdict", "soak", "write_soak_world"]
