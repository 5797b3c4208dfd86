"""How much the length of the original's steps varies, computed from real logs; it is the figure that we emulate."""

import numpy as np
import pytest
from tests.reference import HAS_ALL, LARGE, TRACES

from racecraft.worlds.deepracer.env.fidelity import TICK_JITTER
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace

SETTLED_ROWS = 12
"""A car that has been told one speed for so many rows drives it."""


def ways_in_a_row(folder):
    """Return pairs of ways between neighbouring rows, as shares of commanded speed times a tick, float (P, 2)."""
    pairs = []
    for path in sorted(folder.rglob("*.csv")):
        columns = read_sim_trace(path).columns
        for episode in np.unique(columns["episode"]):
            x, y, told = (columns[name][columns["episode"] == episode] for name in ("X", "Y", "throttle"))
            way = np.hypot(np.diff(x), np.diff(y))
            for i in range(SETTLED_ROWS, len(way) - 1):
                if np.ptp(told[i - SETTLED_ROWS : i + 2]) == 0.0:
                    pairs.append(way[i : i + 2] / (told[i] * TICK_SECONDS))
    return np.array(pairs)


@pytest.mark.parametrize("log", ["console-2022", "drfc-1-worker"])
def test_the_length_of_a_tick_strays_as_in_the_logs_of_2022(log):
    """A pose read early or late adds to one way what it takes from the next; what is left over is the ticks' own."""
    if log == "console-2022" and not HAS_ALL:
        pytest.skip(LARGE)
    pairs = ways_in_a_row(TRACES / log)
    assert len(pairs) > 500
    (spread, between), _ = np.cov(pairs.T)
    assert between < 0
    own = np.sqrt(spread + 2.0 * between)
    assert own == pytest.approx(TICK_JITTER / np.sqrt(3.0), abs=0.006)
