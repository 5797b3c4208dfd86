"""Every plot as other eyes and a grey printer see it: two dichromacies after Machado, Oliveira and Fernandes (2009).

Things of one panel that carry the same line or mark must be told apart by colour alone, so for all of these eyes; and
what is coloured by a number must grow lighter with it throughout.
"""

import itertools

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgb
from tests.worlds.deepracer.analysis.test_logs_plots import every_plot, logs_of
from tests.worlds.deepracer.logs import makers

from racecraft.pages.colours import CYCLE
from racecraft.worlds.deepracer.analysis import saliency, track_map
from racecraft.worlds.deepracer.analysis.logs import plot
from racecraft.worlds.deepracer.tracks.catalogue import load_track

EYES = {
    "usual": np.eye(3),
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "print in grey": [[0.2126, 0.7152, 0.0722]] * 3,
}
"""Linear sRGB to linear sRGB, severity 1; the last row is the luminance of IEC 61966-2-1."""
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = TO_XYZ @ np.ones(3)
TOLD_APART = 10.0
"""CIE 1976 distance of two colours that nobody takes for one, side by side or not; 2.3 is just seen side by side."""


def lab(colours, eyes):
    """Return CIE L*a*b* of sRGB colours, (N, 3) from 0 to 1, as some eyes see them."""
    colours = np.atleast_2d(colours)
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    seen = np.clip(linear @ np.asarray(EYES[eyes]).T, 0.0, 1.0) @ TO_XYZ.T / WHITE
    f = np.where(seen > 0.008856, np.cbrt(seen), 7.787 * seen + 16 / 116)
    return np.column_stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])])


def apart(a, b, eyes):
    return float(np.linalg.norm(lab(to_rgb(a), eyes) - lab(to_rgb(b), eyes)))


@pytest.mark.parametrize("eyes", EYES)
@pytest.mark.parametrize("name", [plot.HEAT, track_map.PATH_COLOURS, saliency.HEAT])
def test_what_is_coloured_by_a_number_grows_lighter_with_it(name, eyes):
    light = lab(colormaps[name](np.linspace(0.0, 1.0, 32))[:, :3], eyes)[:, 0]
    assert (np.diff(light) > 0.5).all()


@pytest.mark.parametrize("eyes", [eyes for eyes in EYES if eyes != "print in grey"])
def test_the_colours_of_things_are_told_apart(eyes):
    for a, b in itertools.combinations(CYCLE, 2):
        assert apart(a, b, eyes) >= TOLD_APART, (a, b)


def named_things(axes):
    """Yield (name, colour, what it looks like beside its colour) of what a panel's legend tells."""
    handles, names = axes.get_legend_handles_labels()
    for handle, name in zip(handles, names, strict=True):
        if isinstance(handle, PathCollection):
            colours = handle.get_facecolors()
            if len(colours):
                yield name, colours[0][:3], ("dots", handle.get_paths()[0].vertices.round(3).tobytes())
        elif hasattr(handle, "get_linestyle") and hasattr(handle, "get_marker"):
            yield name, to_rgb(handle.get_color()), (handle.get_linestyle(), handle.get_marker())
        else:
            patch = handle[0] if isinstance(handle, tuple) else next(iter(getattr(handle, "patches", [handle])))
            if hasattr(patch, "get_hatch"):
                yield name, to_rgb(patch.get_facecolor()), ("area", patch.get_hatch())


def test_what_one_panel_names_is_told_apart_by_every_eye_or_by_its_line_and_mark(tmp_path):
    track = load_track("reinvent_base")
    parts = [makers.episode(k, 1.0, 40 + 3 * k * k, status="lap_complete") for k in range(4)]
    ticks = logs_of(tmp_path, makers.joined(*parts, makers.episode(4, 0.4)))
    compared, alike = 0, []
    for what, drawn in every_plot(ticks, track).items():
        for axes in drawn.figure.axes:
            for (one, a, looks), (other, b, as_well) in itertools.combinations(named_things(axes), 2):
                compared += 1
                if looks == as_well:
                    alike += [(what, one, other, eyes) for eyes in EYES if apart(a, b, eyes) < TOLD_APART]
    assert compared >= 8
    assert alike == []
