"""Films decode back to what was driven, play in browsers, and arrive whole."""

import errno

import av
import numpy as np
import pytest

from racecraft.analysis.video import VideoError
from racecraft.contract.errors import UserInputError
from racecraft.formats.atomic import OutputFileError
from racecraft.worlds.deepracer.analysis import lap_film
from racecraft.worlds.deepracer.analysis.dashboard import BAD, BANNER_FOOT, GOOD
from racecraft.worlds.deepracer.analysis.drive import Drive
from racecraft.worlds.deepracer.env import race

BANNER_ROW, BANNER_COLUMN = lap_film.HEIGHT - BANNER_FOOT - 6, 30


def boxes(path):
    """Return the names of an MP4's outermost boxes, in order."""
    data, at, names = path.read_bytes(), 0, []
    while at < len(data):
        names.append(data[at + 4 : at + 8].decode())
        at += int.from_bytes(data[at : at + 4], "big")
    return names


def test_a_film_is_h264_for_browsers_and_has_a_picture_a_tick(tmp_path, track, reports_along):
    path = lap_film.write_video(tmp_path / "lap.mp4", Drive.from_reports(reports_along(35)), track, title="Best lap")
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert stream.average_rate == 15
    assert len(pictures) == 35 + lap_film.HELD_PICTURES
    assert pictures[0].shape == (lap_film.HEIGHT, lap_film.WIDTH, 3)
    assert boxes(path).index("moov") < boxes(path).index("mdat")
    assert [entry.name for entry in tmp_path.iterdir()] == ["lap.mp4"]
    assert np.abs(pictures[-1][BANNER_ROW, BANNER_COLUMN].astype(int) - GOOD).max() < 12


def test_the_view_is_the_cars_own_and_the_banner_tells_how_it_ended(track, reports_along):
    drive = Drive.from_reports(reports_along(20, race.OFF_TRACK, share=0.2))
    pictures = [picture.copy() for picture in lap_film.film(drive, track)]
    assert len(pictures) == 20 + lap_film.HELD_PICTURES
    camera = lap_film.Camera(
        lap_film.build_scene(track, "2026", for_people=True), lap_film.VIEW_WIDTH, lap_film.VIEW_HEIGHT
    )
    expected = camera.render_rgb(drive.poses[7:8])[0]
    assert (pictures[7][:, : lap_film.VIEW_WIDTH] == expected).all()
    assert tuple(pictures[18][BANNER_ROW, BANNER_COLUMN]) != BAD
    assert tuple(pictures[19][BANNER_ROW, BANNER_COLUMN]) == BAD
    assert (pictures[19] == pictures[-1]).all()


def test_the_first_full_lap_is_a_ghost_beside_the_best_one_and_waits_at_its_end(track, reports_along):
    """The best lap takes 60 ticks. The earlier one is 40 ticks over half the way, so it is there before and stands."""
    best, ghost = (Drive.from_reports(reports_along(ticks, share=share)) for ticks, share in ((60, 1.0), (40, 0.5)))
    dashboard = lap_film.Dashboard(track, best, "", lap_film.PANEL_WIDTH, lap_film.HEIGHT, ghost=ghost)
    panel = np.empty((lap_film.HEIGHT, lap_film.PANEL_WIDTH, 3), np.uint8)

    places = np.rint(dashboard._map.pixels(ghost.xy)).astype(int) + [dashboard._map_left, dashboard._map_top]
    for tick, row, elsewhere in ((20, 20, 39), (39, 39, 20), (59, 39, 20)):
        dashboard.draw(tick, panel)
        shown = [tuple(panel[y, x]) == BAD for x, y in places[[row, elsewhere]]]
        assert shown == [True, False]


def test_a_full_disk_is_told_and_leaves_the_old_film(tmp_path, track, reports_along, monkeypatch):
    path = tmp_path / "lap.mp4"
    path.write_bytes(b"old")

    def full(*_args, **_more):
        raise av.error.OSError(errno.ENOSPC, "No space left on device", "lap.mp4")

    monkeypatch.setattr(av, "open", full)
    with pytest.raises(OutputFileError, match="the disk is full"):
        lap_film.write_video(path, Drive.from_reports(reports_along(3)), track)
    assert path.read_bytes() == b"old"
    assert len(list(tmp_path.iterdir())) == 1


def test_bad_places_and_missing_encoders_are_told(tmp_path, track, reports_along, monkeypatch):
    drive = Drive.from_reports(reports_along(3))
    with pytest.raises(VideoError, match=r"expected a name that ends in \.mp4"):
        lap_film.write_video(tmp_path / "lap.gif", drive, track)
    with pytest.raises(OutputFileError, match="folder does not exist"):
        lap_film.write_video(tmp_path / "nowhere" / "lap.mp4", drive, track)
    monkeypatch.setattr(av, "codecs_available", {"mpeg4"})
    with pytest.raises(UserInputError, match=r"no H\.264 encoder; expected one of libx264"):
        lap_film.write_video(tmp_path / "lap.mp4", drive, track)
