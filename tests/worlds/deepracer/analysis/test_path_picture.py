"""The picture of a drive shows its speed, where it left the road, and what stood in the way."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from racecraft.worlds.deepracer.analysis.drive import Drive, as_drive
from racecraft.worlds.deepracer.analysis.path_picture import draw_path, path_figure
from racecraft.worlds.deepracer.env import race


def test_a_path_is_coloured_by_driven_speed_and_exits_are_marked(tmp_path, track, reports_along):
    drive = reports_along(80, race.OFF_TRACK, share=0.5)
    figure = draw_path(tmp_path / "path.png", track, drive)
    road, bar = figure.axes[:2]
    assert bar.get_ylabel() == "driven speed (m/s)"
    assert bar.get_ylim() == pytest.approx(np.percentile(drive["driven_speed"], (3, 97)))
    crosses = road.get_legend()
    assert [text.get_text() for text in crosses.get_texts()] == ["left the road"]
    assert [text.get_text() for text in figure.texts][0] == "re:Invent 2018: off track at 50 %"
    picture = np.asarray(Image.open(tmp_path / "path.png").convert("RGB"))
    assert len(np.unique(picture @ [65536, 256, 1])) > 100
    assert [entry.name for entry in tmp_path.iterdir()] == ["path.png"]


def test_boxes_stand_on_the_picture_of_a_drive(track, reports_along):
    from matplotlib.patches import Rectangle

    drive = replace(as_drive(reports_along(40)), boxes=np.array([[1.5, 2.0, 0.0, 0.25, 0.125, 0.38]]))
    assert drive.of_lap(1).boxes is drive.boxes
    for shown, drawn in ((drive, [(1.25, 1.875, 0.5, 0.25)]), (replace(drive, boxes=None), [])):
        patches = path_figure(track, shown, "").axes[0].patches
        boxes = [one for one in patches if isinstance(one, Rectangle) and one.get_zorder() == 9]
        assert [(*one.get_xy(), one.get_width(), one.get_height()) for one in boxes] == drawn


def test_several_laps_are_laid_over_each_other_and_the_best_is_named(tmp_path, track, reports_along):
    drive = Drive.from_reports(np.concatenate([reports_along(50), reports_along(40)]))
    figure = draw_path(tmp_path / "path.svg", track, drive)
    assert figure.texts[0].get_text() == "re:Invent 2018: 2 laps, best 2.67 s"
    assert figure.axes[0].get_legend() is None
    assert (tmp_path / "path.svg").read_text().startswith("<?xml")
