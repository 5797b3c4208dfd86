"""Looking at a lap: a car that goes by the walls is found out before it races."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from racecraft.algorithms.actor_policy import ActorPolicy
from racecraft.algorithms.distributions import distribution_for
from racecraft.algorithms.networks import ActorCritic, Architecture
from racecraft.analysis.attribution import AttentionError
from racecraft.contract.world import ArraySpec, ContinuousActions, allocate
from racecraft.worlds.deepracer.analysis.run_saliency import as_seen, look_at_lap, look_at_pictures
from racecraft.worlds.deepracer.analysis.saliency import SaliencySeries
from racecraft.worlds.deepracer.analysis.saliency_page import findings, write_saliency_page
from racecraft.worlds.deepracer.analysis.surfaces import OBSTACLE, SURFACES, SurfaceAttention, eye_poses, surface_shares
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME
from racecraft.worlds.deepracer.env.sensors import FRONT_CAMERA, STEREO, STEREO_GREY_WEIGHTS, car_sensors
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(math.radians(angle), 1.0) for angle in (20, -20)])
SIGHT = (30, 40)


class Car:
    """What `look_at_lap` asks of a trained car."""

    trained_on, sensors = load_track("reinvent_base"), FRONT_CAMERA

    def __init__(self, policy):
        self.policy = policy
        sees = {CAMERA_NAME: ArraySpec(SIGHT, np.uint8)}
        policy.spec = type("Spec", (), {"actions": ACTIONS.spec, "visible": sees, "stack_size": 1})

    def world(self, track, num_cars, start_shares, laps):
        return RaceWorld(
            track, ACTIONS, num_cars=num_cars, start_shares=start_shares, laps=laps,
            race_config=RaceConfig(max_episode_seconds=2.0), camera_config=CameraConfig(*SIGHT[::-1]),
            sensors=self.sensors,
        )  # fmt: skip


def policy_reading(rows):
    """Return a policy that reads some rows of pixels and nothing else: the brighter half of them decides."""
    row = Architecture(convolutions=(), trunk_units=())
    network = ActorCritic(
        {CAMERA_NAME: ArraySpec(SIGHT, np.uint8)}, ACTIONS.spec, row, torch.Generator().manual_seed(0)
    )
    with torch.no_grad():
        weights = torch.zeros(2, *SIGHT)
        half = SIGHT[1] // 2
        weights[0, rows, :half], weights[1, rows, half:] = 1.0, 1.0
        network.policy_head.weight[:] = weights.flatten(1)
        network.policy_head.bias[:] = 0.0
    return ActorPolicy(network, distribution_for(ACTIONS.spec))


@pytest.fixture(scope="module")
def wall_rows():
    """Rows of pixels above every road: walls and sky only, along the whole lap."""
    car = Car(policy_reading(slice(0, 1)))
    track = car.trained_on
    world = car.world(track, 1, [0.0], 1)
    poses = np.array([track.pose_at(float(arc)) for arc in np.linspace(0.0, 0.95 * track.length, 40)])
    shares = surface_shares(world.camera, poses)
    off = shares[:, [SURFACES.index("wall"), SURFACES.index("sky")]].sum(axis=1).min(axis=(0, 2))
    rows = int((off > 0.99).sum())
    assert rows >= 3
    return slice(0, rows)


def test_a_car_that_goes_by_the_walls_is_found_out(wall_rows, tmp_path):
    car = Car(policy_reading(wall_rows))
    lap = look_at_lap(car, car.trained_on)
    told = {row.surface: row for row in lap.surfaces}
    assert told["wall"].attention + told["sky"].attention > 0.99
    assert told["grass"].changed == told["border line"].changed == 0.0
    assert max(told["wall"].changed, told["sky"].changed) > 0.2
    assert "what is not the track" in " ".join(findings(lap.surfaces, lap.series))
    text = write_saliency_page(tmp_path / "look.html", lap, "wall reader").read_text()
    assert "what is not the track" in text
    assert "http" not in text.replace("http://www.w3.org", "")


def test_a_car_that_goes_by_the_road_is_not_accused(wall_rows):
    car = Car(policy_reading(slice(15, 30)))
    lap = look_at_lap(car, car.trained_on)
    told = {row.surface: row for row in lap.surfaces}
    assert told["wall"].attention < 0.01
    assert "what is not the track" not in " ".join(findings(lap.surfaces, lap.series))


class CarAmongBoxes(Car):
    """Two boxes ahead of it on the first straight, one in each lane."""

    def world(self, track, num_cars, start_shares, laps):
        return RaceWorld(
            track, ACTIONS, num_cars=num_cars, start_shares=start_shares, laps=laps,
            race_config=RaceConfig(type="OBJECT_AVOIDANCE", max_episode_seconds=2.0),
            camera_config=CameraConfig(*SIGHT[::-1]), objects=BoxesConfig(positions="0.1,1;0.14,-1"),
        )  # fmt: skip


def test_whether_boxes_turn_a_car_s_decisions_is_told(wall_rows):
    """One that reads the rows at the horizon, which a near box covers, and one that reads the sky above it."""
    found = []
    for rows in (slice(wall_rows.stop - 1, wall_rows.stop + 2), slice(0, 1)):
        lap = look_at_lap(CarAmongBoxes(policy_reading(rows)), Car.trained_on)
        (box,) = [row for row in lap.surfaces if row.surface == OBSTACLE]
        assert box.area > 0.01
        found.append((box.changed, " ".join(findings(lap.surfaces, lap.series))))
        (dashes,) = [row for row in lap.surfaces if row.surface == "centre line"]
        assert dashes.changed == 0.0, "boxes stand where they stood while something else is painted over"
    (reads, told), (blind, told_of_blind) = found
    assert reads > 0.2
    assert f"with a box or bot in sight {100 * reads:.0f} % of its decisions are others without it" in told
    assert blind == 0.0
    assert "What stands on the road hardly matters to it" in told_of_blind


def rows_of(wall, road):
    return [SurfaceAttention(name, 0.4, 0.5, changed) for name, changed in (("wall", wall), ("road", road))]


def sure(gap):
    return SimpleNamespace(confidence=SimpleNamespace(gap=np.full(9, gap)))


@pytest.mark.parametrize(
    ("gap", "wall", "road", "words", "never"),
    [
        (0.6, 0.9, 0.3, "It goes by what is not the track: with the wall painted over, 90 %", "Whatever is painted"),
        (0.6, 0.9, 0.97, "97 % with the road, 90 % with the wall", "what is not the track"),
        (np.nan, 0.9, 0.97, "97 % with the road, 90 % with the wall", "what is not the track"),  # it decides numbers
        (0.01, 0.9, 0.3, "racecraft train --run runs/a --resume", "wall painted over"),
        (0.6, 0.0, 0.9, "Walls and sky hardly matter", "what is not the track"),
    ],
)
def test_walls_are_blamed_where_they_count_for_most_and_it_is_decided(gap, wall, road, words, never):
    told = " ".join(findings(rows_of(wall, road), sure(gap), "runs/a"))
    assert words in told
    assert never not in told


def test_a_model_that_was_imported_is_begun_anew_for_there_is_no_state_to_go_on_from():
    told = " ".join(findings(rows_of(0.1, 0.3), sure(0.01), "runs/a", imported=True))
    assert "racecraft train --from runs/a." in told


def test_what_is_explained_is_what_was_driven(wall_rows):
    """The frames of the look are those of the lap, tick by tick, rendered from where the car was."""
    car = Car(policy_reading(slice(15, 30)))
    lap = look_at_lap(car, car.trained_on)
    world = car.world(car.trained_on, 1, [0.0], 1)
    x, y, yaw = car.trained_on.pose_at(0.0)
    assert len(lap.series) == len(lap.positions.xy) == len(lap.progress_percent)
    first = world.camera.render_grey(np.array([[x, y, yaw]]))[0]
    assert np.abs(lap.series.frames[0].astype(int) - first).mean() < 12.0
    assert np.abs(lap.series.frames[0].astype(int) - lap.series.frames[-1]).mean() > 0.5


def test_two_eyes_are_painted_over_eye_by_eye():
    """A car that reads the two eyes' walls only is told so; what is repainted is what each eye saw."""
    sees = {STEREO: ArraySpec((*SIGHT, 2), np.uint8)}
    row = Architecture(convolutions=(), trunk_units=())
    network = ActorCritic(sees, ACTIONS.spec, row, torch.Generator().manual_seed(0))
    with torch.no_grad():
        weights = torch.zeros(2, *SIGHT, 2)
        weights[0, :3, : SIGHT[1] // 2], weights[1, :3, SIGHT[1] // 2 :] = 1.0, 1.0
        network.policy_head.weight[:] = weights.flatten(1)
        network.policy_head.bias[:] = 0.0
    car = Car(ActorPolicy(network, distribution_for(ACTIONS.spec)))
    car.policy.spec.visible = sees
    car.sensors = car_sensors([STEREO])
    lap = look_at_lap(car, car.trained_on)
    told = {row.surface: row for row in lap.surfaces}
    assert told["wall"].attention + told["sky"].attention > 0.95
    assert told["border line"].changed is not None
    assert told["border line"].changed < 0.05
    assert max(told["wall"].changed, told["sky"].changed) > 0.2
    world = car.world(car.trained_on, 1, [0.0], 1)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    car_now = world.cars[0, 0]
    pose = np.array([[car_now["x"], car_now["y"], car_now["yaw"]]])
    levels = world.camera.scene.palette @ STEREO_GREY_WEIGHTS
    for eye, left in enumerate(world.sensors.eyes_left_m):
        drawn = world.camera.render_grey(eye_poses(pose, float(left)), palettes=levels)[0]
        assert np.abs(drawn.astype(int) - buffers.observations[STEREO][0, 0, ..., eye]).max() <= 1


def test_a_car_that_goes_by_one_beam_of_its_lidar_is_told_so(tmp_path):
    """Its weights read beam 40 of 64 and, a tenth as strongly, one pixel: nothing else can count."""
    sees = {STEREO: ArraySpec((*SIGHT, 2), np.uint8), "LIDAR": ArraySpec((64,), np.float32)}
    row = Architecture(convolutions=(), trunk_units=())
    network = ActorCritic(sees, ACTIONS.spec, row, torch.Generator().manual_seed(0))
    with torch.no_grad():
        network.policy_head.weight[:] = 0.0
        network.policy_head.bias[:] = 0.0
        network.policy_head.weight[0, 40], network.policy_head.weight[0, -1] = 10.0, 1.0
    car = Car(ActorPolicy(network, distribution_for(ACTIONS.spec)))
    car.policy.spec.visible = sees
    car.sensors = car_sensors([STEREO, "LIDAR"])
    lap = look_at_lap(car, car.trained_on)
    seen = lap.series.others["LIDAR"]
    assert seen.shape == (len(lap.series), 64)
    assert seen.sum() > 0
    assert np.delete(seen, 40, axis=1).sum() == 0
    assert next(iter(lap.series.senses)) == "LIDAR"
    assert sum(lap.series.senses.values()) == pytest.approx(1.0)
    page = write_saliency_page(tmp_path / "look.html", lap, "a car").read_text(encoding="utf-8")
    assert "By what it sees with" in page
    assert f"{100 * lap.series.senses['LIDAR']:.1f} %" in page


def test_pictures_and_folders_are_looked_at(tmp_path):
    from PIL import Image

    car = Car(policy_reading(slice(0, 30)))
    bright_left = np.zeros((120, 160, 3), np.uint8)
    bright_left[:, :80] = 200
    Image.fromarray(bright_left).save(tmp_path / "a.png")
    Image.fromarray(bright_left[:, ::-1].copy()).save(tmp_path / "b.jpg")
    look = look_at_pictures(car.policy, tmp_path)
    assert look.confidence.best.tolist() == [0, 1]
    assert look_at_pictures(car.policy, tmp_path / "b.jpg").confidence.best.tolist() == [1]
    assert look.facts(0)["chosen"] == ACTIONS.spec.labels[0]


def test_a_wide_picture_is_cut_and_keeps_its_shape():
    wide = np.zeros((60, 200, 3), np.uint8)
    wide[:, 60:140] = 255  # the middle 80 x 60 is 4 : 3
    assert as_seen(wide, 40, 30, ArraySpec(SIGHT, np.uint8)).min() == 255


@pytest.mark.parametrize("name", ["nowhere.png", "words.png", "empty"])
def test_what_is_no_picture_is_refused_by_name(tmp_path, name):
    (tmp_path / "words.png").write_text("no picture")
    (tmp_path / "empty").mkdir()
    with pytest.raises(AttentionError, match=name):
        look_at_pictures(Car(policy_reading(slice(0, 1))).policy, tmp_path / name)


def test_a_car_that_sees_more_than_a_picture_tells_is_refused(tmp_path):
    policy = Car(policy_reading(slice(0, 1))).policy
    policy.spec.visible = {"STEREO_CAMERAS": ArraySpec((30, 40, 2), np.uint8), "LIDAR": ArraySpec((8,), np.float32)}
    with pytest.raises(AttentionError, match="STEREO_CAMERAS .30, 40, 2., LIDAR"):
        look_at_pictures(policy, tmp_path)


def test_numbers_are_told_as_racers_say_them():
    """By hand: of ranges of ±30° and 0.5 to 2 m/s, a half of the way to the right and two thirds up."""
    thirty = math.radians(30.0)
    actions = ContinuousActions(low=(-thirty, 0.5), high=(thirty, 2.0))
    decided = SimpleNamespace(numbers=np.array([[-0.5, 1 / 3]]))
    look = SaliencySeries("CAMERA", np.zeros((1, 3, 4), np.uint8), np.zeros((1, 3, 4)), None, decided, actions)
    assert look.decision(0) == [
        ("steering", pytest.approx(0.25), "right 15°"),
        ("speed", pytest.approx(2 / 3), "1.50 m/s"),
    ]
