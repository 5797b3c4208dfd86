"""The light of three years, held to grey levels read from the original's frames."""

from dataclasses import replace

import numpy as np
import pytest

from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.camera import MOUNT_V3, Camera
from racecraft.worlds.deepracer.env.light import LIGHTS, light_for, palette_under
from racecraft.worlds.deepracer.env.objects import KINDS
from racecraft.worlds.deepracer.env.scene import DASH, FIELD, LINE, MATERIALS, ROAD, SKY, build_scene
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.style import TrackStyle

WALLS = slice(5, 9)
ACTIONS = ActionTable.of([(0.1, 1.0), (-0.1, 1.0)])

MEASURED = {
    ("reInvent2019_track", "2021"): {
        "sky": 174, "wall south": 74, "wall east": 74, "wall north": 74, "wall west": 74,
        "field": 146, "road": 74, "dash": 176, "line": 255,
    },
    ("reInvent2019_track", "2026"): {
        "sky": 178, "wall south": 65, "wall east": 65, "wall north": 65, "wall west": 65,
        "field": 129, "road": 66, "dash": 161, "line": 240,
    },
    ("reinvent_base", "2021"): {
        "sky": 178, "wall south": 1, "wall east": 12, "wall north": 13, "wall west": 24,
        "field": 125, "road": 48, "dash": 134, "line": 205,
    },
    ("reinvent_base", "2019"): {
        "wall south": 0, "wall east": 53, "wall north": 60, "wall west": 24,
        "field": 123, "road": 49, "dash": 154, "line": 232,
    },
}  # fmt: skip
"""Medians over frames of those years (facts: generations; 2019: 23 of the 92 workshop frames, poses fitted)."""


@pytest.mark.parametrize(("track", "year"), MEASURED)
def test_every_material_has_the_level_that_the_frames_of_the_year_show(track, year):
    grey = build_scene(load_track(track), year).grey_palette
    for material, level in MEASURED[track, year].items():
        assert grey[MATERIALS.index(material)] == pytest.approx(level, abs=10), material


@pytest.mark.parametrize(("car", "year"), [("v4", "2021"), ("v5-classic", "2021"), ("v6", "2026")])
def test_a_race_has_the_light_of_its_cars_simulator(car, year):
    world = RaceWorld(load_track("reInvent2019_track"), ACTIONS, race_config=RaceConfig(car=car))
    expected = build_scene(load_track("reInvent2019_track"), year).grey_palette
    assert (world.camera.scene.grey_palette == expected).all()
    asked = RaceWorld(
        load_track("reInvent2019_track"), ACTIONS, race_config=RaceConfig(car=car),
        camera_config=CameraConfig(light="2019"),
    )  # fmt: skip
    assert asked.camera.scene.grey_palette[FIELD] > 1.08 * expected[FIELD]


def test_the_black_south_wall_stands_in_the_re_invent_world_alone():
    for year in LIGHTS:
        walls = build_scene(load_track("Oval_track"), year).grey_palette[WALLS]
        assert np.ptp(walls) == 0.0
    assert np.ptp(build_scene(load_track("reinvent_base"), "2026").grey_palette[WALLS]) == 0.0
    assert build_scene(load_track("reinvent_base"), "2019").grey_palette[5] == 0.0


def test_no_wall_is_black_to_people():
    for year in LIGHTS:
        scene = build_scene(load_track("reinvent_base"), year, for_people=True)
        assert (scene.grey_palette[WALLS] > 55).all()
        assert (scene.grey_palette[:5] == build_scene(load_track("reinvent_base"), year).grey_palette[:5]).all()


def test_light_for_names_a_year_for_every_car():
    for car in ("v4", "v5-classic", "v6", "kinematic"):
        assert light_for("car", car) in LIGHTS
        assert light_for("2019", car) == "2019"


@pytest.fixture(scope="module")
def grass_frames():
    """Return frames from beside the road, plain and with grass, and where only field is seen."""
    track = load_track("reInvent2019_track")
    poses = np.array([track.pose_at(arc) for arc in (2.0, 9.0, 16.0)]) + [0.0, 0.0, 0.7]
    plain, grown = (Camera(build_scene(track, "2021", grass), 160, 120) for grass in (False, True))
    only_field = np.zeros(len(MATERIALS))
    only_field[FIELD] = 255
    return plain.render_grey(poses), grown.render_grey(poses), plain.render_grey(poses, palettes=only_field) == 255


def test_grass_spreads_as_much_as_the_originals_and_keeps_its_mean(grass_frames):
    """Facts: 6 to 7 grey levels."""
    plain, grown, field = grass_frames
    assert field.sum() > 2000
    assert 5.5 < grown[field].std() < 7.5
    assert grown[field].mean() == pytest.approx(plain[field].mean(), abs=0.5)


def test_grass_grows_on_the_field_alone(grass_frames):
    plain, grown, _ = grass_frames
    changed = plain != grown
    level = np.round(build_scene(load_track("reInvent2019_track"), "2021").grey_palette[FIELD])
    assert (np.abs(plain[changed] - level) <= 1).all()
    assert changed.any()


