"""Every disturbance does what it says, held to plain slow twins; and what is switched off changes nothing."""

import math
import re

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.contract.world import allocate
from racecraft.kernels import set_threads, threads
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME
from racecraft.worlds.deepracer.env.randomisation import light_of_lamps
from racecraft.worlds.deepracer.env.scene import DASH, FIELD, LINE, MATERIALS, ROAD, SKY, START
from racecraft.worlds.deepracer.env.sensors import car_sensors
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.variation import (
    AMOUNTS,
    DISTURBANCES,
    RANGES,
    VariationConfig,
    disturbances_of,
    only,
)
from racecraft.worlds.deepracer.env.vehicle import PROFILES, TICK_SECONDS
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(math.radians(angle), speed) for angle in (-30, 0, 30) for speed in (0.5, 1.0, 2.0)])
WIDTH, HEIGHT = 40, 30
MOST = {**AMOUNTS["strong"], **AMOUNTS["aws"]}


def race(variation=None, num_cars=3, sensors=("FRONT_FACING_CAMERA",), grass=False, **config):
    """A race with boxes, so that every disturbance has something to act on."""
    config = {"type": "OBJECT_AVOIDANCE", "max_episode_seconds": 2.5, **config}
    return RaceWorld(
        load_track("reinvent_base"), ACTIONS, race_config=RaceConfig(**config), num_cars=num_cars,
        camera_config=CameraConfig(WIDTH, HEIGHT, grass=grass), sensors=car_sensors(list(sensors)),
        variation=variation or VariationConfig(),
    )  # fmt: skip


def drive(world, ticks=60, seed=5, actions=None):
    """Return everything that was seen and told, tick by tick: frames, last frames, x, y, yaw, statuses."""
    buffers, rng = allocate(world.spec), np.random.default_rng(7)
    choices = rng.integers(0, 9, (ticks, 64, 1)) if actions is None else actions
    world.reset(buffers, seed)
    name = world.sensors.camera_name
    seen = [buffers.observations[name].copy()]
    for tick in range(ticks):
        world.step(choices[tick, : world.spec.num_worlds], buffers)
        last = np.where(buffers.ended.reshape(-1, *[1] * (seen[0].ndim - 1)), buffers.final_observations[name], 0)
        told = [world.reports[part] for part in ("x", "y", "yaw", "status", "episode")]
        seen += [buffers.observations[name].copy(), last, np.array(told, float)]
    return seen


def same(one, other):
    return all((a == b).all() for a, b in zip(one, other, strict=True))


def forced(config, **options):
    """A race that takes the road of varied cars whatever its ranges say."""
    world = race(**options)
    world._varied = world._varied_cars(config)
    world.variation = world._varied.drawn.copy()
    return world


def switch(name, amount):
    """The setting's value in its own type."""
    return bool(amount) if name in ("lamps", "object_colours") else amount


def alone(name, amount=None, **more):
    amount = MOST[name] if amount is None else amount
    return VariationConfig("off", **{name: switch(name, amount)}, **more)


@pytest.mark.parametrize("sensors", [("FRONT_FACING_CAMERA",), ("STEREO_CAMERAS", "LIDAR")])
def test_ranges_of_zero_change_no_bit(sensors):
    nothing = VariationConfig("strong", **{name: switch(name, 0.0) for name in RANGES})
    assert not nothing.is_on
    plain = race(sensors=sensors, grass=True)
    assert plain.variation is None
    assert same(drive(plain), drive(forced(nothing, sensors=sensors, grass=True)))


@pytest.mark.parametrize("name", RANGES)
def test_every_setting_changes_something(name, plain):
    assert not same(plain, drive(race(alone(name)))), f"variation.{name} is read and ignored"


@pytest.fixture(scope="module")
def plain():
    return drive(race())


def test_a_given_range_outweighs_the_level():
    assert VariationConfig("strong", noise=0.0).amounts == {**VariationConfig("strong").amounts, "noise": 0.0}
    assert VariationConfig("aws").amounts["noise"] == 0.0


# ---- same seed, same bits --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sensors", [("FRONT_FACING_CAMERA",), ("STEREO_CAMERAS",)])
def test_bits_depend_neither_on_threads_nor_on_company(sensors):
    strong, before = VariationConfig("strong", lamps=True), threads()
    try:
        set_threads(1)
        alone_ = drive(race(strong, num_cars=2, sensors=sensors, start_advance=0.0), seed=3)
        set_threads(2)
        together = drive(race(strong, num_cars=2, sensors=sensors, start_advance=0.0), seed=3)
    finally:
        set_threads(before)
    assert same(alone_, together)
    other = drive(race(strong, num_cars=2, sensors=sensors, start_advance=0.0), seed=4)
    assert not same(alone_, other)


