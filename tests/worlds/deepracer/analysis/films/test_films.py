"""Films from outside the car: what is where in the picture, when it was taken, and what cannot be filmed."""

import math

import av
import numpy as np
import pytest
from PIL import Image

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.analysis.drive import Drive
from racecraft.worlds.deepracer.analysis.films import figures
from racecraft.worlds.deepracer.analysis.films.film import SIZES, FilmStyle, OtherCar, write_film
from racecraft.worlds.deepracer.analysis.films.moments import HELD_SECONDS, moments
from racecraft.worlds.deepracer.analysis.films.shells import COLOURS, SHELLS, shell_named
from racecraft.worlds.deepracer.analysis.films.solids import CameraPose, paint_car
from racecraft.worlds.deepracer.analysis.films.standing import filmed_objects
from racecraft.worlds.deepracer.analysis.films.top import TopMap
from racecraft.worlds.deepracer.analysis.films.tower import Standings, Tower
from racecraft.worlds.deepracer.analysis.films.views import CHASE, VIEWS, FilmContext, FilmedCar, _pose
from racecraft.worlds.deepracer.env.camera import MOUNT_V3
from racecraft.worlds.deepracer.env.light import palette_under
from racecraft.worlds.deepracer.env.objects import BOT_CAR, BOX, KINDS
from racecraft.worlds.deepracer.env.scene import MATERIALS
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS


@pytest.fixture(scope="module")
def drive(reports_along):
    return Drive.from_reports(reports_along(40, share=0.3))


def stage(track, *cars, objects=None):
    taken = [moments(one, 15) for one in cars]
    filmed = [FilmedCar(one, shell_named()) for one in taken]
    return FilmContext(track, "2026", MOUNT_V3, filmed, filmed_objects(objects, taken[0]))


def box_beside(drive, ahead, kind=BOX, tick=20):
    """Return a box that stands so many metres ahead of where the car is at a tick, as long as the drive lasts."""
    x, y, yaw = drive.poses[tick]
    built = KINDS[kind]
    box = [x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), yaw, built.length / 2, built.width / 2, built.height]
    return np.tile(box, (len(drive), 1, 1)), np.full((len(drive), 1), kind)


def painted(track, drive, view="chase", objects=None, size=(640, 480)):
    picture = np.zeros((size[1], size[0], 3), np.uint8)
    VIEWS[view](stage(track, drive, objects=objects), *size).paint(20, picture)
    return picture


def seen_through(mount, ahead, height, size=(640, 480)):
    """Return row and column at which a pinhole has a point straight ahead of the car."""
    dx, dz = ahead - mount.x, height - mount.z
    depth = dx * math.cos(mount.pitch) - dz * math.sin(mount.pitch)
    down = -dx * math.sin(mount.pitch) - dz * math.cos(mount.pitch)
    focal = size[0] / 2 / math.tan(mount.horizontal_view / 2)
    return round(size[1] / 2 + focal * down / depth), size[0] // 2


def area_of(face):
    """Return the area of a plane polygon (P, 3) as a vector along its normal."""
    return sum(np.cross(face[k] - face[0], face[k + 1] - face[0]) / 2 for k in range(1, len(face) - 1))


@pytest.mark.parametrize("name", SHELLS)
def test_a_shell_fills_the_originals_box_and_is_closed(name):
    """Every face looks outward (a convex part's faces sum to no area), within the box of the facts, 1.1."""
    shell = shell_named(name)
    corners = np.concatenate(shell.faces)
    assert (np.abs(corners[:, 0]) <= 0.1665).all()
    assert (np.abs(corners[:, 1]) <= 0.0985).all()
    assert corners[:, 2].min() >= -1e-12
    assert corners[:, 2].max() <= 0.195
    areas = [area_of(face) for face in shell.faces]
    np.testing.assert_allclose(np.sum(areas, axis=0), 0.0, atol=1e-9)
    volume = sum(face.mean(axis=0) @ area for face, area in zip(shell.faces, areas, strict=True)) / 3
    assert volume > 0.0, "faces turned inside out would have it negative"