def test_grass_stands_still_while_cars_pass():
    """A spot has one shade: two cars at one pose see the same, and a frame is the same frame twice."""
    track = load_track("reInvent2019_track")
    camera = Camera(build_scene(track, "2021", has_grass=True), 80, 60)
    frames = camera.render_grey(np.tile(track.pose_at(5.0), (3, 1)))
    assert (frames[0] == frames[1]).all()
    assert (frames[0] == frames[2]).all()


def test_grass_grows_for_a_camera_that_hardly_leans_as_for_one_that_does_not_lean():
    """By twin: what leans has a kernel of its own. A spot may change its shade by a level where digits end."""
    track = load_track("reInvent2019_track")
    scene = build_scene(track, "2021", has_grass=True)
    pose = np.array([track.pose_at(9.0)]) + [0.0, 0.0, 0.7]
    upright, leaning = (Camera(scene, 160, 120, replace(MOUNT_V3, roll=roll)).render_grey(pose) for roll in (0.0, 1e-9))
    apart = np.abs(upright.astype(int) - leaning)
    assert apart.max() <= 1
    assert (apart > 0).mean() < 0.01


def test_a_setting_sows_the_grass():
    for grass in (False, True):
        world = RaceWorld(load_track("Oval_track"), ACTIONS, camera_config=CameraConfig(grass=grass))
        assert (world.camera.scene.grass > 0.0) == grass


def test_lines_dashes_and_road_grow_darker_from_year_to_year():
    levels = np.array([build_scene(load_track("Oval_track"), year).grey_palette for year in ("2019", "2021", "2026")])
    assert (np.diff(levels[:, [FIELD, ROAD, DASH]], axis=0) < 0).all()
    assert (np.diff(levels[:, LINE]) <= 0).all()
    assert (levels[1:, SKY] > 170).all()


def test_every_material_has_its_texture_under_its_own_light():
    """By hand: white textures show the shares alone. Grey levels of the sky as in the frames: 174 and 178."""
    white = TrackStyle(**{name: (100, 100, 100) for name in ("road", "line", "dash", "field", "wall", "start")})
    for year, sun, walls, sky in (("2019", 1.31, 1.31, None), ("2021", 1.175, 1.21, 174), ("2026", 1.06, 1.06, 178)):
        found = palette_under(year, white)
        lit = [100 * sun, 100 * sun, 98 * sun]
        np.testing.assert_allclose(found[:5], [lit] * 5, err_msg=year)
        np.testing.assert_allclose(found[WALLS], 100 * walls, err_msg=year)
        np.testing.assert_allclose(found[SKY], 100 * walls if sky is None else sky, err_msg=year)
        for kind, shown in zip(KINDS, found[SKY + 1 :], strict=True):
            expected = np.minimum(np.array(kind.colour) * [sun, sun, 0.98 * sun], 255)
            np.testing.assert_allclose(shown, expected, err_msg=f"{kind.name} in {year}")


def test_nothing_is_brighter_than_white():
    assert palette_under("2019", TrackStyle()).max() == 255.0


def test_the_hall_of_re_invent_shows_its_carpet_as_the_frames_of_each_year_have_it():
    """2026: nobody recorded the hall. Its ground and paint are those of 2021, darker as other circuits' are."""
    white = TrackStyle(**{name: (100, 100, 100) for name in ("road", "line", "dash", "field", "wall", "start")})
    hall = {year: palette_under(year, white, "reinvent_base") for year in LIGHTS}
    elsewhere = {year: palette_under(year, white) for year in LIGHTS}
    darker = elsewhere["2026"][ROAD, 0] / elsewhere["2021"][ROAD, 0]
    np.testing.assert_allclose(hall["2026"][:5], hall["2021"][:5] * darker, atol=0.6)
    np.testing.assert_allclose(hall["2019"][[FIELD, ROAD]], hall["2021"][[FIELD, ROAD]])
    np.testing.assert_allclose(hall["2021"][FIELD], [104, 104, 105])
    np.testing.assert_allclose(hall["2019"][LINE], 120)
    np.testing.assert_allclose(hall["2021"][WALLS], [[share] * 3 for share in (1.6, 20, 21, 39)])
    np.testing.assert_allclose(hall["2019"][WALLS], [[share] * 3 for share in (0, 82, 96, 44)])
    np.testing.assert_allclose(hall["2026"][WALLS], elsewhere["2026"][WALLS])
    np.testing.assert_allclose(hall["2019"][SKY], 100, err_msg="the colour of the walls goes on, unlit")
    np.testing.assert_allclose(hall["2021"][SKY], 178)
    np.testing.assert_allclose(hall["2026"][SKY], 178)


def test_to_people_a_hall_has_the_walls_of_every_other_circuit():
    hall, plain = (palette_under("2021", TrackStyle(), name, for_people=True) for name in ("reinvent_base", ""))
    assert (hall[WALLS] == plain[WALLS]).all()
    assert (hall[FIELD] != plain[FIELD]).any()
