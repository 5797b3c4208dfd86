"""What to change before the next training, in sentences that were computed from the log. Begin with `advice`.

Rules of places are in `place_advice.py`. Each tells the size of what it found with its 95 % interval.

Each rule looks at one thing and stays silent where it has nothing to say, or too little to go by.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from racecraft.analysis.advice import GO_ON, Advice
from racecraft.analysis.learner import Learner
from racecraft.analysis.plot import PlotError
from racecraft.evaluation.rating import wilson
from racecraft.worlds.deepracer.analysis.drive import CRASHED
from racecraft.worlds.deepracer.analysis.logs.actions import action_histogram, action_table
from racecraft.worlds.deepracer.analysis.logs.episodes import QUINTILES, simulation_agg
from racecraft.worlds.deepracer.analysis.logs.intervals import correlation_interval
from racecraft.worlds.deepracer.analysis.logs.judged import Evaluations
from racecraft.worlds.deepracer.analysis.logs.laps import correlation
from racecraft.worlds.deepracer.analysis.logs.place_advice import exits, sectors, speed
from racecraft.worlds.deepracer.analysis.logs.plot import values
from racecraft.worlds.deepracer.analysis.logs.progress import training_progress
from racecraft.worlds.deepracer.analysis.logs.scatter import scatter_of_laps
from racecraft.worlds.deepracer.analysis.logs.step_times import stability
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

FEWEST_EPISODES = 20
FEWEST_ITERATIONS_OF_A_TREND, FEWEST_EPISODES_OF_A_TREND = 2, 30
"""Of fewer nothing is said of a change: two fifths of them differ by chance."""
LONGEST_STEP_MS = 70.0
"""Mean of an iteration's steps, of 66.7 ms, above which a simulator is late. How far single steps stray tells nothing:
stamps are read beside the poses, and in logs whose mean is 66.7 ms one of twenty is beyond 90 ms, too."""
UNDER_WAY = ("prepare", "in_progress")
"""How an episode stands that the end of the training cut off; it tells nothing of how far a car comes."""
CUT = "time_up"
"""How one stands that the clock cut, which tells as little where others ended by themselves."""
RARE = 0.01
"""Share of the steps below which an action is hardly chosen, at the high end of its interval."""
CHANGED = 0.03
"""Of a lap; a smaller change of mean progress is none, nor is one of less than two of its standard errors."""
FIRST_LAP_TICKS = (3_600, 19_500)
"""After so many steps six trainings of AWS's consoles and DeepRacer for Cloud came to their first full lap (their
simulation traces of 2022 and 2026)."""
RELATED = 0.5
"""Correlation of an episode's reward and progress below which they have little to do with each other; ten trainings of
ours and of AWS's that pay for coming forward have 0.9 to 1."""
PAID_SLOW = 0.0
"""Correlation of a full lap's time and reward above which slow laps are paid more, at the low end of its interval."""
GETS_ROUND = 0.5
"""Mean progress from which it is worth asking for speed."""
ANEW = "racecraft train my-car --from RUN:best"
"""Go on from the best with another reward or other actions: those of the folder my-car."""


def advice(
    ticks: pl.DataFrame, track: Track | None, learner: Learner | None = None, judged: Evaluations | None = None
) -> list[Advice]:
    """Return what a training's ticks suggest, the weightiest first; nothing where there are too few episodes.

    Exits of a car that gets round when it is judged are no fault of its own: it explored.

    Args:
        ticks: A training's.
        track: The circuit; None: unknown, and nothing is said of places.
        learner: Which algorithm learned, and how it was set; None: unknown, and no setting of it is named.
        judged: Its evaluations; None: unknown, and the training's episodes alone are gone by.
    """
    episodes, judged = _as_they_ended(ticks), judged or Evaluations()
    if episodes.height < FEWEST_EPISODES:
        return []
    late = episodes.filter(episodes["quintile"].is_in(QUINTILES[3:]))
    completes_laps = judged.completes_laps or late["progress_share"].mean() >= GETS_ROUND  # type: ignore[operator]
    found = [*_timing(ticks)]
    if not judged.completes_laps:
        found += _unrelated(ticks, episodes)
    found += [*_learning(ticks, episodes, learner or Learner(), judged), *_slow_laps(ticks, episodes)]
    if track is not None:
        last = ticks.filter(ticks["unique_episode"].is_in(late["unique_episode"].implode()))
        if not judged.completes_laps:
            found += _quietly(exits, last, track)
        if completes_laps:
            found += _quietly(speed, last, track)
        found += _quietly(sectors, ticks, track)
    return [*found, *_actions(ticks)] if completes_laps else found