def test_a_car_is_painted_where_the_pinhole_has_it():
    """Straight below an eye that looks down, 0.324 m are focal / height pixels."""
    picture = np.full((400, 400, 3), 200, np.uint8)
    paint_car(picture, CameraPose(2.0, 3.0, 10.0, math.pi / 2, math.pi / 2, 5000.0), shell_named(), (2.0, 3.0, 0.0))
    red = (picture[..., 0] > 120) & (picture[..., 1] < 90)
    rows, columns = np.nonzero(red)
    assert columns.max() - columns.min() == pytest.approx(0.324 * 500, abs=6), "it heads east: to the right"
    assert (columns.max() + columns.min()) / 2 == pytest.approx(200, abs=5)
    assert (rows.max() + rows.min()) / 2 == pytest.approx(200, abs=3)


def test_what_lies_behind_the_eye_is_not_painted():
    picture = np.full((100, 100, 3), 200, np.uint8)
    paint_car(picture, CameraPose(0.0, 0.0, 0.5, 0.0, 0.2, 100.0), shell_named(), (-2.0, 0.0, 0.0))
    assert (picture == 200).all()


@pytest.mark.parametrize(("view", "mount"), [("chase", CHASE), ("car", MOUNT_V3)])
@pytest.mark.parametrize("kind", [BOX, BOT_CAR])
def test_a_box_is_seen_where_the_pinhole_has_it_in_its_colour(track, drive, view, mount, kind):
    """The middle of the side that faces the camera, a metre ahead of the car: the light on a side is 0.8 to 1.1."""
    picture = painted(track, drive, view, box_beside(drive, 1.0, kind))
    at = seen_through(mount, 1.0 - KINDS[kind].length / 2, KINDS[kind].height / 2)
    paint = palette_under("2026", track.look, track.name, for_people=True)[MATERIALS.index(KINDS[kind].name)]
    light = picture[at] / paint
    assert 0.8 < light.mean() < 1.1
    assert np.ptp(light) < 0.03, "one light on all three colours"
    assert (picture[at] != painted(track, drive, view)[at]).any()


def test_a_car_hides_a_box_behind_it_and_is_hidden_by_one_before_it(track, drive):
    """Seen from behind, at a wheel's foot and at a box's: the nearer thing is painted last."""

    def red(picture):
        return int(((picture[..., 0] > 100) & (picture[..., 1] < 80) & (picture[..., 2] < 80)).sum())

    free, before, behind = (
        red(painted(track, drive, objects=objects))
        for objects in (None, box_beside(drive, 0.4), box_beside(drive, -0.4))
    )
    assert free > 500
    assert before == pytest.approx(free, rel=0.01), "the box stands beyond the car: only soft edges differ"
    assert behind < 0.8 * free


def test_boxes_from_above_are_true_to_scale(track, drive):
    """0.4 by 0.3 m, enlarged as much as the car beside it."""
    boxes, kinds = box_beside(drive, 1.5)
    view = TopMap(track, "2026", 800, 600, figures.strip_height(800, 600))
    brown = palette_under("2026", track.look, track.name, for_people=True)[MATERIALS.index("box_obstacle")]
    for name, size, inset in (("top", (800, 600), None), ("pip", (640, 480), (192, 144))):
        picture = painted(track, drive, name, (boxes, kinds), size)
        if inset is not None:
            edge = round(0.02 * size[0])
            picture = picture[edge : edge + inset[1], size[0] - edge - inset[0] : size[0] - edge]
            view = TopMap(track, "2026", *inset)
        column, row = view.pixels(boxes[0, :, :2])[0].round().astype(int)
        np.testing.assert_allclose(picture[row, column], brown, atol=1)
        scale = np.diff(view.pixels(np.array([[0.0, 0.0], [1.0, 0.0]]))[:, 0])[0]
        enlarged = max(1.0, 22 / (0.324 * scale))
        covered = (np.abs(picture - brown.round()) <= 1).all(-1).sum()
        assert covered == pytest.approx(0.4 * 0.3 * (enlarged * scale) ** 2, rel=0.25)


