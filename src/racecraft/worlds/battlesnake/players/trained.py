"""A snake that was trained: its policy out of a run folder, from files alone (safetensors and JSON)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import load_policy
from racecraft.worlds.battlesnake.env.board import MOVES, Board
from racecraft.worlds.battlesnake.env.observation import observe_board
from racecraft.worlds.battlesnake.env.settings import GameSettings, SnakeConfig
from racecraft.worlds.battlesnake.players.network_tree import Network, PolicyValueNetwork
from racecraft.worlds.battlesnake.players.protocol import MoveRequest, PlayerError

KIND = "battlesnake"
"""What job.json calls a run of a snake."""


class LikelyPolicy(Policy, Protocol):
    """A policy over single choices that can say how likely each is."""

    def probabilities(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return float32 (R, A)."""
        ...


class TrainedSnake:
    """A policy at a board: one forward pass a move, no search.

    It plays any board, ruleset and number of snakes; how well, on others than it was trained for, nobody promises.

    Args:
        policy: The policy.
        seen: What it sees: side of the window, with or without the outlook.
        name: Whose it is, for messages.
        most_snakes: How many it was trained among; None: nobody knows. Among more it is no guide for a search, whose
            tree it would lead astray with what holds in a duel.
    """

    def __init__(
        self, policy: LikelyPolicy, seen: SnakeConfig, name: str = "policy", most_snakes: int | None = None
    ) -> None:
        self.policy, self.seen, self.name, self.most_snakes = policy, seen, name, most_snakes

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the likeliest move."""
        return self.choose_many([MoveRequest(board, snake_id, settings)])[0]

    def choose_many(self, questions: Sequence[MoveRequest]) -> list[str]:
        """Return the likeliest move for every question, from one forward pass for all."""
        seen, mask = self._see(questions)
        return [MOVES[int(way)] for way in self.policy.act(seen, mask)]

    def chances(self, questions: Sequence[MoveRequest]) -> Array:
        """Return how likely the policy makes each move, float32 (Q, 4); exactly 0 where a move is surely fatal."""
        seen, mask = self._see(questions)
        return self.policy.probabilities(seen, mask)

    def move_priors(self, board: Board, settings: GameSettings) -> Array | None:
        """Return for every living snake, in their order, how likely the policy makes its moves, float32 (M, 4).

        None among more snakes than it was trained among.
        """
        living = board.alive()
        if self.most_snakes is not None and len(living) > self.most_snakes:
            return None
        return self.chances([MoveRequest(board, snake.id, settings) for snake in living])

    def _see(self, questions: Sequence[MoveRequest]) -> tuple[dict[str, Array], Array]:
        looks = [
            observe_board(board, settings, snake_id, self.seen.view, self.seen.outlook)
            for board, snake_id, settings in questions
        ]
        seen = {name: np.stack([one[name] for one, _ in looks]) for name in looks[0][0]}
        return seen, np.stack([mask for _, mask in looks])


def load_trained_snake(name: str) -> TrainedSnake:
    """Load a snake from its run folder.

    Args:
        name: RUN, RUN:best, RUN:last or RUN:N.

    Raises:
        RunFolderError: No run folder, or the run of something else than a snake.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    path, which = split_source(name)
    run = RunFolder.open(path)
    trained_in = run.read_job_of(KIND).get("asked", {}).get("game", {})
    policy = load_policy(run, which)
    return TrainedSnake(policy, snake_config_in(policy.metadata["settings"]), name, trained_in.get("players"))


def load_network(name: str) -> Network:
    """Load a snake's policy with its critic from its run folder, for the leaves of a search.

    Args:
        name: RUN, RUN:best, RUN:last or RUN:N.

    Raises:
        RunFolderError: No run folder, or the run of something else than a snake.
        CheckpointError: No such checkpoint, or a damaged one.
        PlayerError: Its algorithm has no critic.
    """
    if not _run_there(name):
        raise PlayerError(
            "search:{name}: no such folder; expected the RUN of a training, such as search:runs/snakes-1.", name=name
        )
    snake = load_trained_snake(name)
    policy = getattr(snake.policy, "policy", snake.policy)
    if not isinstance(policy, PolicyValueNetwork):
        algorithm = getattr(getattr(snake.policy, "spec", None), "algorithm", "its algorithm")
        raise PlayerError(
            "search:{name}: {algorithm} has no critic that could say what a position is worth; expected the run of "
            "ppo or alphazero. search+{name} asks the policy alone.",
            name=name,
            algorithm=algorithm,
        )
    return Network(policy, snake.seen)


def _run_there(name: str) -> bool:
    return Path(split_source(name)[0]).is_dir()


def snake_config_in(settings: Mapping[str, Mapping[str, Any]]) -> SnakeConfig:
    """Return what a run's snakes see; runs from before `snake` was a group of its own told it among `selfplay`."""
    section = settings.get("snake") or settings["selfplay"]
    return SnakeConfig(view=section["view"], outlook=section["outlook"])