def test_a_world_draws_the_same_beside_more_worlds():
    few, many = race(VariationConfig("strong"), 2), race(VariationConfig("strong"), 5)
    for world in (few, many):
        world.move_starts(np.zeros(world.spec.num_worlds))
        world.seen = drive(world, 40)
    assert all((a[:2] == b[:2]).all() for a, b in zip(few.seen[1::3], many.seen[1::3], strict=True))
    assert (few.variation == many.variation[:2]).all()


def test_a_saved_race_goes_on_as_it_would_have():
    world, buffers = race(VariationConfig("strong")), None
    buffers = allocate(world.spec)
    world.reset(buffers, 9)
    choices = np.random.default_rng(0).integers(0, 9, (60, 3, 1))
    for tick in range(25):
        world.step(choices[tick], buffers)
    state, shown = world.save_state(), []
    other, theirs = race(VariationConfig("strong")), allocate(world.spec)
    other.reset(theirs, 1)
    other.load_state(state, theirs)
    for tick in range(25, 60):
        for one, own in ((world, buffers), (other, theirs)):
            one.step(choices[tick], own)
            shown.append(own.observations[CAMERA_NAME].copy())
        assert (shown[-1] == shown[-2]).all()
        assert (world.reports == other.reports).all()
        assert (world.variation == other.variation).all()


def test_one_disturbance_moves_no_draw_of_another():
    both, one = race(VariationConfig("strong")), race(alone("gain"))
    for world in (both, one):
        drive(world, 3)
    assert (both.variation["gain"] == one.variation["gain"]).all()


def test_draws_lie_within_their_ranges_and_differ_from_episode_to_episode():
    world, kept = race(VariationConfig("strong"), 8), []
    buffers = allocate(world.spec)
    world.reset(buffers, 2)
    for _ in range(200):
        world.step(np.full((8, 1), 8), buffers)
        kept.append(world.variation.copy())
    drawn = np.array(kept).reshape(-1)
    names = {name: name for name in drawn.dtype.names if name in MOST} | {"gradient_x": "gradient"}
    for name, setting in names.items():
        middle = 1.0 if name in ("gain", "steering_gain", "speed_gain") else 0.0
        strays = np.abs(drawn[name] - middle)
        assert strays.max() <= MOST[setting] + 1e-12, name
        assert strays.max() > 0.6 * MOST[setting], name
        assert len(np.unique(drawn[name])) > (3 if name == "latency" else 8), name


# ---- the frame, by twins ---------------------------------------------------------------------------------------------


def start_frames(config, num_cars=6, bare=False, **options):
    """Frames at the starts without and with a disturbance, what was drawn, and the world.

    `bare`: dashes and start line have the colour of the road; then the frame is as it was drawn, not disturbed.
    """
    frames = []
    for world in (forced(VariationConfig(), num_cars=num_cars, **options), race(config, num_cars, **options)):
        buffers = allocate(world.spec)
        world.reset(buffers, 11)
        if bare:
            world._seeing.palettes[..., [DASH, START]] = world._seeing.palettes[..., [ROAD]]
            world._look_again(world._every_car, buffers)
        frames.append(buffers.observations[CAMERA_NAME][:, 0].copy())
    return *frames, world._varied.drawn[:, 0], world


def rounded(levels):
    return np.clip(np.floor(levels + 0.5), 0, 255)


def test_gain_and_gradient_are_exact_to_the_pixel():
    plain_, seen, drawn, _ = start_frames(VariationConfig(gain=0.5, gradient=0.4))
    u, v = (np.arange(WIDTH) + 0.5) / WIDTH * 2 - 1, (np.arange(HEIGHT) + 0.5) / HEIGHT * 2 - 1
    for frame, shown, one in zip(plain_, seen, drawn, strict=True):
        lit = frame * one["gain"] * (1 + one["gradient_x"] * u + one["gradient_y"] * v[:, None])
        near_half = np.abs(lit - np.floor(lit) - 0.5) < 1e-4
        assert (np.abs(shown - rounded(lit))[~near_half] == 0).all()
    assert (np.abs(seen.astype(int) - plain_) > 10).any(axis=(1, 2)).mean() > 0.6


