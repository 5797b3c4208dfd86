"""Laps driven at known speeds: times, sectors and traces are computed from the speeds."""

from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from tests.reference import TRACES
from tests.worlds.deepracer.driving.telemetry.stadium import LENGTH_M, as_log, drive, stadium

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.analysis.logs import find_track, sector_times, simulation_agg
from racecraft.worlds.deepracer.driving.telemetry.filters import LapOptions
from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
from racecraft.worlds.deepracer.driving.telemetry.timing import time_laps
from racecraft.worlds.deepracer.logs import read

TICK = 1 / 15


def by_thirds(arc):
    """Return 1, 2 and 4 m/s in the thirds of the lap."""
    return np.array([1.0, 2.0, 4.0])[np.minimum((3 * arc / LENGTH_M).astype(int), 2)]


@pytest.mark.parametrize("begin_m", [0.0, 5.0, 13.0])
def test_sector_times_are_length_over_speed_wherever_the_lap_began(begin_m):
    laps = find_laps(as_log([drive(by_thirds, begin_m)]), stadium())
    timing = time_laps(laps)
    assert timing.sector_seconds[0] == pytest.approx(LENGTH_M / 3 / np.array([1.0, 2.0, 4.0]), abs=0.04)
    assert timing.sector_seconds.sum() == pytest.approx(laps.lap_seconds[0], abs=1e-9)
    inside = (laps.shares > 0.4) & (laps.shares < 0.6)
    assert np.nanmean(laps.speed_mps[0, inside]) == pytest.approx(2.0, rel=0.01)


def test_offset_is_left_positive_and_shortens_a_left_hand_lap():
    laps = find_laps(as_log([drive(by_thirds)], offset_m=0.1), stadium())
    assert laps.offset_m[0] == pytest.approx(np.full(laps.pieces, 0.1), abs=0.01)
    assert laps.metres[0].sum() == pytest.approx(LENGTH_M - 2 * np.pi * 0.1, abs=0.15)


def test_a_lap_that_was_not_finished_is_none():
    log = as_log([drive(by_thirds), drive(by_thirds)])
    half = log.filter((pl.col("unique_episode") == 0) | (pl.col("progress_share") < 0.5))
    laps = find_laps(half, stadium())
    assert (len(laps), laps.episodes) == (1, 2)


def test_laps_of_one_drive_are_timed_from_the_end_of_the_one_before():
    log = as_log([drive(by_thirds), drive(by_thirds)], phase="evaluation")
    ends = log.filter(pl.col("unique_episode") == 0)["time_s"].max()
    second = pl.col("unique_episode") == 1
    driving = pl.lit("in_progress", log["status"].dtype)
    rolling = log.with_columns(
        time_s=pl.when(second).then(pl.col("time_s") - 100.0 + ends).otherwise("time_s"),
        status=pl.when(second & (pl.col("status") == "prepare")).then(driving).otherwise("status"),
    )
    laps = find_laps(rolling, stadium())
    assert laps.about["from_rest"].to_list() == [True, False]
    assert laps.gathering.any(axis=1).tolist() == [True, False]
    assert laps.lap_seconds == pytest.approx(np.full(2, LENGTH_M / 3 * 1.75), abs=TICK)


def test_the_laps_of_aws_logs_are_those_of_the_log_analysis():
    log = read(TRACES / "drfc-1-worker")
    ticks = log.require_ticks()
    track = find_track(ticks, "reinvent_base")
    laps, episodes = find_laps(ticks, track), simulation_agg(ticks)
    full = episodes.filter("complete")
    assert laps.about["unique_episode"].to_list() == full["unique_episode"].to_list()
    assert laps.lap_seconds == pytest.approx(full["seconds"].to_numpy(), abs=1e-9)
    theirs = sector_times(ticks, track, parts=3).data["seconds"].to_numpy().reshape(-1, 3)
    training = (laps.about["phase"] == "training").to_numpy()  # it times no lap that goes on from the one before
    assert np.abs(time_laps(laps).sector_seconds - theirs)[training].max() < 1.6 * TICK
    chosen = [LapOptions(future_at="57=10", discount=one).rows(laps, log).tolist() for one in (None, 0.95, 0.9)]
    assert chosen[0] == chosen[1] != chosen[2], "the discount is that of its hyperparameters.json"


