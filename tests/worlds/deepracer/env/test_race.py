"""One tick of a race and everything it may come to."""

import math

import numpy as np
import pytest

from racecraft.contract.errors import ContractError
from racecraft.contract.world import allocate
from racecraft.kernels import set_threads, threads
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.kernels.localise import progress_percent
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME, CRITIC_NAME
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track

ACTIONS = ActionTable.of([(math.radians(angle), speed) for angle in (-30, 0, 30) for speed in (0.5, 1.0)])
STRAIGHT, LEFT, RIGHT = 3, 5, 1
SMALL = CameraConfig(16, 12)
PRACTISED = RaceConfig(practice_seconds=2.0)


def make_world(num_cars=1, track=None, **options):
    options.setdefault("camera_config", SMALL)
    return RaceWorld(track or load_track("reinvent_base"), ACTIONS, **options, num_cars=num_cars)


def drive(world, choices, seed=0):
    """Drive (T, N) choices; return the reports (T, N), the buffers and the frames seen (T, N, H, W)."""
    buffers = allocate(world.spec)
    world.reset(buffers, seed)
    reports, frames = [], []
    for row in np.asarray(choices):
        world.step(row[:, None], buffers)
        reports.append(world.reports[:, 0].copy())
        frames.append(buffers.observations[CAMERA_NAME][:, 0].copy())
    return np.array(reports), buffers, np.array(frames)


def random_choices(ticks, cars, seed=0):
    return np.random.default_rng(seed).integers(0, len(ACTIONS.speed), (ticks, cars))


def test_the_first_rows_are_those_of_a_real_race():
    """Facts 13.4: front point (3.1999, 0.6830), heading 0.18°, progress 0.79 %; prepare row first, steps from 1."""
    reports, _, _ = drive(make_world(start_shares=[0.0]), [[STRAIGHT]] * 3)
    first, second = reports[0, 0], reports[1, 0]
    assert (first["front_x"], first["front_y"]) == pytest.approx((3.1999, 0.6830), abs=2e-3)
    assert math.degrees(first["yaw"]) == pytest.approx(0.18, abs=0.3)
    assert first["progress"] == pytest.approx(0.79, abs=0.01)
    assert (race.STATUSES[first["status"]], first["steps"]) == ("prepare", 1.0)
    assert (race.STATUSES[second["status"]], second["steps"]) == ("in_progress", 2.0)
    assert (second["x"], second["y"]) == (first["x"], first["y"]), "a car that is prepared is held"


def test_leaving_the_road_ends_the_episode_and_the_next_begins_further_round():
    world = make_world(start_shares=[0.0])
    reports, buffers, _ = drive(world, [[RIGHT]] * 60)
    ends = np.flatnonzero(reports[:, 0]["terminated"])
    assert len(ends) >= 1
    assert race.STATUSES[reports[ends[0], 0]["status"]] == "off_track"
    assert reports[ends[0], 0]["is_off"]
    after = reports[ends[0] + 1, 0]
    assert after["start_share"] == pytest.approx(0.05)
    assert (after["steps"], after["episode"]) == (1.0, 1)
    assert world.next_start_share == pytest.approx(0.05 * len(ends))
    records = world.pop_episodes()
    assert records[0].status == "off_track"
    assert records[0].facts["progress_percent"] == pytest.approx(reports[ends[0], 0]["progress"])
    assert world.pop_episodes() == []


def test_the_clock_cuts_an_episode_and_leaves_its_last_view():
    world = make_world(race_config=RaceConfig(max_episode_seconds=1.0))
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    for _ in range(14):
        world.step(np.array([[2]]), buffers)
        assert not buffers.truncated.any()
    world.step(np.array([[2]]), buffers)
    assert buffers.truncated.all()
    assert not buffers.terminated.any()
    final, fresh = buffers.final_observations[CRITIC_NAME][0, 0], buffers.observations[CRITIC_NAME][0, 0]
    assert final[3] == pytest.approx(0.515, abs=0.01), "the last view is of a car at 0.5 m/s (times 1.03)"
    assert fresh[3] == 0.0, "the next view is of a car at rest"
    assert world.pop_episodes()[0].status == "truncated"


class Steersman:
    """Drives round by the critic's view: steers at the road's direction half a metre ahead, and at the middle."""

    def __call__(self, view):
        aim = math.atan2(view[7], view[8]) - 0.6 * view[0]
        return STRAIGHT if abs(aim) < 0.12 else LEFT if aim > 0 else RIGHT


