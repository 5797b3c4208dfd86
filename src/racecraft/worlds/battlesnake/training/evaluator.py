"""Judges a learning snake: short batches of greedy games against the anchors, told as a rating."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from racecraft.contract.policy import Policy
from racecraft.contract.world import EpisodeRecord
from racecraft.evaluation.rating import MEAN, Rating, Result, rate, wilson
from racecraft.training.callbacks import EvaluationResult
from racecraft.training.stopping import RATING
from racecraft.worlds.battlesnake.env.world import WorldSettings
from racecraft.worlds.battlesnake.evaluation.batch import MAX_TURNS, Player, play_batch
from racecraft.worlds.battlesnake.players.anchors import ANCHORS

SEED_OF_JUDGING = 1_000_000_007
GAMES_AMONG_ANCHORS = 100
"""Games of each two anchors, once, which say how far apart they are."""


@dataclass(frozen=True)
class AnchorScore:
    """What came of games against one anchor."""

    won: int
    drawn: int
    lost: int

    @property
    def games(self) -> int:
        """How many were played."""
        return self.won + self.drawn + self.lost


class RatingEvaluator:
    """Rates the greedy policy (no search) on a scale where the anchors' mean is 1500.

    Args:
        policy: The judged policy.
        settings: What is played and seen.
        games: Against each anchor.
        most_turns: A longer game is a draw.
    """

    score_name = "rating"
    stop_kinds = RATING

    def __init__(self, policy: Policy, settings: WorldSettings, games: int, most_turns: int = MAX_TURNS) -> None:
        self._policy, self._settings, self._games, self._most_turns = policy, settings, games, most_turns
        self._among_anchors: list[Result] | None = None

    def score(self, episode: EpisodeRecord) -> None:
        """One game alone has no rating."""

    def goal_reached(self, episode: EpisodeRecord) -> bool:
        """There is no game that ends all training."""
        return False

    def watch(self, episodes: Sequence[EpisodeRecord]) -> None:
        """Training's games change nothing here."""

    def confirm(self) -> bool:
        """A rating is never final."""
        return True

    def evaluate(self) -> EvaluationResult:
        """Play against each anchor and rate."""
        if self._among_anchors is None:
            self._among_anchors = self._play_anchors()
        me, results = len(ANCHORS), list(self._among_anchors)
        against: dict[str, Any] = {}
        steps = 0
        for number, name in enumerate(ANCHORS):
            played = self._play(name)
            results += [Result((me, *[number] * (len(one.places) - 1)), one.places) for one in played]
            against[name] = _told(count(played))
            steps += sum(one.steps for one in played)
        rating = rating_among(results)
        details = {"rating": rating.points, "rating_low": rating.low, "rating_high": rating.high, "against": against}
        return EvaluationResult(rating.points, solved=False, details=details, steps=steps)

    def _play(self, name: str) -> list[Result]:
        seats = self._settings.game.players
        players: list[Player] = [self._policy, *[name] * (seats - 1)]
        return play_batch(players, self._settings, self._games, SEED_OF_JUDGING, self._most_turns)

    def _play_anchors(self) -> list[Result]:
        names, seats = list(ANCHORS), self._settings.game.players
        results = []
        for one, two in combinations(range(len(names)), 2):
            players: list[Player] = [names[one], *[names[two]] * (seats - 1)]
            for result in play_batch(players, self._settings, GAMES_AMONG_ANCHORS, SEED_OF_JUDGING, self._most_turns):
                results.append(Result((one, *[two] * (seats - 1)), result.places))
        return results


def rating_among(results: Sequence[Result]) -> Rating:
    """Return the rating of the player behind the anchors (number 3), with the anchors' mean moved to 1500."""
    *anchors, mine = rate(len(ANCHORS) + 1, results)
    shift = MEAN - sum(rating.points for rating in anchors) / len(anchors)
    return Rating(mine.points + shift, mine.low + shift, mine.high + shift)


def count(results: Sequence[Result]) -> AnchorScore:
    """Return how often player 0 won (alone at the first place), drew (shared it) and lost."""
    won = sum(one.places[0] == 0 and one.places.count(0) == 1 for one in results)
    drawn = sum(one.places[0] == 0 and one.places.count(0) > 1 for one in results)
    return AnchorScore(won, drawn, len(results) - won - drawn)


def _told(tally: AnchorScore) -> dict[str, Any]:
    low, high = wilson(tally.won, tally.games)
    share = tally.won / tally.games
    return {
        "games": tally.games, "won": tally.won, "drawn": tally.drawn, "lost": tally.lost,
        "won_share": share, "won_share_low": low, "won_share_high": high,
    }  # fmt: skip
