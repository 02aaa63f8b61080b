"""Which random motions a search begins with, and which of its climbs go on."""

from dataclasses import replace

import numpy as np
import pytest

from scripts.design_parts.robots import unlogged
from sysid.design import search
from sysid.design.fourier import Fourier
from sysid.design.maneuvers import Maneuver
from sysid.design.problem import drawn
from sysid.design.solve import Climb, Found
from sysid.errors import SysidWarning

LADDER = (Maneuver("ladder", 6.0, 4.0, (0,), 1.0),)


def _found(value, rounds, maneuvers=()):
    return Found(Fourier(10.0, 5, rounds, 1, maneuvers), np.full((1, 9), value), value)


def test_a_search_begins_with_the_best_of_each_number_of_rounds():
    starts = [_found(value, rounds) for rounds in (1, 2) for value in (3.0 * rounds, 2.0, 9.0 - rounds, 0.5)]
    chosen = search.promising(starts)
    assert [(one.family.rounds, one.value) for one in chosen] == [(1, 8.0), (2, 7.0), (2, 6.0), (1, 3.0)]
    # maneuvers tell little until they have found their sizes: where they are asked for, two of each begin, however small
    chosen = search.promising([*starts, *(_found(value, 2, LADDER) for value in (-5.0, -4.0, -6.0))])
    assert [one.value for one in chosen] == [8.0, 7.0, -4.0, -5.0]
    assert search.promising([]) == []


def test_those_that_are_behind_go_no_further(monkeypatch):
    """Eight climbs of known curves: what is worth most in the end leads from the second slice on."""
    gains = np.array([1.0, 5.0, 2.0, 4.0, 3.0, 0.5, 0.1, 0.2, 0.3])  # the last one has maneuvers
    done = np.zeros(len(gains), dtype=int)

    def climbed(problem, climb, steps):
        k = int(climb.z[0, 0])
        done[k] += 1
        return replace(climb, merit=gains[k] * done[k], stage=4 if done[k] == 6 else 0)

    monkeypatch.setattr(search.solve, "climbed", climbed)
    own = Fourier(10.0, 5, 1, 1)
    climbs = [Climb(replace(own, maneuvers=LADDER if k == 8 else ()), np.full((1, 9), float(k))) for k in range(9)]
    counts = [[int(climb.z[0, 0]) for climb in left] for left in search.raced(None, climbs, 1)]
    assert counts[0] == [1, 3, 4, 2, 8] and counts[1] == [1, 3, 8] and counts[2] == counts[-1] == [1, 8]
    assert done.tolist() == [1, 6, 2, 3, 2, 1, 1, 1, 6]
    assert list(search.raced(None, [], 1)) == []


def test_a_pose_in_which_links_touch_is_drawn_anew():
    """Of a UR5 two of three poses are none that a motion may be about; every start has another."""
    with pytest.warns(SysidWarning, match="there is no log yet"):
        own, pose, _ = unlogged("ur5")
    limits, first = own.limits, []
    for k in range(4):
        found = search.start(own, pose, (0, 1, k))
        assert np.isfinite(found.value) and own.geometry.least(found.z[None, :, 0]) > limits.clearance
        first.append(drawn(own, pose, np.random.default_rng((0, 1, k)))[:, 0])
    near = own.geometry.least(np.array(first)) < limits.clearance
    assert near.any() and not near.all()
