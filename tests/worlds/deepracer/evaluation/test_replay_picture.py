"""Which episode and which windows the picture shows, by hand."""

from types import SimpleNamespace

import numpy as np

from racecraft.worlds.deepracer.evaluation import replay_picture
from racecraft.worlds.deepracer.evaluation.replay_picture import driven_paths, longest_episode, replay_figure
from racecraft.worlds.deepracer.files.sim_trace import SimTrace


def file_of(progress, begins, first=(), ticks=()):
    rows = len(progress)
    flags = np.zeros(rows, bool)
    flags[list(begins)] = True
    windows = SimpleNamespace(
        first=np.array(first, int), ticks=np.array(ticks, int),
        paths=np.arange(len(first) * 48.0).reshape(len(first), 16, 3),
    )  # fmt: skip
    columns = {
        "episode": flags, "progress": np.array(progress, float), "X": np.arange(rows), "Y": np.zeros(rows),
        "throttle": np.ones(rows),
    }  # fmt: skip
    return SimpleNamespace(trace=SimTrace(columns), retold=SimpleNamespace(begins=flags), windows=windows)


def test_the_episode_that_came_furthest_is_shown_though_it_ended_behind():
    one = file_of([0, 30, 10, 0, 20], [0, 3])
    other = file_of([0, 5, 0, 31, 90], [0, 2, 4])
    assert longest_episode(SimpleNamespace(files=[one, other])) == (other, slice(2, 4)), "a row alone is no way"
    assert longest_episode(SimpleNamespace(files=[one])) == (one, slice(0, 3))
    still = file_of([0, 0], [0])
    assert longest_episode(SimpleNamespace(files=[still])) == (still, slice(0, 2))
    alone = file_of([50], [0])
    assert longest_episode(SimpleNamespace(files=[alone, still])) == (still, slice(0, 2))
    assert longest_episode(SimpleNamespace(files=[alone])) == (alone, slice(0, 1))
    same = file_of([0, 30, 10], [0])
    assert longest_episode(SimpleNamespace(files=[one, same]))[0] is one, "of equals the first"


def test_windows_that_follow_one_another_are_drawn():
    """A second is fifteen ticks; the next begins where the one before ended, or later, and none outside the rows."""
    file = file_of([0] * 60, [0], first=[4, 5, 10, 20, 34, 35, 49, 50], ticks=[15, 15, 15, 15, 15, 8, 15, 15])
    paths = driven_paths(file, slice(5, 50))
    assert [len(path) for path in paths] == [16, 16, 9]
    assert [path[0].tolist() for path in paths] == [file.windows.paths[k, 0, :2].tolist() for k in (1, 3, 5)]
    assert all(path.shape[1] == 2 for path in paths)
    assert driven_paths(file, slice(50, 60))[0][0].tolist() == file.windows.paths[7, 0, :2].tolist()


def test_the_recorded_path_is_painted_by_speed_and_ours_over_it(monkeypatch):
    drawn = []
    monkeypatch.setattr(replay_picture, "draw_track", lambda *told, **how: drawn.append((told, how)) or "a figure")
    file = file_of([0, 10, 20, 0], [0, 3], first=[1], ticks=[1])
    report = SimpleNamespace(files=[file], car="v4", track="the track")
    assert replay_figure(report) == "a figure"
    ((told, how),) = drawn
    assert told == ("the track", None)
    logged, driven = how["paths"]
    assert logged.xy.tolist() == [[0, 0], [1, 0], [2, 0]]
    assert len(driven.xy) == 2
    assert how["title"] == "Recorded, and driven again by v4 one second at a time"