def axes_of(camera, yaw):
    """Unit vectors ahead, left and up of a camera in the world, turned by matrices: yaw, then pitch, then roll."""
    pitch, roll = camera["pitch"], camera["roll"]
    turn = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    nose_down = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    lean_right = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    return (turn @ nose_down @ lean_right).T


def camera_of(world, one):
    mount = world.camera.mount
    view = mount.horizontal_view + one["camera_view"]
    return {
        "x": mount.x, "z": mount.z + one["camera_height"], "pitch": mount.pitch + one["camera_pitch"],
        "roll": mount.roll + one["camera_roll"], "focal": 0.5 * WIDTH / math.tan(view / 2),
    }  # fmt: skip


def cast(world, one, car, fine=4):
    """Return the frame (H, W) that rays find on the ground (NaN above it), `fine`² rays a pixel."""
    camera = camera_of(world, one)
    ahead, left, up = axes_of(camera, car["yaw"])
    u = (np.arange(WIDTH * fine) + 0.5) / fine - WIDTH / 2
    v = (np.arange(HEIGHT * fine) + 0.5) / fine - HEIGHT / 2
    rays = ahead - left * (u / camera["focal"])[None, :, None] - up * (v / camera["focal"])[:, None, None]
    eye = np.array([car["x"], car["y"], 0]) + camera["x"] * np.array([math.cos(car["yaw"]), math.sin(car["yaw"]), 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(rays[..., 2] < -0.03, -camera["z"] / rays[..., 2], np.nan)
    points = eye[:2] + rays[..., :2] * reach[..., None]
    flat = points.reshape(-1, 2)
    x0, y0, x1, y1 = world.track.field_bounds
    with np.errstate(invalid="ignore"):
        found = (flat[:, 0] > x0) & (flat[:, 0] < x1) & (flat[:, 1] > y0) & (flat[:, 1] < y1)
    levels = np.full(len(flat), np.nan)
    levels[found] = world.camera.scene.grey_palette[material_at(world.track, flat[found])]
    return levels.reshape(HEIGHT, fine, WIDTH, fine).mean((1, 3))


def material_at(track, points):
    """Name the material of ground points by distances to borders."""

    def distance(ring):
        step = np.diff(ring, axis=0)
        offset = points[:, None] - ring[:-1]
        share = np.clip((offset * step).sum(-1) / np.maximum((step * step).sum(-1), 1e-12), 0, 1)
        return np.sqrt(((offset - share[..., None] * step) ** 2).sum(-1)).min(1)

    to_border = np.minimum(distance(track.inner), distance(track.outer))
    side = {"inside": 1, "outside": -1}[track.look.line_side]
    in_line, on_road = to_border < track.look.line_width, track.contains(points)
    if side < 0:
        return np.where(on_road, ROAD, np.where(in_line, LINE, FIELD))
    return np.where(on_road, np.where(in_line, LINE, ROAD), FIELD)


@pytest.mark.parametrize("name", ["camera_height", "camera_pitch", "camera_roll", "camera_view", "all"])
def test_a_camera_that_sits_otherwise_sees_what_its_rays_hit(name):
    names = ["camera_height", "camera_pitch", "camera_roll", "camera_view"] if name == "all" else [name]
    most = {"camera_height": 0.05, "camera_pitch": 0.15, "camera_roll": 0.25, "camera_view": 0.3}
    config = VariationConfig(**{one: most[one] for one in names})
    plain_, seen, drawn, world = start_frames(config, 3, bare=True, type="TIME_TRIAL")
    for frame, shown, one, car in zip(plain_, seen, drawn, world.cars[:, 0], strict=True):
        twin = cast(world, one, car)
        known = np.isfinite(twin)
        assert known.sum() > 400
        difference = np.abs(shown - twin)[known]
        assert difference.mean() < 1.0
        assert np.percentile(difference, 99) < 12
        assert np.abs(frame - twin)[known].mean() > 2 * difference.mean()


@pytest.mark.parametrize("roll", [0.0, 0.3])
def test_a_glow_stands_where_the_pinhole_puts_it(roll):
    glowing = VariationConfig(glare=100.0, glare_width=0.25, camera_roll=roll)
    plain_, seen, drawn, world = start_frames(glowing, 24, type="TIME_TRIAL")
    if roll:  # the same cameras lean by the same angles, and nothing glows
        plain_ = start_frames(VariationConfig(camera_roll=roll), 24, type="TIME_TRIAL")[1]
    assert (drawn["camera_roll"] != 0.0).any() == (roll > 0.0)
    in_sight = 0
    for frame, shown, one, car in zip(plain_, seen, drawn, world.cars[:, 0], strict=True):
        camera = camera_of(world, one)
        far = [math.cos(one["glare_elevation"]) * math.cos(one["glare_azimuth"]),
               math.cos(one["glare_elevation"]) * math.sin(one["glare_azimuth"]),
               math.sin(one["glare_elevation"])]  # fmt: skip
        depth, left, up = axes_of(camera, car["yaw"]) @ far
        glow = np.zeros((HEIGHT, WIDTH))
        if depth > 0.1:
            x, y = WIDTH / 2 - camera["focal"] * left / depth, HEIGHT / 2 - camera["focal"] * up / depth
            spread = camera["focal"] * 0.25
            across, down = np.arange(WIDTH) + 0.5 - x, np.arange(HEIGHT) + 0.5 - y
            glow = one["glare"] * np.exp(-0.5 * (across**2 + down[:, None] ** 2) / spread**2)
        assert np.abs(shown - rounded(frame + glow)).max() <= 1
        in_sight += glow.max() > 10
    assert in_sight >= 2


def test_blur_is_a_gaussian_lens():
    plain_, seen, drawn, _ = start_frames(VariationConfig(blur=0.05))
    for frame, shown, one in zip(plain_, seen, drawn, strict=True):
        spread = one["blur"] * WIDTH
        reach = math.ceil(3 * spread)
        weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / spread) ** 2)
        weights /= weights.sum()
        padded = np.pad(frame.astype(float), reach, mode="edge")
        twin = np.zeros(frame.shape)
        for row in range(HEIGHT):
            for column in range(WIDTH):
                patch = padded[row : row + 2 * reach + 1, column : column + 2 * reach + 1]
                twin[row, column] = weights @ patch @ weights
        assert np.abs(shown - twin).max() < 0.51


