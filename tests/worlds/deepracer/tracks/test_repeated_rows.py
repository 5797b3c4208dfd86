"""Rows that a route file repeats: left out of the geometry, counted as waypoints where one wishes."""

import numpy as np
import pytest

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.settings import RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names, summary
from racecraft.worlds.deepracer.tracks.picture import draw_track
from racecraft.worlds.deepracer.tracks.track import Track

ACTIONS = ActionTable.of([(0.2, 1.0), (-0.2, 1.0)])


def ring(repeat=None, rows=40):
    angle = np.linspace(0.0, 2.0 * np.pi, rows)
    table = np.hstack([np.column_stack([np.cos(angle), np.sin(angle)]) * radius for radius in (3.0, 2.6, 3.4)])
    table[-1] = table[0]
    return table if repeat is None else np.insert(table, repeat, table[repeat - 1], axis=0)


@pytest.mark.parametrize("repeat", [1, 7, 39])
def test_a_repeated_row_is_remembered_and_comes_back(repeat):
    table = ring(repeat)
    track = Track.from_rows("ring", table)
    assert track.repeated_rows == (repeat,)
    assert len(track.centre) == 40
    assert (track.as_filed().rows == table).all()
    assert (track.reversed().as_filed().rows == table[::-1]).all()
    assert track.reversed().reversed().repeated_rows == track.repeated_rows


def test_the_files_rows_are_found_among_ours_and_told_by_the_files_count():
    """By hand: the file's row 7 repeats its row 6; ours number 6 is both, ours number 7 the file's 8."""
    track = Track.from_rows("ring", ring(7))
    assert track.of_filed_rows().tolist() == [*range(7), *range(6, 40)]
    assert summary("Spain_track").rows == 259
    assert summary("reinvent_base").rows == len(load_track("reinvent_base").centre)


def test_a_picture_numbers_waypoints_as_a_reward_is_handed_them(tmp_path, monkeypatch):
    """Each tenth row of the file has a dot and its number, though Spain_track's row 18 is 17 again."""
    track, dots, numbers = load_track("Spain_track"), [], []
    monkeypatch.setattr("matplotlib.axes.Axes.scatter", lambda _, x, y, **__: dots.extend(zip(x, y, strict=True)))
    monkeypatch.setattr("matplotlib.axes.Axes.text", lambda _, x, y, text, **__: numbers.append(text))
    draw_track(track, tmp_path / "spain.png", number_every=10)
    assert np.array(dots).tolist() == track.as_filed().centre[: 10 * len(dots) : 10].tolist()
    assert len(dots) >= 25
    told = [int(text) for text in numbers if text.isdigit()]
    assert len(told) > 12
    assert set(told) <= set(range(0, 260, 10))


def test_fifty_nine_of_the_catalogues_tracks_repeat_one_row():
    repeated = {name: load_track(name).repeated_rows for name in names()}
    assert sum(len(rows) == 1 for rows in repeated.values()) == 59
    assert max(len(rows) for rows in repeated.values()) == 1
    assert repeated["Spain_track"] == (18,)


def raced(waypoints, reverse=False, ticks=40):
    """Drive two cars on Spain_track; return what their rewards were handed and what was reported."""
    handed = []
    world = RaceWorld(
        load_track("Spain_track"),
        ACTIONS,
        lambda params: float(handed.append(params) or 0.0),
        race_config=RaceConfig(waypoints=waypoints, reverse=reverse),
        num_cars=2,
        start_shares=[0.05, 0.93],
    )
    buffers = allocate(world.spec)
    world.reset(buffers, seed=0)
    reports = []
    for tick in range(ticks):
        world.step(np.full((2, 1), (tick // 3) % 2), buffers)
        reports.append(world.reports.copy())
    return handed, np.stack(reports), buffers


@pytest.mark.parametrize("reverse", [False, True])
def test_waypoints_after_the_repeated_row_count_one_more(reverse):
    """The 259 rows of Spain_track's file are 258 places; everything but the numbers stays, to the last bit."""
    filed, filed_reports, filed_buffers = raced("as_filed", reverse)
    distinct, reports, buffers = raced("distinct", reverse)
    repeated = 259 - 18 if reverse else 18
    assert (len(filed[0]["waypoints"]), len(distinct[0]["waypoints"])) == (259, 258)
    shifted = 0
    for ours, other in zip(filed, distinct, strict=True):
        for side in range(2):
            number, plain = ours["closest_waypoints"][side], other["closest_waypoints"][side]
            assert ours["waypoints"][number] == other["waypoints"][plain]
            assert number - plain == (plain >= repeated or (plain == repeated - 1 and side == 0))
            shifted += number != plain
        same = set(ours) - {"waypoints", "closest_waypoints"}
        assert {key: ours[key] for key in same} == {key: other[key] for key in same}
    assert 0 < shifted < 2 * len(filed)
    nearest, plain = filed_reports["waypoint_nearest"], reports["waypoint_nearest"]
    assert ((nearest - plain == 1) | (nearest == plain)).all()
    assert (nearest != plain).any()
    for key, seen in filed_buffers.observations.items():
        assert (seen == buffers.observations[key]).all(), key