def lap(world, ticks=600):
    buffers, steersman = allocate(world.spec), Steersman()
    world.reset(buffers, 0)
    reports = []
    for _ in range(ticks):
        choices = [[steersman(view)] for view in buffers.observations[CRITIC_NAME][:, 0]]
        world.step(np.array(choices), buffers)
        reports.append(world.reports[:, 0].copy())
    return np.array(reports)


def test_a_lap_is_complete_at_a_hundred_per_cent():
    world = make_world(3)
    reports = lap(world)
    statuses = race.STATUSES[race.LAP_COMPLETE]
    for car in range(3):
        ends = np.flatnonzero(reports[:, car]["terminated"])
        assert race.STATUSES[reports[ends[0], car]["status"]] == statuses
        assert reports[ends[0], car]["progress"] == 100.0
        assert (np.diff(reports[: ends[0], car]["progress"]) > -0.2).all(), "no jump at the start line"
    record = world.pop_episodes()[0]
    assert record.facts["lap_seconds"] == pytest.approx(record.steps / 15)


def test_flying_laps_follow_one_another_without_a_new_start():
    world = make_world(start_shares=[0.0], laps=2)
    reports = lap(world)[:, 0]
    full = np.flatnonzero(reports["status"] == race.LAP_COMPLETE)[:2]
    assert list(reports["laps"][full]) == [1, 2]
    assert list(reports["terminated"][full]) == [False, True]
    standing, flying = reports["lap_seconds"][full]
    assert flying < standing, "a flying lap needs no start from rest"
    assert flying == pytest.approx((full[1] - full[0]) / 15)


@pytest.mark.parametrize(("track", "laps"), [("July_2020", 1), ("reinvent_base", 4)])
def test_the_slowest_car_has_time_for_every_lap(track, laps):
    """60 m, and four times 17.7 m, at 0.5 m/s: both take longer than 100 s."""
    slow = ActionTable(ACTIONS.steering, np.full_like(ACTIONS.speed, 0.5))
    world = RaceWorld(load_track(track), slow, start_shares=[0.0], laps=laps, num_cars=1, camera_config=SMALL)
    reports = lap(world, ticks=2400)[:, 0]
    end = np.flatnonzero(reports["terminated"] | reports["truncated"])[0]
    assert (reports[end]["laps"], end > 1500) == (laps, True), race.STATUSES[reports[end]["status"]]


def test_a_car_that_cannot_move_is_called_after_fifteen_ticks():
    stuck = make_world(start_shares=[0.0])
    stuck.profiles["speed_gain"] = 0.0
    reports, _, _ = drive(stuck, [[STRAIGHT]] * 20)
    end = np.flatnonzero(reports[:, 0]["terminated"])[0]
    assert race.STATUSES[reports[end, 0]["status"]] == "immobilized"
    assert end == 16  # the prepare tick, then fifteen ticks at rest, seen at the tick after


def test_a_mirrored_track_mirrors_the_drive():
    track = load_track("reinvent_base")
    mirrored = Track.from_rows("mirrored", track.rows * ([1, -1] * 3))
    choices = random_choices(80, 1, seed=3)
    swap = np.array([4, 5, 2, 3, 0, 1])
    there, _, _ = drive(make_world(track=track, start_shares=[0.3]), choices)
    here, _, _ = drive(make_world(track=mirrored, start_shares=[0.3]), swap[choices])
    for name, sign in (("x", 1), ("y", -1), ("yaw", -1), ("progress", 1), ("centre_distance", 1)):
        np.testing.assert_allclose(here[name], sign * there[name], atol=1e-9)
    assert (here["is_left"] != there["is_left"])[there["centre_distance"] > 1e-6].all()
    assert (here["status"] == there["status"]).all()


def test_many_cars_drive_as_each_alone():
    choices = random_choices(120, 5)
    starts = np.array([0.0, 0.21, 0.4, 0.66, 0.9])
    together, _, frames = drive(make_world(5, start_shares=starts), choices)
    for car in range(5):
        alone, _, own_frames = drive(make_world(1, start_shares=starts[car : car + 1]), choices[:, car : car + 1])
        assert alone[:, 0].tobytes() == together[:, car].tobytes()
        assert (own_frames[:, 0] == frames[:, car]).all()