def _as_they_ended(ticks: pl.DataFrame) -> pl.DataFrame:
    """Return the episodes that ended, in the order of the iterations in which they did, and fifths by that order.

    By their beginnings the last ones would be short ones only: those that drive long are still under way.
    """
    import polars as pl

    ended = ticks.group_by("unique_episode").agg(pl.col("iteration").last().alias("ended"))
    rank = pl.int_range(pl.len()) * len(QUINTILES) // pl.len()
    fifth = rank.replace_strict(list(range(5)), list(QUINTILES), return_dtype=pl.Enum(QUINTILES))
    status = pl.col("status").cast(pl.String)
    episodes = simulation_agg(ticks).filter(~status.is_in(UNDER_WAY).fill_null(False))
    uncut = episodes.filter((status != CUT).fill_null(True))
    return (
        (uncut if uncut.height >= FEWEST_EPISODES else episodes)
        .join(ended, on="unique_episode", maintain_order="left")
        .sort("round", "ended", "unique_episode")
        .with_columns(fifth.alias("quintile"))
    )


def _quietly(
    rule: Callable[[pl.DataFrame, Track], Iterator[Advice]], ticks: pl.DataFrame, track: Track
) -> list[Advice]:
    """Return what a rule says; nothing where the ticks do not carry it, as exits where no car left the road."""
    try:
        return list(rule(ticks, track))
    except PlotError:
        return []


def _timing(ticks: pl.DataFrame) -> Iterator[Advice]:
    import polars as pl

    table = stability(ticks).data.filter(pl.col("steps") > 1)
    half = 1.96 * pl.col("std_ms") / pl.col("steps").sqrt()
    late = table.with_columns(half.alias("half")).filter(pl.col("mean_ms") - pl.col("half") > LONGEST_STEP_MS)
    if late.height > 0.1 * table.height:
        worst = late.sort("mean_ms", descending=True).row(0, named=True)
        low, high = worst["mean_ms"] - worst["half"], worst["mean_ms"] + worst["half"]
        yield Advice(
            f"In {late.height} of {table.height} iterations the simulator could not keep fifteen steps a second: one "
            f"took up to {worst['mean_ms']:.0f} ms on average (95 %: {low:.0f} to {high:.0f}), not 67.",
            "Give it fewer workers or a faster machine first: a car trained with late steps drives late.",
            lambda: stability(ticks),
            "racecraft logs RUN --page logs.html",
        )


def _learning(ticks: pl.DataFrame, episodes: pl.DataFrame, learner: Learner, judged: Evaluations) -> Iterator[Advice]:
    import polars as pl

    progress = pl.col("progress_share")
    fifths = episodes.group_by("quintile").agg(
        progress.mean(), (progress.var().fill_null(0.0) / pl.len()).alias("error"), pl.col("complete").mean()
    )
    by_fifth = {row[0]: row[1:] for row in fifths.rows()}
    (before, one, _), (now, other, full) = by_fifth[QUINTILES[3]], by_fifth[QUINTILES[4]]
    half = 2.0 * math.sqrt(one + other)
    change, sure = now - before, max(CHANGED, half)
    few = ticks["iteration"].n_unique() < FEWEST_ITERATIONS_OF_A_TREND or episodes.height < FEWEST_EPISODES_OF_A_TREND
    if few and not judged.completes_laps:
        return
    words = f"{judged.words()} While it explored, mean" if judged.shares else "Mean"
    words += f" progress went from {100 * before:.0f} % in the fourth fifth of the episodes to {100 * now:.0f} % in "
    words += (
        f"the last ({100 * change:+.0f} points, 95 %: {100 * (change - half):+.0f} to {100 * (change + half):+.0f}), "
    )
    words += f"{100 * full:.0f} % of which are full laps."
    if judged.completes_laps:
        try_ = "It laps: ask for more speed next, in a reward or in actions of your own."
        command = ANEW
    elif change > sure:
        try_ = "It is still learning: train on from the last checkpoint before you change anything."
        command = f"racecraft train --run RUN {GO_ON}"
    elif change < -sure:
        try_ = "It has got worse: go on from the best checkpoint, with a smaller learning rate."
        command = f"racecraft train --from RUN:best{learner.smaller_steps()}"
    elif not episodes["complete"].any() and ticks.height < FIRST_LAP_TICKS[1]:
        first, last = (f"{count:,}" for count in FIRST_LAP_TICKS)
        try_ = f"It is early: AWS's own trainings came to a first full lap after {first} to {last} steps, this one has "
        try_ += f"{ticks.height:,}. Train on before you change anything."
        command = f"racecraft train --run RUN {GO_ON}"
    elif full < 0.5:
        where = "it crashes" if _mostly_crashes(episodes) else "it leaves the road"
        try_ = f"It stands still below full laps: change the reward or the actions where {where}."
        command = "racecraft why RUN"
    else:
        try_ = "It stands still and finishes: ask for more speed, in the reward or in the actions."
        command = ANEW
    told = ticks.filter(pl.col("unique_episode").is_in(episodes["unique_episode"].implode()))
    yield Advice(words, try_, lambda: training_progress(told), command)


