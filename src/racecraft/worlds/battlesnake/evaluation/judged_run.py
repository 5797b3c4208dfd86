"""What a snake's run is judged by: games against the anchors of the rating."""

from __future__ import annotations

from typing import Any

from racecraft.evaluation.evaluate_run import SEED_OF_JUDGING, what_is_judged
from racecraft.evaluation.rating import wilson
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import load_policy
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import WorldSettings
from racecraft.worlds.battlesnake.evaluation.batch import play_batch
from racecraft.worlds.battlesnake.players.anchors import ANCHORS
from racecraft.worlds.battlesnake.players.trained import snake_config_in


def judge_snake(run: RunFolder, which: str, episodes: int = 50, seed: int = SEED_OF_JUDGING) -> dict[str, Any]:
    """Judge a snake by so many games against each anchor (`anchors.py`), the other seats all that anchor's."""
    policy, game = load_policy(run, which), GameSettings(**run.read_job()["asked"]["game"])
    seen = snake_config_in(policy.metadata["settings"])
    played = WorldSettings(game, view=seen.view, outlook=seen.outlook)
    against = {}
    for name in ANCHORS:
        results = play_batch([policy, *[name] * (game.players - 1)], played, episodes, seed)
        won = sum(one.places[0] == 0 and one.places.count(0) == 1 for one in results)
        low, high = wilson(won, len(results))
        against[name] = {
            "games": len(results), "won": won, "won_share": won / len(results),
            "won_share_low": low, "won_share_high": high,
        }  # fmt: skip
    return what_is_judged(run, policy) | {"against": against}
