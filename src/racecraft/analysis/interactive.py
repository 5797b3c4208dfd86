"""A figure of matplotlib's as charts of our pages. Begin with `charts_of`.

Lines, points, bars, steps, bands and marked values are taken over with their names, axes and scales; a figure that
shows anything else, such as a map or a picture, cannot be, and stays a picture. Colours are those of the page.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.pages.chart import Band, Chart, Level, Look, Mark, Series

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_SERIES = 24
"""Of a chart; more lines are a texture, which a picture shows better."""
MAX_POINTS = 20_000


class _NotAChartError(Exception):
    """There is something on the axes that no chart of ours draws."""


def charts_of(figure: Figure, words: str = "") -> list[Chart] | None:
    """Return a chart for each of a figure's axes, or None where one of them shows more than a chart can.

    Args:
        figure: matplotlib's.
        words: What the whole figure shows; stands where an axis has no title of its own.
    """
    mains = [axes for axes in figure.axes if not _is_twin(axes, figure)]
    try:
        charts = [_chart(axes, _twin_of(axes, figure), words) for axes in mains if axes.get_visible()]
    except _NotAChartError:
        return None
    return charts or None


def _chart(axes: Any, twin: Any | None, words: str) -> Chart:
    _refuse_pictures(axes)
    names = _tick_names(axes)
    series, bands, marks, levels = [], list(_bands(axes)), [], []
    for line in axes.lines:
        if _is_across(line, axes):
            levels.append(Level(float(np.asarray(line.get_ydata(), float)[0]), _name(line)))
        elif _is_upright(line, axes):
            marks.append(Mark(float(np.asarray(line.get_xdata(), float)[0]), _name(line)))
        else:
            series.append(_line(line))
    series += list(_scatter(axes))
    lying = _lie(axes)
    if lying and series:
        raise _NotAChartError
    series += list(_bars(axes, names))
    if twin is not None:
        series += [_line(line, right=True) for line in twin.lines]
    if not series and not bands:
        raise _NotAChartError
    if len(series) > MAX_SERIES or sum(len(one.x) for one in series) > MAX_POINTS:
        raise _NotAChartError
    x, y = _shared_label(axes, "x"), _shared_label(axes, "y")
    if lying:
        x, y = y, x
    title = axes.get_title(loc="left") or axes.get_title()
    if not title and len(axes.figure.axes) > 1:
        title = f"{y} by {x}" if x and y else y
    return Chart(
        title=title,
        x=x,
        y=y,
        series=_named(series, y or title or words),
        right=twin.get_ylabel() if twin is not None else "",
        bands=bands,
        marks=marks,
        levels=levels,
        low=0.0 if any(one.look == "bars" for one in series) else _fixed_low(axes),
        log=axes.get_yscale() == "log",
        log_x=axes.get_xscale() == "log",
        names=tuple(names),
        smooth=any(one.look == "line" and len(one.x) > 20 for one in series),
        words=f"{words}: {title}" if title and title not in words else words,
    )


def _refuse_pictures(axes: Any) -> None:
    from matplotlib.collections import PathCollection

    known = all(
        isinstance(one, PathCollection) or type(one).__name__.startswith("FillBetween") for one in axes.collections
    )
    if axes.images or axes.name != "rectilinear" or axes.get_aspect() != "auto" or not known or axes.texts:
        raise _NotAChartError
    if axes.get_xscale() not in ("linear", "log") or axes.get_yscale() not in ("linear", "log"):
        raise _NotAChartError


def _line(line: Any, right: bool = False) -> Series:
    x, y = np.asarray(line.get_xdata(orig=False), float), np.asarray(line.get_ydata(orig=False), float)
    there = np.isfinite(x)
    marked = line.get_marker() not in ("", " ", "None", None)
    drawn = line.get_linestyle() not in ("", " ", "None", None)
    look: Look = "dots" if marked and not drawn else "both" if marked else "line"
    if line.get_drawstyle().startswith("steps"):
        look = "steps"
    elif line.get_linestyle() in ("--", ":", "-."):
        look = "dashed"
    return Series(_name(line), x[there], y[there], look, right, faint=(line.get_alpha() or 1.0) < 0.5)


def _scatter(axes: Any) -> Iterator[Series]:
    from matplotlib.collections import PathCollection

    for one in axes.collections:
        if isinstance(one, PathCollection):
            places: Any = np.ma.filled(np.ma.asarray(one.get_offsets(), float), np.nan)
            yield Series(_name(one), places[:, 0], places[:, 1], "dots")


def _bands(axes: Any) -> Iterator[Band]:
    from matplotlib.collections import PathCollection

    for one in axes.collections:
        if isinstance(one, PathCollection):
            continue
        for path in one.get_paths():
            rows = path.vertices
            count = (len(rows) - 3) // 2
            low, high = rows[1 : count + 1], rows[count + 2 : 2 * count + 2][::-1]
            if count < 1 or not np.allclose(low[:, 0], high[:, 0]):
                raise _NotAChartError
            yield Band(_name(one), low[:, 0], low[:, 1], high[:, 1])


def _bars(axes: Any, names: list[str]) -> Iterator[Series]:
    """Yield bars, each group of them a series; bars that lie down stand up, and their names go below."""
    from matplotlib.container import BarContainer

    groups = [one for one in axes.containers if isinstance(one, BarContainer)]
    if len(axes.patches) != sum(len(group.patches) for group in groups):
        raise _NotAChartError
    for group in groups:
        lie = group.orientation == "horizontal"
        if lie and not names:
            names += _tick_names(axes, axes.yaxis)
        x = [one.get_y() + one.get_height() / 2 if lie else one.get_x() + one.get_width() / 2 for one in group.patches]
        y = [one.get_width() if lie else one.get_height() + one.get_y() for one in group.patches]
        if len(x):
            yield Series(_name(group), x, y, "bars")


def _lie(axes: Any) -> bool:
    """Tell whether there are bars that lie down."""
    return any(getattr(one, "orientation", "") == "horizontal" for one in axes.containers)


def _shared_label(axes: Any, which: str) -> str:
    """Return an axis's label; of plots in one column or row only the outermost bears it."""
    group = getattr(axes, f"get_shared_{which}_axes")().get_siblings(axes)
    labels = [getattr(one, f"get_{which}label")() for one in (axes, *group)]
    return next((str(label) for label in labels if label), "")


