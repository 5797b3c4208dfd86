"""What an episode has of a draw, by hand: draws are laid in, and what comes of them is reckoned in plain steps."""

import math

import numpy as np
import pytest

from racecraft.contract.random_streams import stream_keys
from racecraft.worlds.deepracer.env import randomisation
from racecraft.worlds.deepracer.env.camera import MOUNT_V3, OPTICS, Camera, CameraMount, mounted_optics
from racecraft.worlds.deepracer.env.race import car_profiles
from racecraft.worlds.deepracer.env.randomisation import RandomisedCars, light_of_lamps, plain_optics
from racecraft.worlds.deepracer.env.scene import FIELD, LINE, MATERIALS, SKY, START, WALL_SOUTH, build_scene
from racecraft.worlds.deepracer.env.variation import DRAWN, VariationConfig, drawn_dtype
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.tracks.style import TrackStyle
from racecraft.worlds.deepracer.tracks.track import Track

GREY = np.array([0.25, 0.5, 0.25])
KINDS = np.array([[0, 3], [2, 0]])
FIRST = {"lamps": 22, "materials": 31, "objects": 31 + 3 * len(MATERIALS)}
"""Where the draws of an episode begin: behind the 22 amounts, behind the nine of lamps, behind three a material."""


@pytest.fixture(scope="module")
def camera():
    corners = np.array([(0, -1), (1, -1), (1, 1), (-1, 1), (-1, -1), (0, -1)], float)
    track = Track.from_rows("square", np.hstack([corners * 0.6, corners * 0.3, corners * 0.9]), look=TrackStyle())
    return Camera(build_scene(track), 8, 6)


@pytest.fixture
def begun(camera, monkeypatch):
    """Return what makes cars, two worlds of three with two objects each, whose first episodes draw what is told."""

    def begin(draws, rows=None, car="v4", **ranges):
        def lay_in(keys, rows, episodes, found):
            found[rows] = draws

        monkeypatch.setattr(randomisation.kernels, "draw_evenly", lay_in)
        profiles = np.tile(car_profiles([PROFILES[car]] * 3), (2, 1))
        cars = RandomisedCars(VariationConfig(**ranges), camera, GREY, 2, profiles, KINDS)
        cars.begin(np.ones((2, 3), bool) if rows is None else rows, np.zeros((2, 3), np.int64))
        return cars

    return begin


@pytest.mark.parametrize("draw", [0.0, 0.25, 0.5, 0.75, 0.999])
def test_a_draw_is_a_share_of_its_range_to_one_side_or_to_either(begun, draw):
    """Ranges are a power of two each, so that nothing is taken for another; commands are late by whole ticks."""
    ranges = {
        "palette": 0.5, "gain": 0.5, "gradient": 0.25, "grain": 8.0, "glare": 64.0, "noise": 16.0, "blur": 0.03125,
        "camera_height": 0.015625, "camera_pitch": 0.125, "camera_roll": 0.25, "camera_view": 0.0625, "latency": 0.2,
        "dropped_frames": 0.75, "steering_gain": 0.375, "steering_offset": 0.1875, "steering_lag": 0.875,
        "speed_gain": 0.625, "slip": 1.5, "steering_noise": 0.28, "speed_noise": 0.56,
    }  # fmt: skip
    drawn = begun(draw, **ranges).drawn
    either = 2 * draw - 1
    expected = {
        "gain": 1 + 0.5 * either, "gradient_x": 0.25 * either, "gradient_y": 0.25 * either,
        "grain": 8 * draw, "glare": 64 * draw, "noise": 16 * draw, "blur": 0.03125 * draw,
        "glare_azimuth": math.pi * either, "glare_elevation": -0.4 + 0.55 * draw,
        "camera_height": 0.015625 * either, "camera_pitch": 0.125 * either, "camera_roll": 0.25 * either,
        "camera_view": 0.0625 * either, "latency": {0.0: 0, 0.25: 1, 0.5: 2, 0.75: 3, 0.999: 3}[draw] / 15,
        "dropped_frames": 0.75 * draw, "steering_gain": 1 + 0.375 * either, "steering_offset": 0.1875 * either,
        "steering_lag": 0.875 * draw, "speed_gain": 1 + 0.625 * either, "slip": 1.5 * draw,
        "steering_noise": 0.28 * draw, "speed_noise": 0.56 * draw,
    }  # fmt: skip
    assert [one.name for one in DRAWN] == [name for name in drawn.dtype.names if not name.startswith("grey")]
    assert set(expected) == {one.name for one in DRAWN}
    for name, amount in expected.items():
        np.testing.assert_allclose(drawn[name], np.full((2, 3), amount), atol=1e-12, err_msg=name)


def test_a_field_that_has_a_grain_of_its_own_has_it_below_what_is_drawn(begun, camera, monkeypatch):
    monkeypatch.setattr(camera, "optics", camera.optics._replace(grain=6.5))
    cars = begun(0.5, grain=8.0)
    assert (cars.drawn["grain"] == 10.5).all()
    assert (cars.optics["grain"] == 10.5).all()