def test_threads_change_no_bit():
    before = threads()
    choices = random_choices(60, 7, seed=1)
    stories = []
    try:
        for count in (1, 2):
            set_threads(count)
            reports, buffers, frames = drive(make_world(7), choices)
            stories.append((reports.tobytes(), frames.tobytes(), buffers.observations[CRITIC_NAME].tobytes()))
    finally:
        set_threads(before)
    assert stories[0] == stories[1]


def test_the_other_direction_starts_at_the_same_line():
    forward, _, _ = drive(make_world(start_shares=[0.0]), [[STRAIGHT]])
    backward, _, _ = drive(make_world(start_shares=[0.0], race_config=RaceConfig(reverse=True)), [[STRAIGHT]])
    there, here = forward[0, 0], backward[0, 0]
    assert (here["x"], here["y"]) == pytest.approx((there["x"], there["y"]))
    assert abs(math.remainder(here["yaw"] - there["yaw"], 2 * math.pi)) == pytest.approx(math.pi, abs=0.05)


@pytest.mark.parametrize(
    ("lap_share", "start_share", "last", "percent"),
    [
        (0.5, 0.0, 49.0, 50.0),  # on the way
        (0.1, 0.9, 19.0, 20.0),  # past the start line: -80 + 100
        (0.0, 0.0, 0.0, 0.0),  # exactly at the start: 0 + 100, and 100 > 0 + 50, so back to 0
        (0.995, 0.0, 0.0, -0.5),  # a little backwards from the start: 99.5 is a jump, so -0.5
        (0.001, 0.0, 99.9, 100.0),  # over the line at the end of the lap: 0.1 + 100, held at 100
    ],
)
def test_progress_by_hand(lap_share, start_share, last, percent):
    assert progress_percent(lap_share, start_share, last) == pytest.approx(percent)


def test_an_action_that_is_none_is_refused():
    world = make_world()
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    with pytest.raises(ContractError, match="are not from 0 to 5"):
        world.step(np.array([[6]]), buffers)
    with pytest.raises(ContractError, match="are not 1 of"):
        world.step(np.array([[1], [2]]), buffers)


def test_a_car_in_training_drives_on_over_the_finish_and_starts_again_when_its_time_is_over():
    """Its laps are episodes, cut and not ended; without it they end, and each begins at rest."""
    world = make_world(start_shares=[0.3], drive_seconds=60.0)
    reports = lap(world, 960)[:, 0]
    done = np.flatnonzero(reports["status"] == race.LAP_COMPLETE)
    assert len(done) >= 2
    first = done[0]
    assert reports[first]["truncated"]
    assert not reports[first]["terminated"]
    after = reports[first + 1]
    assert (after["episode"], after["steps"], after["lap_seconds"]) == (1, 1.0, pytest.approx(1 / 15))
    assert (race.STATUSES[after["status"]], after["start_share"]) == ("in_progress", 0.3)
    assert after["driven_speed"] > 0.5
    assert math.dist((after["x"], after["y"]), (reports[first]["x"], reports[first]["y"])) < 0.1
    assert after["progress"] < 1.0
    cut = np.flatnonzero(reports["truncated"] & (reports["status"] == race.IN_PROGRESS))
    assert cut.tolist() == [60 * 15 - 1]
    again = reports[cut[0] + 1]
    assert (race.STATUSES[again["status"]], again["start_share"]) == ("prepare", pytest.approx(0.35))
    assert [episode.status for episode in world.pop_episodes()] == ["lap_complete"] * len(done) + ["truncated"]


def test_four_of_five_drives_are_short_for_the_sake_of_standing_starts():
    world = make_world(race_config=PRACTISED, start_shares=[0.3], drive_seconds=6.0)
    reports = lap(world, 90 + 4 * 30 + 90)[:, 0]
    ends = np.flatnonzero(reports["truncated"])
    assert ends.tolist() == [89, 119, 149, 179, 209, 299]
    assert set(reports["status"][ends]) == {race.IN_PROGRESS}
    assert reports["start_share"][ends] == pytest.approx([0.3, 0.35, 0.4, 0.45, 0.5, 0.55])


def test_no_start_is_practised_where_a_lap_ends_an_episode():
    reports = lap(make_world(race_config=PRACTISED, start_shares=[0.3]), 120)[:, 0]
    assert not reports["truncated"].any()
