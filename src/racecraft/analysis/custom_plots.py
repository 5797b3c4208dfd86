"""A racer's own plots, beside ours: from a file that is named, or from an installed package. Begin with `own_plots`.

In a file every function whose name begins with `plot_` is one; a package names its functions in the entry-point group
`racecraft.plots`. A plot takes the ticks (Polars) and the circuit (or None) and returns a `Plot`, a matplotlib figure
or a Polars table. Only what was named or installed is run, never a file that lies in somebody's logs.
"""

from __future__ import annotations

import importlib.util
import inspect
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from racecraft.analysis.plot import Plot, PlotError, sheet
from racecraft.contract.errors import UserInputError
from racecraft.contract.extensions import offered

if TYPE_CHECKING:
    import polars as pl

PREFIX = "plot_"


class CustomPlotError(UserInputError):
    """A racer's own plot cannot be found or does not work."""


@dataclass(frozen=True)
class NoPlot:
    """What stands on a page where a racer's own plot should."""

    title: str
    why: str
    """The error, in a letter's words."""


@dataclass(frozen=True)
class CustomPlot:
    """A function of somebody's that makes a plot."""

    name: str
    origin: str
    """The file, or the package's entry point."""
    make: Callable[[Any, Any], Any]

    def __call__(self, ticks: pl.DataFrame | pl.LazyFrame, track: Any) -> Plot:
        """Return the plot.

        Raises:
            CustomPlotError: The function failed, or gave something else.
            PlotError: The function said that these ticks do not carry it.
        """
        frame = ticks.lazy().collect()
        try:
            plot = _as_plot(self, self.make(frame, track), frame)
            plot.figure  # noqa: B018 (drawn here, where a failure is known to be theirs)
        except (PlotError, CustomPlotError):
            raise
        except (Exception, SystemExit) as error:
            line = _line_of(error, self.origin)
            away = "remove its package" if self.origin.startswith("racecraft.plots") else "leave it out of --plots"
            raise CustomPlotError(
                "{origin}{line}: {name} failed ({type_name}: {error}); expected a plot of "
                "{height} ticks. Mend it, or {away}.",
                origin=self.origin,
                line=line,
                name=self.name,
                type_name=type(error).__name__,
                error=error,
                height=frame.height,
                away=away,
            ) from error
        return plot


def own_plots(files: Sequence[str | Path] = ()) -> list[CustomPlot]:
    """Return the plots of files and folders of files, in the order of their names, then those of installed packages.

    Raises:
        CustomPlotError: A file is not there, cannot be imported, or holds no plot.
    """
    found = [plot for path in files for plot in _of_path(Path(path))]
    for name, entry in offered("plots").items():
        found.append(CustomPlot(name, f"{entry.group}: {entry.value}", _loaded(entry)))
    return found


def made_or_why(own: Sequence[CustomPlot], ticks: pl.DataFrame, track: Any) -> list[Plot | NoPlot]:
    """Return each plot, or why there is none: one that fails takes no other with it, and no page."""
    made: list[Plot | NoPlot] = []
    for one in own:
        try:
            made.append(one(ticks, track))
        except UserInputError as error:
            made.append(NoPlot(one.name, str(error)))
    return made


def _of_path(path: Path) -> list[CustomPlot]:
    if not path.exists():
        raise CustomPlotError(
            "{path}: is not there; expected a Python file with plots, or a folder of them.", path=path
        )
    files = sorted(path.glob("*.py")) if path.is_dir() else [path]
    found = []
    for file in files:
        made = [
            CustomPlot(name, str(file), make)
            for name, make in vars(_imported(file)).items()
            if name.startswith(PREFIX) and inspect.isfunction(make)
        ]
        if not made and not path.is_dir():
            raise CustomPlotError(
                "{file}: holds no plot; expected a function whose name begins with {prefix!r}, of (ticks, track).",
                file=file,
                prefix=PREFIX,
            )
        found += made
    return found


def _imported(file: Path) -> ModuleType:
    name = f"racecraft_plots_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise CustomPlotError("{file}: is no Python file; expected one that ends in .py.", file=file)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        line = _line_of(error, str(file))
        raise CustomPlotError(
            "{file}{line}: cannot be imported ({type_name}: {error}); expected Python with functions that "
            "begin with {prefix!r}.",
            file=file,
            line=line,
            type_name=type(error).__name__,
            error=error,
            prefix=PREFIX,
        ) from error
    return module


def _loaded(entry: Any) -> Callable[[Any, Any], Any]:
    def make(ticks: Any, track: Any) -> Any:
        theirs = entry.load()
        make.__doc__ = theirs.__doc__  # its title
        return theirs(ticks, track)

    return make


def _line_of(error: BaseException, file: str) -> str:
    """Return ":LINE" of the innermost line of a file that an error passed through; "" where none."""
    if isinstance(error, SyntaxError):
        return f":{error.lineno}"
    line, trace = "", error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = f":{trace.tb_lineno}"
        trace = trace.tb_next
    return line


def _as_plot(own: CustomPlot, made: Any, ticks: Any) -> Plot:
    """Return what a function gave as a plot."""
    import polars as pl

    title = (inspect.getdoc(own.make) or own.name.removeprefix(PREFIX).replace("_", " ").capitalize()).splitlines()[0]
    if isinstance(made, Plot):
        return made
    if isinstance(made, pl.DataFrame):
        return Plot(own.name, title, made, lambda: _table_figure(made, title))
    if hasattr(made, "savefig"):
        return Plot(own.name, title, ticks.head(0), lambda: made)
    raise CustomPlotError(
        "{origin}: {name} gave {type_name}; expected a Plot, a matplotlib figure or a Polars table.",
        origin=own.origin,
        name=own.name,
        type_name=type(made).__name__,
    )


def _table_figure(table: Any, title: str) -> Any:
    """Return a table as a figure, its first rows."""
    rows = table.head(20)
    figure, (axes,) = sheet(1, 1, [title], (8.0, 0.8 + 0.3 * rows.height))
    axes.set_axis_off()
    cells = [[f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row] for row in rows.rows()]
    axes.table(cells or [[""] * rows.width], colLabels=rows.columns, loc="upper left")
    return figure
