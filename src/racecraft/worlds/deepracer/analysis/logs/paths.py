"""What was driven, on the map: one episode, one iteration, the best of all. Begin with `one_episode`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, PlotError
from racecraft.worlds.deepracer.analysis.logs.episodes import per_iteration, simulation_agg
from racecraft.worlds.deepracer.analysis.logs.plot import (
    WORDS,
    colour_bar,
    limits_of,
    map_sheet,
    painted_path,
    require,
    values,
)
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

MAX_PATHS = 40


def one_episode(
    ticks: pl.DataFrame | pl.LazyFrame, track: Track, unique_episode: int, value: str = "speed_mps"
) -> Plot:
    """Return one episode: its ticks, and its path coloured by a column.

    Raises:
        PlotError: There is no such episode, or no such column.
    """
    data = _of(ticks, "unique_episode", [unique_episode], value)
    title = f"Episode {unique_episode}: {_ending(data)}"
    return Plot("one_episode", title, data, lambda: _draw(track, [data], [title], value))


def last_iteration(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Plot:
    """Return `one_iteration` of the last one, coloured by the reward."""
    round_, iteration = require(ticks, "round", "iteration").select("round", "iteration").row(-1)
    return one_iteration(ticks, track, iteration, "reward", round_)


def one_iteration(
    ticks: pl.DataFrame | pl.LazyFrame, track: Track, iteration: int, value: str = "speed_mps", round_: int = 1
) -> Plot:
    """Return one iteration: its ticks, and the paths of its episodes over each other.

    Raises:
        PlotError: There is no such iteration, or no such column.
    """
    frame = require(ticks, "round", "phase", "iteration")
    frame = frame.filter((frame["round"] == round_) & (frame["phase"] == "training"))
    data = _of(frame, "iteration", [iteration], value)
    count = data["unique_episode"].n_unique()
    title = f"Iteration {iteration}: {count} episode{'s' if count != 1 else ''}"
    return Plot("one_iteration", title, data, lambda: _draw(track, [data], [title], value))


def selected_laps(
    ticks: pl.DataFrame | pl.LazyFrame, track: Track, unique_episodes: Sequence[int], value: str = "speed_mps"
) -> Plot:
    """Return chosen episodes, each on a map of its own.

    Raises:
        PlotError: One of them is not there.
    """
    data = _of(ticks, "unique_episode", list(unique_episodes), value)
    each = [data.filter(data["unique_episode"] == number) for number in unique_episodes]
    titles = [f"Episode {number}: {_ending(one)}" for number, one in zip(unique_episodes, each, strict=True)]
    return Plot("selected_laps", "Chosen laps", data, lambda: _draw(track, each, titles, value))


def top_iterations(
    ticks: pl.DataFrame | pl.LazyFrame, track: Track | None, count: int = 3, value: str = "reward"
) -> Plot:
    """Return the iterations with the largest mean reward, best first: `per_iteration`'s rows, and their paths."""
    import polars as pl

    frame = require(ticks, "phase").filter(pl.col("phase") == "training")
    data = per_iteration(simulation_agg(frame)).sort("reward", descending=True).head(count)
    chosen = data.select("round", "iteration", "reward").rows()
    each = [frame.filter((pl.col("round") == k) & (pl.col("iteration") == i)) for k, i, _ in chosen]
    titles = [f"Iteration {i}: mean reward {reward:.1f}" for _, i, reward in chosen]

    def draw() -> Any:
        if track is None:
            raise PlotError("There is no track to draw paths on; expected one. Name it.")
        return _draw(track, each, titles, value)

    return Plot("top_iterations", "Iterations with the largest mean reward", data, draw)


def best_laps(ticks: pl.DataFrame | pl.LazyFrame, count: int = 10, by: str = "seconds") -> pl.DataFrame:
    """Return the best episodes, best first: `simulation_agg`'s rows.

    Args:
        ticks: The ticks.
        count: How many.
        by: "seconds" (full laps, fastest first), "progress_share" or "reward" (largest first).

    Raises:
        PlotError: `by` is none of these.
    """
    episodes = simulation_agg(ticks)
    if by == "seconds":
        return episodes.filter(episodes["complete"]).sort("seconds").head(count)
    if by not in ("progress_share", "reward"):
        raise PlotError("Laps cannot be ranked by {by!r}; expected seconds, progress_share or reward.", by=by)
    return episodes.sort(by, "unique_episode", descending=[True, False]).head(count)


def _of(ticks: pl.DataFrame | pl.LazyFrame, column: str, wanted: list[int], value: str) -> pl.DataFrame:
    """Return the rows of some episodes or iterations, which must all be there."""
    import polars as pl

    frame = require(ticks, column, "unique_episode", "x_m", "y_m", "status", "progress_share", value)
    data = frame.filter(pl.col(column).is_in(wanted))
    lacking = sorted(set(wanted) - set(data[column].unique()))
    if lacking:
        low, high = int(frame[column].min() or 0), int(frame[column].max() or 0)  # type: ignore[arg-type]
        raise PlotError(
            "There is no {column} {lacking}; expected {low} to {high}.",
            column=column.replace("_", " "),
            lacking=lacking[0],
            low=low,
            high=high,
        )
    return data


def _ending(data: pl.DataFrame) -> str:
    status = str(data["status"][-1] or "in progress").replace("_", " ")
    return f"{status} at {100 * float(data['progress_share'].max() or 0):.0f} %"  # type: ignore[arg-type]


def _draw(track: Track, each: Sequence[pl.DataFrame], titles: Sequence[str], value: str) -> Any:
    figure, axes = map_sheet(track, len(each), titles)
    everything = np.concatenate([values(data, value)[0] for data in each])
    limits = limits_of(everything)
    painted = None
    for one, data in zip(axes, each, strict=True):
        for path in data.partition_by("unique_episode", maintain_order=True)[:MAX_PATHS]:
            if path.height > 1:
                shade = values(path, value)[0]
                wide = 2.2 if data["unique_episode"].n_unique() == 1 else 1.0
                painted = painted_path(one, path.select("x_m", "y_m").to_numpy(), shade, limits, wide)
    if painted is not None:
        colour_bar(figure, painted, axes, WORDS.get(value, value))
    return figure
