"""Few cars are moved by one thread."""

from racecraft.worlds.deepracer.env import numba_threads


def test_threads_that_are_not_worth_waking_sleep(monkeypatch):
    now = [4]
    monkeypatch.setattr(numba_threads, "threads", lambda: now[0])
    monkeypatch.setattr(numba_threads, "set_threads", lambda count: now.__setitem__(0, max(1, count)))
    seen = []
    for count in (0, 1, 3, 4, 9):
        with numba_threads.at_most(count):
            seen.append(now[0])
        assert now[0] == 4
    assert seen == [1, 1, 3, 4, 4]