def test_a_section_is_timed_between_waypoints_and_over_the_start_line():
    laps = find_laps(as_log([drive(by_thirds), drive(lambda arc: by_thirds(arc) * 1.1)]), stadium())
    sixth = LENGTH_M / 6 / 0.02  # waypoints stand 0.02 m apart
    for first, last, seconds in (
        (sixth, 2 * sixth, LENGTH_M / 6 / 1.0), (5 * sixth, sixth, LENGTH_M / 6 / 4.0 + LENGTH_M / 6 / 1.0)
    ):  # fmt: skip
        for limit, expected in ((1.05 * seconds, [0, 1]), (0.95 * seconds, [1]), (0.85 * seconds, [])):
            assert LapOptions(section=f"{round(first)}..{round(last)}={limit}").rows(laps).tolist() == expected
    with pytest.raises(SettingError, match="9999"):
        LapOptions(section="0..9999=1.0").rows(laps)


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ({"at": "314=2.1"}, [1]),  # waypoints stand 0.02 m apart: 314 and 650 are on straights, at 2 and at 4 m/s
        ({"at": "650=..4.2"}, [0]),
        ({"at": "650=3.5..4.2"}, [0]),
        ({"reward_at": "314=1.5"}, [1]),
        ({"future_at": "650=7", "discount": 1.0}, [1]),  # five or six ticks are to come, of 1 and of 2
        ({"future_at": "314=3", "discount": 0.5}, [1]),  # many ticks: 1 / (1 - 0.5) times the reward
        ({"printed": "slow"}, [1]),
        ({"printed": "begun"}, []),
        ({"at": "314=left"}, [0]),
        ({"actions": "1,2"}, [0]),
    ],
)
def test_laps_are_chosen_by_what_the_car_does_somewhere(condition, expected):
    """Two laps, the second a tenth faster; one left of the centre line, choosing 1 and then 2, the other reversed."""
    one = as_log([drive(by_thirds)] * 2, offset_m=0.1).filter(pl.col("unique_episode") == 0)
    two = as_log([drive(lambda arc: by_thirds(arc) * 1.1)] * 2, offset_m=-0.1).filter(pl.col("unique_episode") == 1)
    late = (pl.col("progress_share") > 0.5) == (pl.col("unique_episode") == 0)
    ticks = pl.concat([one, two]).with_columns(
        action=pl.when(late).then(2).otherwise(1).cast(pl.Int32), reward=1.0 + pl.col("unique_episode")
    )
    printed = {"slow": [one.height + 20], "begun": [one.height]}  # a lap's first row is paid for what was before
    log = SimpleNamespace(printed=lambda text: np.array(printed[text]), about={})
    assert LapOptions(**condition).rows(find_laps(ticks, stadium()), log).tolist() == expected


@pytest.mark.parametrize(("condition", "words"), [
    ({"at": "57=3..2"}, "--at is '57=3..2'; expected the smaller number first"),
    ({"reward_at": "999=1"}, "--reward-at: stadium has no waypoint 999"),
    ({"future_at": "57=1"}, "expected --discount beside it"),
    ({"printed": "slow"}, "Traces hold no prints"),
])  # fmt: skip
def test_what_no_lap_can_have_is_refused_by_name(condition, words):
    laps = find_laps(as_log([drive(by_thirds)]), stadium())
    with pytest.raises(SettingError, match=words):
        LapOptions(**condition).rows(laps)


def test_a_slide_is_the_angle_between_heading_and_path():
    along = pl.arctan2(pl.col("y_m").diff(), pl.col("x_m").diff()).fill_null(0.0)
    turned = pl.when(pl.col("unique_episode") == 1).then(along + 0.3).otherwise(along)
    laps = find_laps(as_log([drive(by_thirds)] * 2).with_columns(yaw_rad=turned), stadium())
    straight, sliding = laps.about["max_slide_rad"]
    assert (straight, sliding) == (pytest.approx(0.0, abs=1e-6), pytest.approx(0.3, abs=1e-6))
    assert LapOptions(slide=np.degrees(0.2)).rows(laps).tolist() == [0]


def test_filters_choose_what_they_say():
    speeds = [lambda arc, k=k: np.full_like(arc, 2.0 + 0.1 * k) for k in range(8)]
    begins = [0.0, 5.0] * 4
    laps = find_laps(as_log([drive(*one) for one in zip(speeds, begins, strict=True)]), stadium())
    assert LapOptions(begins="line").rows(laps).tolist() == [0, 2, 4, 6]
    assert LapOptions(begins="flying").rows(laps).tolist() == []
    assert LapOptions(iterations="1..2").rows(laps).tolist() == [2, 3, 4, 5]
    assert LapOptions(quarter=4).rows(laps).tolist() == [6, 7]
    assert LapOptions(fastest=2, begins="line").rows(laps).tolist() == [4, 6]
    assert LapOptions(within=10.0).rows(laps).tolist() == [5, 6, 7]
    assert LapOptions(phase="evaluation").rows(laps).tolist() == []
    assert LapOptions(top_speed=2.55).rows(laps).tolist() == [6, 7]
    zone = time_laps(laps).zone_seconds[:, 1]
    assert LapOptions(turn=f"2={zone[5]}").rows(laps).tolist() == np.flatnonzero(zone <= zone[5]).tolist()
    assert LapOptions(mean_reward=1.0).rows(laps).tolist() == list(range(8))
    assert LapOptions(mean_reward=1.01).rows(laps).tolist() == []
