"""How late an event loop looks at what happens, and when a request's first bytes were really there."""

import asyncio

import pytest

from racecraft.serving import loop_lag
from racecraft.serving.loop_lag import LoopLag


class Loop:
    """A loop whose clock stands where it is put, and that calls nobody by itself."""

    def __init__(self):
        self.now, self.waiting, self.cancelled = 100.0, [], 0

    def time(self):
        return self.now

    def call_at(self, due, act, *words):
        self.waiting.append((due, act, words))
        return self

    def cancel(self):
        self.cancelled += 1

    def come_to(self, now):
        _, act, words = self.waiting.pop()
        self.now = now
        act(*words)


def test_the_worst_of_the_last_moments_counts_and_fades(monkeypatch):
    loop, lag = Loop(), LoopLag()
    monkeypatch.setattr(asyncio, "get_running_loop", lambda: loop)
    lag.watch()
    assert loop.waiting[0][0] == 100.0 + loop_lag.SECONDS_BETWEEN_LOOKS
    loop.come_to(100.0 + loop_lag.SECONDS_BETWEEN_LOOKS + 0.3)
    assert lag.seconds == pytest.approx(0.3)
    loop.come_to(loop.waiting[0][0])
    assert lag.seconds == pytest.approx(0.3 * loop_lag.FADING)
    loop.come_to(loop.waiting[0][0] + 0.5)
    assert lag.seconds == pytest.approx(0.5)
    loop.come_to(loop.waiting[0][0] - 0.001)  # some clocks wake up a little early
    assert lag.seconds == pytest.approx(0.5 * loop_lag.FADING)
    lag.close()
    assert (loop.cancelled, len(loop.waiting)) == (1, 1)


def test_one_hiccup_is_no_lasting_lateness_and_a_second_of_it_is():
    lag = LoopLag()
    lag.note(1.0)
    assert lag.lasting_seconds < 0.05
    for _ in range(50):
        lag.note(1.0)
    assert 0.5 < lag.lasting_seconds < 1.0
