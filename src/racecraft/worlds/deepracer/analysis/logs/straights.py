"""Straights and curves: where speed is used and where it is not. Begin with `straights_and_curves`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, sheet
from racecraft.pages.colours import BLUE, ORANGE
from racecraft.worlds.deepracer.analysis.logs.motion import with_motion
from racecraft.worlds.deepracer.analysis.logs.plot import name_axes, values
from racecraft.worlds.deepracer.analysis.logs.segments import find_segments, in_segments
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl


def straights_and_curves(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Plot:
    """Return one row a segment of the circuit.

    Columns: `segment` (its name), `kind`, `length_m`, `turn_rad`, `ticks`, `speed_mps` (mean commanded), `driven_mps`
    (mean), `fastest_mps` (95 of 100 below), `slide_rad` (mean size), `offset_m` (mean, left positive), `wander_m`
    (spread of the offset), `steering_changes` (share of ticks with another angle than before), `mean_reward`.
    """
    import polars as pl

    segments = find_segments(track)
    frame = in_segments(with_motion(ticks), track, segments)
    changed = (pl.col("steering_rad") != pl.col("steering_rad").shift()).over("unique_episode")
    found = frame.with_columns(changed.alias("_changed")).group_by("segment").agg(
        pl.len().alias("ticks"), pl.col("speed_mps").mean(), pl.col("driven_mps").mean(),
        pl.col("driven_mps").quantile(0.95).alias("fastest_mps"), pl.col("slide_rad").abs().mean(),
        pl.col("offset_m").mean(), pl.col("offset_m").std().alias("wander_m"),
        pl.col("_changed").mean().alias("steering_changes"), pl.col("reward").mean().alias("mean_reward"),
    ).sort("segment")  # fmt: skip
    lengths = pl.DataFrame(
        [(k, s.kind, s.length_m, s.turn_rad) for k, s in enumerate(segments.all)],
        schema={"segment": pl.Int32, "kind": pl.String, "length_m": pl.Float64, "turn_rad": pl.Float64}, orient="row",
    )  # fmt: skip
    data = lengths.join(found, on="segment", how="left", maintain_order="left").with_columns(
        pl.col("segment").replace_strict(segments.names, return_dtype=pl.String), pl.col("ticks").fill_null(0)
    )
    return Plot("straights_and_curves", "Straights and curves", data, lambda: _draw(data))


def _draw(data: pl.DataFrame) -> Any:
    figure, (axes,) = sheet(1, 1, ["Speed in each segment"], (8.0, 1.0 + 0.34 * data.height))
    at = np.arange(data.height)
    commanded, driven, fastest = values(data, "speed_mps", "driven_mps", "fastest_mps")
    axes.barh(at, driven, color=BLUE, height=0.62, label="driven, mean")
    axes.scatter(commanded, at, marker="|", s=160, color=ORANGE, lw=2.4, label="commanded, mean", zorder=3)
    axes.scatter(fastest, at, marker="d", s=22, color="#1d2327", label="driven, 95 of 100 below", zorder=3)
    axes.set_yticks(at, data["segment"].to_list(), fontsize=9)
    axes.invert_yaxis()
    axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    name_axes(axes, "m/s", "")
    return figure
