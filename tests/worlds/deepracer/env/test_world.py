"""What a race world tells of itself, keeps in a file, and makes of an episode: by hand, on a few ticks."""

import math

import numpy as np
import pytest

from racecraft.contract.errors import ContractError
from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import EpisodeRecord, allocate
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.rules import rules_of
from racecraft.worlds.deepracer.env.sensors import car_sensors
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.variation import VariationConfig
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(0.0, 1.0), (0.5, 1.0)])
SMALL = CameraConfig(16, 12)


def world_of(reward=None, sensors=("FRONT_FACING_CAMERA",), **options):
    return RaceWorld(
        load_track("reinvent_base"), ACTIONS, reward, camera_config=SMALL, sensors=car_sensors(list(sensors)), **options
    )


def test_one_car_drives_one_lap_of_an_empty_road_where_nothing_is_said():
    world = world_of()
    assert (world.spec.num_worlds, world.spec.num_agents) == (1, 1)
    assert (world.boxes.shape, world.kinds.shape, world.reports.shape) == ((1, 0, 6), (1, 0), (1, 1))
    assert world._rules == rules_of(RaceConfig(), world.track, 1, 0.0)
    assert (world.has_reward, world.variation, world.episodes_started, world.next_start_share) == (False, None, 0, 0.0)
    assert world.start_shares.tolist() == [0.0]
    assert world.track_lengths.tolist() == [world.track.length]
    assert world.pop_episodes() == []


def test_rows_that_a_route_file_repeats_count_as_waypoints_unless_they_are_distinct():
    """Of this route's rows one repeats the one before."""
    track = load_track("Oval_track") if load_track("Oval_track").repeated_rows else load_track("reinvent_base")
    filed, distinct = (
        RaceWorld(track, ACTIONS, race_config=RaceConfig(waypoints=told), camera_config=SMALL)
        for told in ("as_filed", "distinct")
    )
    assert len(filed.track.centre) == len(track.centre) + len(track.repeated_rows)
    assert len(distinct.track.centre) == len(track.centre)
    assert filed.drawn_track is distinct.drawn_track is track


@pytest.mark.parametrize(
    ("sensors", "reward", "variation", "alone"),
    [
        ("FRONT_FACING_CAMERA", None, "off", True),
        ("STEREO_CAMERAS", None, "off", False),
        ("FRONT_FACING_CAMERA", len, "off", False),
        ("FRONT_FACING_CAMERA", None, "aws", False),
    ],
)
def test_a_compiled_tick_is_all_where_one_eye_sees_what_is_there_and_nobody_pays(sensors, reward, variation, alone):
    world = world_of(reward, (sensors,), variation=VariationConfig(variation))
    assert world.is_compiled_tick_enough == alone
    assert world.has_reward == (reward is not None)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"profiles": [PROFILES["v4"]]}, "1 profiles for 2 cars"),
        ({"start_shares": [0.1]}, r"expected \(3,\)"),
        ({"reward": [len] * 5}, "5 reward functions were given; expected one for all or 6"),
    ],
)
def test_what_is_not_there_for_every_car_is_refused(options, told):
    with pytest.raises(ContractError, match=told):
        world_of(num_cars=3, cars_per_world=2, **options)


def test_each_car_of_a_world_answers_by_its_own_profile():
    world = world_of(num_cars=3, cars_per_world=2, profiles=[PROFILES["v4"], PROFILES["v6"]], reward=[len] * 6)
    assert world.profiles["steering_lag"].tolist() == [[PROFILES["v4"].steering_lag, PROFILES["v6"].steering_lag]] * 3
    assert (world_of(race_config=RaceConfig(car="v4")).profiles["grip"] == PROFILES["v4"].grip).all()


def test_what_is_shown_of_a_world_is_a_copy():
    world = world_of(sensors=("LEFT_CAMERA", "LIDAR"), objects=BoxesConfig(number=2))
    world.reset(allocate(world.spec), 0)
    for name in ("cars", "boxes", "kinds", "lidar_ranges", "start_shares"):
        part = getattr(world, name)
        before = part.copy()
        part[...] = np.zeros((), part.dtype) if part.dtype.names else 7
        assert (getattr(world, name) == before).all(), name


def test_the_next_start_is_where_one_car_would_be_that_had_driven_them_all():
    world = world_of(num_cars=3, start_shares=[0.9, 0.1, 0.2], race_config=RaceConfig(start_advance=0.05))
    world._cars["episode"][:, 0] = 1, 2, 4
    assert world.episodes_started == 7
    assert world.next_start_share == pytest.approx(0.25)  # 0.9 and seven times 0.05, less a lap