def test_noise_has_its_spread_and_no_memory():
    plain_, seen, drawn, _ = start_frames(VariationConfig(noise=6.0), 12)
    strays = np.where((plain_ > 40) & (plain_ < 215), seen.astype(float) - plain_, np.nan)
    spreads = np.nanstd(strays, axis=(1, 2))
    spread = np.hypot(drawn["noise"], 1 / math.sqrt(12))  # and that of rounding
    np.testing.assert_allclose(spreads, spread, rtol=0.1, atol=0.1)
    assert abs(np.nanmean(strays)) < 0.15
    first, second = strays[0].ravel(), strays[1].ravel()
    both = np.isfinite(first) & np.isfinite(second)
    assert abs(np.corrcoef(first[both], second[both])[0, 1]) < 0.15


def test_noise_is_drawn_anew_in_every_frame():
    world, buffers = race(VariationConfig(noise=6.0), type="TIME_TRIAL"), None
    buffers = allocate(world.spec)
    world.reset(buffers, 1)
    first = buffers.observations[CAMERA_NAME].copy()
    world.step(np.full((3, 1), 4), buffers)  # the prepare tick: nobody moves
    assert (first != buffers.observations[CAMERA_NAME]).mean() > 0.2


def test_a_dropped_frame_shows_the_one_before_and_the_share_is_the_one_drawn():
    seen, plain_ = drive(race(VariationConfig(dropped_frames=0.8), 6), 120), drive(race(None, 6), 120)
    world = race(VariationConfig(dropped_frames=0.8), 6)
    drawn = []
    buffers = allocate(world.spec)
    world.reset(buffers, 5)
    choices = np.random.default_rng(7).integers(0, 9, (120, 64, 1))
    for tick in range(120):
        world.step(choices[tick, :6], buffers)
        drawn.append(world.variation["dropped_frames"].copy())
    before, dropped, expected = seen[0], 0, 0.0
    for tick in range(120):
        shown, last, told = seen[1 + 3 * tick : 4 + 3 * tick]
        plain_shown, plain_last, plain_told = plain_[1 + 3 * tick : 4 + 3 * tick]
        assert (told == plain_told).all(), "nothing but frames differs"
        for car in range(6):
            is_new = plain_last[car].any()  # the frame is the first of an episode
            assert (shown[car] == plain_shown[car]).all() or ((shown[car] == before[car]).all() and not is_new)
            assert (last[car] == plain_last[car]).all() or (last[car] == before[car]).all()
            if not is_new and (plain_shown[car] != before[car]).any():
                dropped += (shown[car] != plain_shown[car]).any()
                expected += drawn[tick][car, 0]
        before = shown
    assert expected > 50
    assert abs(dropped - expected) < 4 * math.sqrt(expected)


