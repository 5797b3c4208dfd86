"""Laps of a log, paid again by another reward: which would have earned more, and what changes. Begin with `rescore`.

Every parameter is worked out from pose and command on the track; progress, status and wheels are the log's own, where
it has them. A log says nothing of boxes and bots, so lists of objects are empty.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.paying import Failure, Payer
from racecraft.worlds.deepracer.driving.reward.poses import locate_rows
from racecraft.worlds.deepracer.driving.reward.speed import spearman
from racecraft.worlds.deepracer.env.race import IN_PROGRESS, STATUSES, TICK_REPORT
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

COLUMNS = ("x_m", "y_m", "yaw_rad", "steering_rad", "speed_mps", "tick", "progress_share", "reward", "unique_episode")
HELD = ("prepare", "pause", "park")
"""Rows of these statuses are paid nothing: the reward function is not asked."""


@dataclass(frozen=True)
class Episode:
    """An episode of a log and what both rewards pay for it."""

    episode: int
    """`unique_episode` of the log's table."""
    round: int
    """Which of several logs, counted from 1."""
    phase: str
    """training, evaluation or leaderboard."""
    is_lap: bool
    seconds: float
    """From its first row to its last."""
    progress: float
    """Per cent at its end."""
    old: float
    """Summed reward in the log."""
    new: float
    """Summed reward of the new function."""


@dataclass(frozen=True, eq=False)
class Rescored:
    """A log, paid again."""

    track: Track
    episodes: tuple[Episode, ...]
    rewards: Array
    """float64 (T,): what each row of the log earns now."""
    failures: tuple[Failure, ...]

    @property
    def laps(self) -> list[Episode]:
        """The complete laps, the fastest first."""
        return sorted((one for one in self.episodes if one.is_lap), key=lambda one: one.seconds)

    @property
    def agreement(self) -> float:
        """Rank correlation of both rewards over all episodes, -1 to 1."""
        return spearman(np.array([one.old for one in self.episodes]), np.array([one.new for one in self.episodes]))

    @property
    def time_ranks(self) -> tuple[float, float]:
        """Rank correlation of lap time with the old and with the new reward; positive: slow laps earn more."""
        seconds = np.array([one.seconds for one in self.laps])
        return tuple(spearman(seconds, np.array([getattr(one, name) for one in self.laps])) for name in ("old", "new"))  # type: ignore[return-value]

    def places(self) -> list[tuple[Episode, int, int]]:
        """Return of each lap, the fastest first, its place by the old and by the new reward, counted from 1."""
        laps = self.laps
        ranks = []
        for name in ("old", "new"):
            order = sorted(range(len(laps)), key=lambda k: -getattr(laps[k], name))
            ranks.append({k: place for place, k in enumerate(order, 1)})
        return [(lap, ranks[0][k], ranks[1][k]) for k, lap in enumerate(laps)]

    def as_dictionary(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        before, after = self.time_ranks
        return {
            "track": self.track.name,
            "rows": len(self.rewards),
            "episodes": [asdict(one) for one in self.episodes],
            "agreement": self.agreement,
            "lap_time_rank_old": before,
            "lap_time_rank_new": after,
            "laps": [{"episode": lap.episode, "seconds": lap.seconds, "place_old": old, "place_new": new}
                     for lap, old, new in self.places()],
            "failures": [asdict(one) for one in self.failures],
        }  # fmt: skip


def rescore(ticks: pl.DataFrame, track: Track, payer: Payer) -> Rescored:
    """Pay the laps of a log again.

    Args:
        ticks: The table of `racecraft.worlds.deepracer.logs`.
        track: The circuit, turned as it was driven.
        payer: The new reward function.

    Raises:
        UserInputError: The log lacks what a reward needs, or has no row that is paid.
        RewardError: The function hangs or ends its process.
    """
    rows, has_reward = rows_of(ticks, track)
    rewards = np.zeros(len(rows))
    pay = payer.compute_rewards(track, rows[has_reward], is_reversed=track.is_reversed)
    rewards[has_reward] = pay.rewards
    return Rescored(track, tuple(_episodes(ticks, rows, rewards)), rewards, pay.failures)


def rows_of(ticks: pl.DataFrame, track: Track) -> tuple[Array, Array]:
    """Return the rows of a log as a reward function is asked about them, TICK_REPORT (T,), and which are paid, (T,).

    Raises:
        UserInputError: The log lacks what a reward needs.
    """
    missing = [name for name in COLUMNS if name not in ticks.columns or ticks[name].null_count() == ticks.height]
    if missing or not ticks.height:
        found = f"has no {', '.join(missing)}" if ticks.height else "holds no ticks"
        raise UserInputError(
            "The log {found}; expected poses, commands, progress and rewards of every tick. Give a run folder, a "
            "simulation trace or a simulation log.",
            found=found,
        )
    column = {name: ticks[name].cast(float).fill_null(0.0).to_numpy() for name in COLUMNS}
    rows = np.zeros(ticks.height, TICK_REPORT)
    rows["front_x"], rows["front_y"], rows["yaw"] = column["x_m"], column["y_m"], column["yaw_rad"]
    rows["x"] = rows["front_x"] - FRONT_POINT_M * np.cos(rows["yaw"])
    rows["y"] = rows["front_y"] - FRONT_POINT_M * np.sin(rows["yaw"])
    rows["steering"], rows["speed"], rows["steps"] = column["steering_rad"], column["speed_mps"], column["tick"]
    locate_rows(track, rows)
    rows["progress"] = 100.0 * column["progress_share"]
    rows["time"] = ticks["time_s"].fill_null(0.0).to_numpy() if "time_s" in ticks.columns else 0.0
    rows["action"], rows["object_hit"], rows["status"] = -1, -1, IN_PROGRESS
    status = ticks["status"].cast(str).fill_null("in_progress").to_numpy()
    for number, name in enumerate(STATUSES):
        rows["status"][status == name] = number
    rows["is_off"] = np.where(ticks["status"].is_null().to_numpy(), rows["is_off"], status == "off_track")
    rows["is_crashed"] = status == "crashed"
    if ticks["all_wheels_on_track"].null_count() == 0:
        rows["all_wheels_on"] = ticks["all_wheels_on_track"].to_numpy()
    return rows, ~np.isin(status, HELD)


def _episodes(ticks: pl.DataFrame, rows: Array, rewards: Array) -> list[Episode]:
    number = ticks["unique_episode"].to_numpy()
    edges = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), len(number)]
    old = ticks["reward"].fill_null(0.0).to_numpy()
    rounds, phases = ticks["round"].to_list(), ticks["phase"].cast(str).to_list()
    complete = rows["progress"] >= 100.0
    return [
        Episode(
            int(number[first]), int(rounds[first]), phases[first], bool(complete[first:last].any()),
            float(rows["time"][last - 1] - rows["time"][first]), float(rows["progress"][last - 1]),
            float(old[first:last].sum()), float(np.nansum(rewards[first:last])),
        )
        for first, last in zip(edges, edges[1:], strict=False)
    ]  # fmt: skip