@pytest.mark.parametrize(
    ("status", "truncated", "word", "lap_seconds"),
    [
        (race.LAP_COMPLETE, False, "lap_complete", 9.5),
        (race.OFF_TRACK, False, "off_track", math.nan),
        (race.IN_PROGRESS, True, "truncated", math.nan),
        (race.CRASHED, False, "crashed", math.nan),
    ],
)
def test_an_episode_is_told_with_its_progress_and_time(status, truncated, word, lap_seconds):
    """30 ticks are 2 s; a lap has a time only where it is complete."""
    world = world_of(num_cars=2, cars_per_world=2)
    report = world.reports[1, 0]
    report["steps"], report["status"], report["truncated"] = 30.0, status, truncated
    report["progress"], report["lap_seconds"] = 62.5, 9.5
    told = world.record(1, 0, 3.25)
    assert (told.world, told.agent, told.steps, told.reward, told.status) == (1, 0, 30, 3.25, word)
    assert told.facts == pytest.approx(
        {"progress_percent": 62.5, "lap_seconds": lap_seconds, "seconds": 2.0}, nan_ok=True
    )
    assert world.record(1, 0).reward == 0.0


def test_rewards_are_summed_over_an_episode_and_begin_anew_with_the_next():
    world = world_of(lambda params: 0.5, race_config=RaceConfig(max_episode_seconds=1.0), num_cars=2)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    for _ in range(30):
        world.step(np.zeros((2, 1), np.int64), buffers)
    told = world.pop_episodes()
    assert [(one.world, one.steps, one.reward, one.status) for one in told] == [
        (0, 15, 7.0, "truncated"), (1, 15, 7.0, "truncated")
    ] * 2, "fifteen ticks, of which the first is not paid"  # fmt: skip
    assert isinstance(told[0], EpisodeRecord)
    world.step(np.zeros((2, 1), np.int64), buffers)
    world.begin_episodes(buffers)
    for _ in range(15):
        world.step(np.zeros((2, 1), np.int64), buffers)
    assert [one.reward for one in world.pop_episodes()] == [7.0, 7.0], "what was under way was forgotten"


def test_chance_is_each_cars_own_by_the_seed():
    world = world_of(num_cars=2, cars_per_world=3, objects=BoxesConfig(number=1))
    assert (world.save_state()["keys"][:, 0] == stream_keys(0, "ticks of a car", 2)).all()
    world.reset(allocate(world.spec), 9)
    keys = world.save_state()
    for m, purpose in enumerate(("ticks of a car", "ticks of car 1", "ticks of car 2")):
        assert (keys["keys"][:, m] == stream_keys(9, purpose, 2)).all()
    for k, purpose in enumerate(("places of objects", "lanes of bots")):
        assert (keys["object.keys"][:, k] == stream_keys(9, purpose, 2)).all()


def test_a_state_names_what_the_race_has_and_no_more():
    plain = set(world_of().save_state())
    cars = {f"car.{name}" for name in race.CAR_STATE.names}
    assert plain == cars | {"reward_sums", "keys"}
    assert set(world_of(sensors=("LEFT_CAMERA", "LIDAR")).save_state()) == plain | {"ranges"}
    boxes = set(world_of(objects=BoxesConfig(number=1)).save_state()) - plain
    assert {"object.boxes", "object.keys", "object.arc", "object.lane"} <= boxes
    assert all(name.startswith("object.") for name in boxes)
    varied = set(world_of(variation=VariationConfig("light")).save_state()) - plain
    assert varied == {"variation.keys", "variation.waiting", "variation.shown"}


def test_a_race_that_an_older_version_kept_goes_on_without_what_it_did_not_know():
    world, other = (world_of(lambda params: 1.0, num_cars=2, objects=BoxesConfig(number=1)) for _ in range(2))
    buffers, theirs = allocate(world.spec), allocate(other.spec)
    world.reset(buffers, 3)
    other.reset(theirs, 3)
    for _ in range(4):
        world.step(np.zeros((2, 1), np.int64), buffers)
    state = world.save_state()
    assert state["reward_sums"].tolist() == [[3.0], [3.0]]
    for name in ("car.start_left", "keys", "object.speed"):
        del state[name]
    other.freeze(np.array([[True], [False]]))
    other.load_state(state, theirs)
    assert not other.cars["away"].any()
    assert (theirs.observations["FRONT_FACING_CAMERA"] == buffers.observations["FRONT_FACING_CAMERA"]).all()
    for one, own in ((world, buffers), (other, theirs)):
        one.step(np.zeros((2, 1), np.int64), own)
    assert (world.cars == other.cars).all()
    assert (other.reports["status"] == race.IN_PROGRESS).all(), "who was parked drives again"
    assert other.save_state()["reward_sums"].tolist() == [[4.0], [4.0]]