def _mostly_crashes(episodes: pl.DataFrame) -> bool:
    """Tell whether most of the last fifth's failures ran into something."""
    import polars as pl

    ends = episodes.filter(~pl.col("complete") & (pl.col("quintile") == QUINTILES[4]))["status"].cast(pl.String)
    return bool((ends == CRASHED).sum() > len(ends) / 2)


def _unrelated(ticks: pl.DataFrame, episodes: pl.DataFrame) -> Iterator[Advice]:
    coefficient = correlation(*values(episodes, "reward", "progress_share"))
    low, high = correlation_interval(coefficient, episodes.height)
    if coefficient is not None and high < RELATED:
        more = "paid less" if coefficient < 0.0 else "hardly paid more"
        yield Advice(
            f"Episodes that get farther are {more} ({coefficient:+.2f} between reward and progress, 95 %: "
            f"{low:+.2f} to {high:+.2f}; 1 is perfect).",
            "The car is paid for something else than coming forward: look at the common rewards, and at what a lap "
            "that gets nowhere is paid.",
            lambda: scatter_of_laps(ticks),
            "racecraft logs RUN --page logs.html --reward new_reward.py",
        )


def _slow_laps(ticks: pl.DataFrame, episodes: pl.DataFrame) -> Iterator[Advice]:
    full = episodes.filter(episodes["complete"])
    coefficient = correlation(*values(full, "reward", "seconds"))
    low, high = correlation_interval(coefficient, full.height)
    if full.height >= 10 and coefficient is not None and low > PAID_SLOW:
        yield Advice(
            f"Among {full.height} full laps the slow ones are paid more ({coefficient:+.2f} between time and reward, "
            f"95 %: {low:+.2f} to {high:+.2f}).",
            "Each step is paid, so more steps pay more: divide by the steps, or pay speed.",
            lambda: scatter_of_laps(ticks, complete=True),
            "racecraft logs RUN --page logs.html --reward new_reward.py",
        )


def _actions(ticks: pl.DataFrame) -> Iterator[Advice]:
    import polars as pl

    if (ticks["action"] < 0).any():
        return
    last = int(ticks["iteration"].max() or 0)  # type: ignore[arg-type]
    rare = action_table(ticks.filter(ticks["iteration"] >= 0.8 * last))
    steps = int(rare["count"].sum())
    rare = rare.filter(pl.Series([wilson(count, steps)[1] < RARE for count in rare["count"]], dtype=pl.Boolean))
    if rare.height:
        names = "; ".join(rare["name"].to_list()[:4])
        most = max(wilson(count, steps)[1] for count in rare["count"])
        yield Advice(
            f"Late in the training {rare.height} action{'s are' if rare.height > 1 else ' is'} chosen in less than one "
            f"step of a hundred (95 %: at most {100 * most:.1f} %): {names}.",
            "An action nobody chooses only dilutes exploration: leave it out of the next car.",
            lambda: action_histogram(ticks),
            "racecraft new my-car",
        )