def test_a_palette_strays_in_every_colour_by_its_share():
    world = race(VariationConfig(palette=0.3), 8)
    drive(world, 1)
    plain_ = world.camera.scene.grey_palette
    share = world._varied.palettes[:, 0, : len(MATERIALS)] / plain_
    lightened = share[:, plain_ < 190]  # brighter ones may reach white
    assert 0.7 <= lightened.min() < 0.9
    assert 1.1 < lightened.max() <= 1.3 + 1e-9
    assert len(np.unique(np.round(lightened, 9))) == lightened.size, "each by itself"


def test_lamps_are_lamberts_law_of_the_originals_lights():
    """Twin: scalar sums of what shines from everywhere, of a sun as steep as the original's, and of a lamp 15 m up."""
    draws = np.random.default_rng(0).uniform(size=(5, 9))
    steep = {FIELD: 0.9, SKY - 1: 0.5, SKY - 4: 0.0}  # ground; the west wall's inner face; the south wall's
    norm = math.sqrt(0.5**2 + 0.1**2 + 0.9**2)
    for row, light in zip(draws, light_of_lamps(draws), strict=True):
        for material, facing in steep.items():
            for colour in range(3):
                lamp = row[3 + colour] / (row[6] + 15 * row[7] + 225 * row[8])
                shines = 0.5 + facing / norm * row[colour] + lamp
                own = 0.5 + facing / norm * (1.0, 1.0, 0.8)[colour] + 0.225 / (0.4 + 0.01 * 15)
                assert light[material, colour] == pytest.approx(shines / own)
        assert (light[SKY] == 1).all()


def test_boxes_have_a_colour_each_and_the_road_keeps_its_own():
    world = race(VariationConfig(object_colours=True), 4)
    drive(world, 1)
    drawn = world._varied.drawn[:, 0]
    greys = np.array([[drawn[f"grey_object_{k}"][n] for k in range(6)] for n in range(4)])
    assert len(np.unique(greys)) == greys.size
    np.testing.assert_allclose(drawn["grey_road"], world.camera.scene.grey_palette[ROAD])
    plain_, seen, _, _ = start_frames(VariationConfig(object_colours=True), 6)
    changed = np.abs(seen.astype(int) - plain_) > 3
    assert changed.any()
    assert changed.mean() < 0.2, "only boxes"


# ---- how the car answers ---------------------------------------------------------------------------------------------


def test_a_late_command_acts_exactly_so_many_ticks_later():
    """By law: a car whose commands are k ticks under way stands k ticks, then drives as the other did."""
    config = VariationConfig(latency=0.4)
    choices = np.random.default_rng(3).choice([0, 3, 6], (30, 64, 1))
    late = race(config, 8, type="TIME_TRIAL", max_episode_seconds=20)
    plain_ = race(None, 8, type="TIME_TRIAL", max_episode_seconds=20)
    one, other = drive(late, 30, actions=choices), drive(plain_, 30, actions=choices)
    ticks = np.rint(late.variation["latency"][:, 0] / TICK_SECONDS).astype(int)
    assert {0, 6} <= set(ticks.tolist()) or len(set(ticks.tolist())) > 3
    poses, plain_poses = np.array(one[3::3])[:, :4, :, 0], np.array(other[3::3])[:, :4, :, 0]
    for car, k in enumerate(ticks):
        np.testing.assert_allclose(poses[k:, :3, car], plain_poses[: 30 - k, :3, car], rtol=0, atol=1e-12)
        np.testing.assert_allclose(poses[: k + 1, :3, car], poses[:1, :3, car].repeat(k + 1, 0), rtol=0, atol=1e-12)


def test_commands_reach_the_wheels_by_gain_offset_and_speed():
    world = race(VariationConfig(steering_gain=0.4, steering_offset=0.2), 6)
    drive(world, 4)
    chosen = np.tile(np.array([[-0.3, 1.7]]), (6, 1, 1))
    sent, drawn = world._varied.send(world.cars, chosen), world._varied.drawn
    np.testing.assert_allclose(sent[..., 0], -0.3 * drawn["steering_gain"] + drawn["steering_offset"])
    assert (sent[..., 1] == 1.7).all()