def test_a_bot_moves_evenly_between_ticks_and_a_box_placed_anew_does_not_slide(drive):
    boxes, kinds = box_beside(drive, 1.0, BOT_CAR)
    boxes[:, 0, 0] = 0.1 * np.arange(40) + np.where(np.arange(40) >= 20, 5.0, 0.0)
    x = filmed_objects((boxes, kinds), moments(drive, 60)).boxes[:156, 0, 0]
    steps = np.diff(x)
    np.testing.assert_allclose(steps[:76], 0.025, atol=1e-9)
    assert (steps > 4.0).sum() == 1


def test_a_bot_turns_the_short_way_where_its_heading_runs_over_west(drive):
    boxes, kinds = box_beside(drive, 1.0, BOT_CAR)
    boxes[:, 0, 2] = np.where(np.arange(40) % 2 == 0, 3.1, -3.1)
    yaw = filmed_objects((boxes, kinds), moments(drive, 60)).boxes[:150, 0, 2]
    assert np.cos(yaw).max() < -0.999


def test_the_top_view_is_true_to_scale(track):
    view = TopMap(track, "2026", 800, 600)
    x0, y0, x1, y1 = track.bounds
    corners = view.pixels(np.array([[x0, y0], [x1, y1]]))
    shares = np.abs(corners[1] - corners[0]) / (800, 600)
    assert shares.max() == pytest.approx(1 / 1.25), "a quarter of room, as the original's camera"
    pose = track.pose_at(3.0)
    picture = view.picture.copy()
    view.paint_car(picture, shell_named(), tuple(pose))
    rows, columns = np.nonzero(np.abs(picture.astype(int) - view.picture).sum(-1) > 60)
    np.testing.assert_allclose((columns.mean(), rows.mean()), view.pixels(np.array([pose[:2]]))[0], atol=3)


