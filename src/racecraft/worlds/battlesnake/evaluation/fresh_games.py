"""A snake's games of a seed that no training and no evaluation used. See `fresh_games`."""

from __future__ import annotations

from racecraft.evaluation.fresh_starts import SEED, FreshScores
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.battlesnake.evaluation.judged_run import judge_snake


def fresh_games(run: RunFolder, which: str, episodes: int) -> FreshScores:
    """Let a checkpoint play so many games against each anchor of the rating; a value an anchor, the share it won."""
    result = judge_snake(run, which, episodes, SEED)
    shares = tuple(100.0 * one["won_share"] for one in result["against"].values())
    return FreshScores("games won, %", False, shares, result["checkpoint"], sum(shares) / len(shares))