def test_only_the_cars_that_begin_draw(begun):
    rows = np.array([[True, False, False], [False, False, True]])
    cars = begun(1.0 - 1e-9, rows, gain=0.5, latency=0.2, steering_lag=0.5)
    assert (cars.drawn["gain"] > 1.4).tolist() == rows.tolist()
    assert cars.latency.tolist() == [[3, 0, 0], [0, 0, 3]]
    assert cars.latency.dtype == np.int64
    assert (cars.profiles["steering_lag"] > 1.0).tolist() == rows.tolist()
    assert (cars.optics["focal"] > 0).tolist() == rows.tolist()
    assert (cars.palettes > 0).all(axis=2).tolist() == rows.tolist()


def test_a_camera_sits_by_so_much_higher_lower_wider_and_more_askew(begun):
    cars = begun(0.75, camera_height=0.02, camera_pitch=0.1, camera_roll=0.2, camera_view=0.3)
    moved = CameraMount(MOUNT_V3.x, MOUNT_V3.z + 0.01, MOUNT_V3.pitch + 0.05, MOUNT_V3.horizontal_view + 0.15, 0.1)
    expected = mounted_optics(8, 6, moved)
    for name, number in expected._asdict().items():
        np.testing.assert_allclose(cars.optics[name], np.full((2, 3), number), err_msg=name)


def test_a_car_answers_more_slowly_faster_and_with_less_grip(begun):
    """v4 holds 3.03 m/s² and answers within 0.502 s, 1.019 times as fast as told."""
    cars = begun(0.75, steering_lag=0.4, speed_gain=0.2, slip=0.4)
    told = cars.profiles[1, 2]
    assert told["steering_lag"] == pytest.approx(0.502 + 0.3)
    assert told["speed_gain"] == pytest.approx(1.019 * 1.1)
    assert told["grip"] == pytest.approx(1 / (1 / 3.03 + 0.3))
    unslipped = begun(0.75, steering_lag=0.4).profiles[0, 0]
    assert unslipped["grip"] == 3.03, "to the last bit"
    others = [name for name in cars.profiles.dtype.names if name not in ("steering_lag", "speed_gain", "grip")]
    assert (told[others] == car_profiles([PROFILES["v4"]])[0][others]).all()


def grey(colour):
    return np.clip(colour, 0, 255) @ GREY


def some_draws(episodes=1):
    """Return draws of so many episodes, each of its own."""
    return np.random.default_rng(3).uniform(size=(episodes, FIRST["objects"] + 3 * 2))


def test_every_colour_of_every_material_strays_by_itself_and_objects_with_their_kind(begun, camera):
    """By hand: red, green and blue times one more or less a share of the range; kinds are materials behind the sky."""
    draws = some_draws()[0]
    cars = begun(draws, palette=0.3)
    palette, share = camera.scene.palette, draws[FIRST["materials"] :][: 3 * len(MATERIALS)].reshape(-1, 3)
    lit = palette * (1 + 0.3 * (2 * share - 1))
    for world, kinds in enumerate(KINDS):
        expected = [grey(colour) for colour in (*lit, *(lit[SKY + 1 + kind] for kind in kinds))]
        np.testing.assert_allclose(cars.palettes[world, 1], expected)
        told = cars.drawn[world, 1]
        assert told["grey_field"] == pytest.approx(expected[FIELD])
        assert told["grey_wall_south"] == pytest.approx(expected[WALL_SOUTH])
        assert told["grey_object_1"] == pytest.approx(expected[-1])


def test_objects_have_any_colour_where_that_is_asked(begun, camera):
    draws = some_draws()[0]
    cars = begun(draws, object_colours=True)
    expected = [grey(255 * draws[FIRST["objects"] + 3 * k :][:3]) for k in range(2)]
    np.testing.assert_allclose(cars.palettes[..., -2:], np.broadcast_to(expected, (2, 3, 2)))
    np.testing.assert_allclose(cars.palettes[0, 0, : len(MATERIALS)], camera.scene.palette @ GREY)


def test_lamps_shine_on_materials_and_on_objects_as_on_the_field(begun, camera):
    draws = some_draws()[0]
    light = light_of_lamps(draws[None, FIRST["lamps"] : FIRST["materials"]])[0]
    palette = camera.scene.palette
    cars = begun(draws, lamps=True)
    for world, kinds in enumerate(KINDS):
        objects = [palette[SKY + 1 + kind] * light[FIELD] for kind in kinds]
        np.testing.assert_allclose(cars.palettes[world, 0], [grey(colour) for colour in (*(palette * light), *objects)])


def test_a_wall_has_of_the_sun_what_it_faces_of_it():
    """The sun stands towards (0.5, -0.1, 0.9): the west wall faces east, the north wall south, the others away."""
    draws = np.zeros((1, 9))
    draws[:, :3], draws[:, 6] = (1.0, 1.0, 0.8), 1.0  # the original's own sun, and a lamp that is dark
    lamp = 0.225 / (0.4 + 0.01 * 15)
    light = light_of_lamps(draws)[0]
    for material, facing in ((0, 0.9), (1, 0.9), (5, 0.0), (6, 0.0), (7, 0.1), (8, 0.5), (10, 0.9)):
        sun = facing / math.sqrt(1.07) * np.array([1.0, 1.0, 0.8])
        np.testing.assert_allclose(light[material], (0.5 + sun) / (0.5 + sun + lamp), err_msg=MATERIALS[material])
    assert (light[SKY] == 1.0).all()


