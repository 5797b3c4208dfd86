"""Pictures are written whole, in the track's colours, with and without paths."""

import numpy as np
import pytest
from PIL import Image

from racecraft.contract.errors import TrackError
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.picture import DAYLIGHT, PaintedPath, draw_track


def pixel_at(image, figure, xy):
    """Return the colour of a drawn picture at a place on the track."""
    x, y = figure.axes[0].transData.transform(xy) * image.width / figure.bbox.width
    return np.array(image.convert("RGB").getpixel((int(x), int(image.height - y))), dtype=float)


def test_a_picture_has_road_and_field_in_the_tracks_colours(tmp_path):
    track = load_track("reinvent_base")
    figure = draw_track(track, tmp_path / "track.png", dpi=80)
    image = Image.open(tmp_path / "track.png")
    lane = track.lane("outer")[25]
    assert pixel_at(image, figure, lane) == pytest.approx(DAYLIGHT * np.array(track.look.road), abs=4)
    assert pixel_at(image, figure, (4.0, 2.0)) == pytest.approx(DAYLIGHT * np.array(track.look.field), abs=4)
    assert [path.name for path in tmp_path.iterdir()] == ["track.png"]


@pytest.mark.parametrize("name", ["Straight_track", "Tokyo_Training_track", "reinvent_wood"])
def test_every_kind_of_track_can_be_drawn(tmp_path, name):
    draw_track(load_track(name).reversed(), tmp_path / "track.svg")
    assert (tmp_path / "track.svg").read_text().startswith("<?xml")


def test_paths_are_coloured_by_their_value_with_a_bar():
    track = load_track("reinvent_base")
    speed = np.linspace(1.0, 3.0, len(track.centre))
    paths = [PaintedPath(track.centre, speed, "speed (m/s)"), PaintedPath(track.lane("inner"))]
    figure = draw_track(track, paths=paths, title="Two laps")
    assert len(figure.axes) == 2
    assert figure.axes[1].get_ylabel() == "speed (m/s)"
    still = PaintedPath(track.centre, np.zeros(len(track.centre)), "speed (m/s)")
    assert len(draw_track(track, paths=[still]).axes) == 2


def test_an_unknown_kind_of_picture_is_refused(tmp_path):
    with pytest.raises(TrackError, match="a picture"):
        draw_track(load_track("Straight_track"), tmp_path / "track.doc")