def test_the_leader_stands_on_top_of_the_tower_beside_its_colour():
    paints = tuple(COLOURS[name] for name in ("Purple", "Orange", "Blue"))
    tower = Tower(Standings(np.array([[2, 1, 3], [1, 2, 2]]), ("own", "first", "last"), paints), 960, 540)
    strip = figures.strip_height(960, 540)
    row = round(0.36 * strip)
    for tick, order in ((0, (1, 0, 2)), (1, (0, 1, 2)), (9, (0, 1, 2))):  # behind its end a race stays as it was
        picture = np.full((540, 960, 3), 200, np.uint8)
        tower.draw_on(tick, picture)
        chips = [tuple(picture[2 * strip + k * row + row // 2, round(0.02 * 960) + 1].tolist()) for k in range(3)]
        assert chips == [paints[car] for car in order]
        assert (picture[: 2 * strip] == 200).all(), "a banner has its place above"
        own = order.index(0)
        inks = [picture[2 * strip + k * row : 2 * strip + (k + 1) * row, 60:200].max() for k in range(3)]
        assert int(np.argmax(inks)) == own, "the filmed car's name is the bright one"


def test_between_ticks_a_car_moves_evenly(drive):
    taken = moments(drive, 60)
    assert len(taken) == math.floor(39 * TICK_SECONDS * 60 + 1e-9) + 1 + HELD_SECONDS * 60
    np.testing.assert_allclose(taken.poses[0:156:4], drive.poses[:39], atol=1e-9)
    np.testing.assert_allclose(taken.poses[2], (drive.poses[0] + drive.poses[1]) / 2, atol=1e-3)
    steps = np.hypot(*np.diff(taken.poses[:150, :2], axis=0).T)
    assert steps.max() < 1.6 * steps.mean()


def test_a_car_that_is_set_down_elsewhere_does_not_slide(drive):
    columns = {name: getattr(drive, name) for name in drive.__dataclass_fields__}
    moved = Drive(**columns | {"x_m": drive.x_m + np.where(np.arange(40) >= 20, 3.0, 0.0)})
    x = moments(moved, 60).poses[:, 0]
    gaps = np.abs(np.diff(x))
    assert (gaps > 2.5).sum() == 1


def first(drive, ticks):
    columns = {name: getattr(drive, name) for name in drive.__dataclass_fields__}
    return Drive(**{name: None if column is None else column[:ticks] for name, column in columns.items()})


def changed(drive, **columns):
    return Drive(**{name: getattr(drive, name) for name in drive.__dataclass_fields__} | columns)


def test_the_camera_behind_follows_a_heading_that_runs_over_west_the_short_way(drive):
    turned = changed(drive, yaw_rad=np.where(np.arange(40) % 2 == 0, 3.1, -3.1))
    assert np.cos(moments(turned, 30).chase_yaw).max() < -0.99


def test_the_camera_behind_is_behind_at_once_where_its_car_was_set_down_elsewhere(drive):
    behind = np.arange(40) >= 20
    moved = changed(drive, x_m=drive.x_m + 3.0 * behind, yaw_rad=1.5 * behind)
    taken = moments(moved, 15)
    assert taken.chase_yaw[20] == 1.5
    assert np.abs(taken.chase_yaw[:20]).max() < 1e-9


def test_its_own_camera_sees_the_others_and_not_the_car_itself(track, drive):
    taken = moments(drive, 15)
    other = moments(changed(drive, x_m=drive.x_m + np.cos(drive.yaw_rad), y_m=drive.y_m + np.sin(drive.yaw_rad)), 15)
    pictures = {}
    for own in ("Red", "Blue"):
        for others in (False, True):
            cars = [FilmedCar(taken, shell_named("deepracer", own))]
            cars += [FilmedCar(other, shell_named("deepracer", "White"))] * others
            pictures[own, others] = np.zeros((240, 320, 3), np.uint8)
            stood = FilmContext(track, "2026", MOUNT_V3, cars, filmed_objects(None, taken))
            VIEWS["car"](stood, 320, 240).paint(20, pictures[own, others])
    np.testing.assert_array_equal(pictures["Red", True], pictures["Blue", True])
    assert (pictures["Red", True] != pictures["Red", False]).any()


def test_a_car_whose_drive_is_over_stays_where_it_is(track, drive):
    """In the film of a longer drive: at its last pose, not back at its first."""
    short = first(drive, 10)
    car = FilmedCar(moments(short, 15), shell_named())
    np.testing.assert_array_equal(_pose(car, len(car.moments) + 7), moments(short, 15).poses[-1])


@pytest.mark.parametrize("view", VIEWS)
def test_a_film_of_every_view_with_its_strip(tmp_path, track, drive, view, monkeypatch):
    monkeypatch.setattr("racecraft.worlds.deepracer.analysis.films.moments.HELD_SECONDS", 0.2)
    style = FilmStyle(view, "480p", 15, "f1_car_12", name="Ada")
    heard, short = [], first(drive, 8)
    film, strip = write_film(
        tmp_path / "race.mp4", short, track, style, others=[OtherCar(short)], count=lambda *told: heard.append(told)
    )
    whole = 8 + 3
    assert heard == [(number, whole) for number in range(1, whole + 1)]
    with av.open(str(film)) as container:
        stream = container.streams.video[0]
        assert (stream.average_rate, stream.width, stream.height) == (15, *SIZES["480p"])
        assert sum(1 for _ in container.decode(stream)) == whole
    with Image.open(strip) as stills:
        assert stills.size == (4 * 320, 3 * 240)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["race-strip.png", "race.mp4"]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"view": "side"}, "no view 'side'"),
        ({"fps": 10}, "10 pictures a second: expected 15 to 60"),
        ({"shell": "f1_car_99"}, "no body shell 'f1_car_99'"),
    ],
)
def test_what_cannot_be_filmed_is_named(wrong, words):
    with pytest.raises(UserInputError, match=words):
        FilmStyle(**wrong)
