"""The light of three years, held to grey levels read from the original's frames."""

import numpy as np
import pytest

from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.camera import Camera
from racecraft.worlds.deepracer.env.light import LIGHTS
from racecraft.worlds.deepracer.env.scene import FIELD, MATERIALS, build_scene
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

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


def test_no_wall_is_black_to_people():
    for year in LIGHTS:
        scene = build_scene(load_track("reinvent_base"), year, for_people=True)
        assert (scene.grey_palette[WALLS] > 55).all()
        assert (scene.grey_palette[:5] == build_scene(load_track("reinvent_base"), year).grey_palette[:5]).all()


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


def test_a_setting_sows_the_grass():
    for grass in (False, True):
        world = RaceWorld(load_track("Oval_track"), ACTIONS, camera_config=CameraConfig(grass=grass))
        assert (world.camera.scene.grass > 0.0) == grass