def _tick_names(axes: Any, axis: Any = None) -> list[str]:
    """Return what the ticks at 0, 1, 2, … are called where they are names, in order; nothing where they are numbers."""
    from matplotlib.category import StrCategoryFormatter
    from matplotlib.ticker import FixedFormatter

    axis = axis or axes.xaxis
    formatter = axis.get_major_formatter()
    if isinstance(formatter, StrCategoryFormatter):
        found = {int(at): word for word, at in axis.units._mapping.items()}
    elif isinstance(formatter, FixedFormatter):
        places = axis.get_majorticklocs()
        found = {int(at): word for at, word in zip(places, formatter.seq, strict=False) if float(at).is_integer()}
    else:
        return []
    return [str(found.get(k, "")) for k in range(max(found, default=-1) + 1)]


def _named(series: list[Series], otherwise: str) -> list[Series]:
    """Return series that all have a name: of a single one without, the axis's."""
    from dataclasses import replace

    return [
        replace(one, name=one.name or (otherwise if len(series) == 1 else f"{k}")) for k, one in enumerate(series, 1)
    ]


def _name(artist: Any) -> str:
    label = str(artist.get_label() or "")
    return "" if label.startswith("_") else label


def _is_across(line: Any, axes: Any) -> bool:
    return bool(line.get_transform() == axes.get_yaxis_transform(which="grid"))


def _is_upright(line: Any, axes: Any) -> bool:
    return bool(line.get_transform() == axes.get_xaxis_transform(which="grid"))


def _twin_of(axes: Any, figure: Figure) -> Any | None:
    return next(
        (one for one in figure.axes if one is not axes and _is_twin(one, figure) and _same_place(one, axes)), None
    )


def _is_twin(axes: Any, figure: Figure) -> bool:
    """Tell whether axes lie on earlier ones and share their x axis."""
    earlier = figure.axes[: figure.axes.index(axes)]
    return any(_same_place(one, axes) and axes.get_shared_x_axes().joined(one, axes) for one in earlier)


def _same_place(one: Any, other: Any) -> bool:
    return bool(np.allclose(one.get_position(original=True).bounds, other.get_position(original=True).bounds))


def _fixed_low(axes: Any) -> float | None:
    """Return where the y axis begins, where that was set to zero."""
    return 0.0 if not axes.get_autoscaley_on() and axes.get_ylim()[0] == 0.0 else None
