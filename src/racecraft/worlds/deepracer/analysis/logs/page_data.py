"""The log as the page's script reads it: every episode, the ticks of as many as fit, the circuit. See `page_data`.

Ticks travel as 16-bit numbers in base64, a few metres of text less than as JSON; what each step is worth stands beside
them.
"""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.worlds.deepracer.analysis.logs.circuit import on_track
from racecraft.worlds.deepracer.analysis.logs.episodes import simulation_agg
from racecraft.worlds.deepracer.analysis.logs.motion import with_motion
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

MAX_TICKS = 60_000
MAX_EPISODES = 20_000
STEPS = {"x_m": 0.002, "y_m": 0.002, "speed_mps": 0.001, "driven_mps": 0.001, "steering_rad": 0.0001,
         "slide_rad": 0.0005, "progress_share": 0.0001, "waypoint": 1.0, "tick": 1.0}  # fmt: skip
"""What one unit of a 16-bit number is worth; the reward's is chosen by its size."""
BIGGEST = 32_000


def page_data(ticks: pl.DataFrame, track: Track) -> dict[str, Any]:
    """Return what the page's script needs: `track`, `episodes` and `ticks` (columns), `steps`, `left_out`."""
    import polars as pl

    frame = on_track(with_motion(ticks), track)
    episodes = simulation_agg(frame).tail(MAX_EPISODES)
    kept = _kept(episodes)
    shown = frame.filter(pl.col("unique_episode").is_in(kept.implode())).sort("unique_episode", maintain_order=True)
    counts = dict(shown.group_by("unique_episode").len().rows())
    count = [counts.get(number, 0) for number in episodes["unique_episode"]]
    rewards = shown["reward"].abs().max() or 1.0
    steps = {**STEPS, "reward": max(float(rewards), 1e-6) / BIGGEST}  # type: ignore[arg-type]
    return {
        "track": {
            name: np.round(line, 3).tolist()
            for name, line in (
                ("centre", track.centre), ("inner", track.inner), ("outer", track.outer), ("start", _start_line(track)),
            )
        } | {"closed": track.closed, "name": track.title or track.name},
        "episodes": {
            **{
                name: episodes[name].cast(pl.String).to_list() if episodes.schema[name] == pl.Enum else
                [None if value is None else round(value, 4) if isinstance(value, float) else value
                 for value in episodes[name].to_list()]
                for name in ("unique_episode", "phase", "round", "worker", "iteration", "progress_share", "seconds",
                             "reward", "complete", "status", "steps")
            },
            "ticks": count,
        },
        "ticks": {name: _packed(shown[name], step) for name, step in steps.items()},
        "steps": steps,
        "left_out": int(sum(1 for one in count if not one)),
    }  # fmt: skip


def _start_line(track: Track) -> np.ndarray:
    """Return the ends of the start line, (2, 2): rows of a route file need not lie opposite one another."""
    at = track.locate(track.centre[:1])
    return np.concatenate([at.inner_point, at.outer_point])


def _kept(episodes: pl.DataFrame) -> pl.Series:
    """Return the episodes whose ticks travel: evaluations, fastest, farthest and latest first, as many as fit."""
    import polars as pl

    ranked = episodes.with_columns(
        pl.when(pl.col("phase") != "training").then(0)
        .when(pl.col("complete")).then(pl.col("seconds").rank("ordinal").over("complete"))
        .otherwise(pl.col("unique_episode").rank("ordinal", descending=True) + 100)
        .alias("_rank")
    ).sort("_rank", "unique_episode")  # fmt: skip
    return ranked.filter(pl.col("steps").cum_sum() <= MAX_TICKS)["unique_episode"]


def _packed(column: pl.Series, step: float) -> str:
    """Return a column as little-endian 16-bit numbers in base64; null is the lowest of them."""
    import polars as pl

    numbers = column.cast(pl.Float64).to_numpy()
    most = BIGGEST * step
    whole = np.where(np.isfinite(numbers), np.rint(np.clip(numbers, -most, most) / step), -32768)
    return base64.b64encode(whole.astype("<i2").tobytes()).decode()