def test_commands_stray_with_their_spread():
    world = race(VariationConfig(steering_noise=0.2, speed_noise=0.2), 4, type="TIME_TRIAL")
    buffers = allocate(world.spec)
    world.reset(buffers, 8)
    chosen, strays = np.tile(np.array([[0.1, 2.0]]), (4, 1, 1)), []
    cars = world.cars
    for tick in range(4000):
        cars["total_ticks"] = tick
        strays.append(world._varied.send(cars, chosen) - chosen)
    spread, drawn = np.std(strays, axis=0)[:, 0], world._varied.drawn[:, 0]
    np.testing.assert_allclose(spread[:, 0], drawn["steering_noise"], rtol=0.05)
    np.testing.assert_allclose(spread[:, 1] / 2.0, drawn["speed_noise"], rtol=0.05)
    assert np.abs(np.mean(strays, axis=0)).max() < 0.03


@pytest.mark.parametrize("car", ["v4", "v6"])
def test_a_car_answers_by_the_numbers_drawn(car):
    world = race(VariationConfig(steering_lag=0.3, speed_gain=0.3, slip=0.5), 6, car=car)
    drive(world, 1)
    base, answered, drawn = PROFILES[car], world._varied.profiles, world._varied.drawn
    np.testing.assert_allclose(answered["steering_lag"], base.steering_lag + drawn["steering_lag"])
    np.testing.assert_allclose(answered["speed_gain"], base.speed_gain * drawn["speed_gain"])
    np.testing.assert_allclose(1 / answered["grip"], 1 / base.grip + drawn["slip"])
    assert (world.profiles["grip"] == base.grip).all(), "what is common to all stays as it was"


def test_grip_that_falls_widens_the_curve():
    """By law: with 1 / slip m/s² to hold it, a fast car turns less than with all the grip there is."""
    turned = []
    for config in (None, VariationConfig(slip=2.0)):
        world = race(config, 8, type="TIME_TRIAL", max_episode_seconds=20)
        seen = drive(world, 7, actions=np.full((7, 64, 1), 8))
        yaw = np.unwrap(np.array(seen[3::3])[:, 2, :, 0], axis=0)
        turned.append(yaw[-1] - yaw[0])
    assert (turned[1] < turned[0] - 1e-3).mean() >= 0.8


# ---- words and numbers -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: VariationConfig("stong"), "Did you mean 'strong'?"),
        (lambda: VariationConfig(latency=0.02), "less than half a tick"),
        (lambda: VariationConfig(glare_width=0.0099), "0.01 to 1"),
        (lambda: disturbances_of("strongest"), "no level of variation 'strongest'"),
        (lambda: only("strong", ["glair"]), "Did you mean 'glare'?"),
    ],
)
def test_what_cannot_be_is_named(make, words):
    with pytest.raises(SettingError, match=re.escape(words)):
        make()


def test_what_may_stray_either_way_does():
    """Of 32 cars about half have more and half less; one that strays one way only would have none."""
    world = race(VariationConfig("strong"), num_cars=32)
    drive(world, 1)
    middles = dict.fromkeys(("gain", "steering_gain", "speed_gain"), 1.0)
    for name in (
        *middles, "gradient_x", "gradient_y", "camera_height", "camera_pitch", "camera_roll", "camera_view",
        "steering_offset", "glare_azimuth",
    ):  # fmt: skip
        drawn = world.variation[name].reshape(-1) - middles.get(name, 0.0)
        assert 6 < (drawn > 0.0).sum() < 26, name
        assert 6 < (drawn < 0.0).sum() < 26, name


def test_only_some_disturbances_are_as_their_level_has_them():
    one = only("strong", ["object-colours", "action-noise"])
    assert (one.level, one.object_colours, one.lamps) == ("off", True, False)
    stray = {name for name, amount in one.amounts.items() if amount}
    assert stray == {"object_colours", "steering_noise", "speed_noise"}
    assert only("light", ["lamps"]).lamps is False, "light has none"


def test_a_level_names_its_disturbances_and_those_of_objects_only_where_there_are_any():
    assert disturbances_of("aws") == ["lamps", "object-colours"]
    assert disturbances_of("light") == [name for name in DISTURBANCES if name not in ("lamps", "object-colours")]
    assert disturbances_of("strong") == [name for name in DISTURBANCES if name != "lamps"]
    assert disturbances_of("strong", has_objects=False) == disturbances_of("light")