def test_what_a_car_draws_is_named_by_its_materials_and_objects():
    names = drawn_dtype(2).names
    assert len(names) == 22 + len(MATERIALS) + 2
    assert names[22 + FIELD] == "grey_field"
    assert names[22 + START] == "grey_start"
    assert names[22 + LINE] == "grey_line"
    assert names[-2:] == ("grey_object_0", "grey_object_1")
    assert len(drawn_dtype(0).names) == 22 + len(MATERIALS)


def test_each_object_has_a_row_of_the_palette_of_its_own_behind_the_kinds(begun):
    """Behind the sky there are four kinds; then come the objects themselves."""
    assert begun(0.5).paints.tolist() == [[4, 5], [4, 5]]


def test_every_car_has_its_streams_of_chance_by_seed_purpose_and_number(begun):
    cars = begun(0.5, latency=0.2)
    assert cars.save_state()["variation.keys"].shape == (4, 2, 3)
    for seed in (0, 7):
        if seed:
            cars.seed(seed)
        keys = cars.save_state()["variation.keys"]
        for place, purpose in enumerate(("variation", "noise of commands", "noise of frames", "frames that fail")):
            for m in range(3):
                assert (keys[place, :, m] == stream_keys(seed, f"{purpose} of car {m}", 2)).all()


def test_every_kind_of_chance_is_drawn_from_its_own_stream(begun, monkeypatch):
    """Of episodes, of commands, of frames and of frames that fail, in this order; of three cars the second is shown."""
    cars, heard = begun(0.5, noise=1.0), []
    keys = cars.save_state()["variation.keys"]
    monkeypatch.setattr(randomisation.kernels, "draw_evenly", lambda *told: heard.append((told[0], told[2])))
    monkeypatch.setattr(randomisation.kernels, "send_late", lambda *told: heard.append((told[2], told[3])))
    monkeypatch.setattr(randomisation.kernels, "disturb_frames", lambda *told: heard.append(told[2:8]))
    states, rows, episodes = object(), np.array([[False, True, False]] * 2), np.arange(6).reshape(2, 3)
    cars.begin(rows, episodes)
    assert cars.send(states, np.zeros((2, 3, 2))).shape == (2, 3, 2)
    cars.show(states, rows, np.zeros((2, 3, 2, 6, 8), np.uint8))
    cars.show(states, rows, np.zeros((2, 3, 2, 6, 8), np.uint8), is_last=True)
    drawn, sent, shown, last = heard
    assert (drawn[0] == keys[0]).all()
    assert drawn[1] is episodes
    assert (sent[0] == keys[1]).all()
    assert sent[1] is states
    for told, is_last in ((shown, False), (last, True)):
        assert told[0] == 0.15, "as wide as a glow is where nothing is said"
        assert (told[1] == keys[2]).all()
        assert (told[2] == keys[3]).all()
        assert told[3] is states
        assert told[4] is rows
        assert told[5] == is_last


def test_there_is_room_for_commands_and_frames_that_are_under_way(begun):
    """0.2 s are three ticks, and the one that is chosen now; two eyes of 8 by 6 pixels."""
    state = begun(0.5, latency=0.2).save_state()
    assert state["variation.waiting"].shape == (2, 3, 4, 2)
    assert begun(0.5, gain=0.1).save_state()["variation.waiting"].shape == (2, 3, 1, 2)
    assert (state["variation.shown"].shape, state["variation.shown"].dtype) == ((2, 3, 2, 6, 8), np.uint8)
    assert not state["variation.waiting"].any()
    assert not state["variation.shown"].any()


def test_a_state_brings_back_chance_and_what_was_under_way_and_one_without_them_draws_anew(begun):
    one, other = begun(0.5, latency=0.2), begun(0.5, latency=0.2)
    one.seed(5)
    one._waiting[:], one._shown[:] = 1.5, 9
    state = one.save_state()
    one._waiting[:], one._shown[:] = 0.0, 0  # what was told is a copy
    episodes, drawn = np.arange(6).reshape(2, 3), other.drawn.copy()
    other.drawn["gain"] = 7.0
    other.load_state(state, episodes)
    for name, part in other.save_state().items():
        assert (part == state[name]).all(), name
    assert (other.drawn == drawn).all(), "every car draws its episode again"
    kept = other.save_state()["variation.keys"]
    other.load_state({}, episodes)
    assert (other.save_state()["variation.keys"] == kept).all()


def test_cars_that_differ_in_nothing_see_through_one_camera(camera):
    optics = plain_optics(camera, (2, 3))
    assert (optics.shape, optics.dtype) == ((2, 3), OPTICS)
    for name, number in camera.optics._asdict().items():
        assert (optics[name] == number).all(), name
