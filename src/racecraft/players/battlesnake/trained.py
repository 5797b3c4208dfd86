"""A snake that was trained: its policy out of a run folder, from files alone (safetensors and JSON)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from racecraft.algorithms.ppo import PpoLearner
from racecraft.algorithms.weights import to_tensors
from racecraft.contract.world import Array, DiscreteActions, WorldSpec
from racecraft.envs.battlesnake.board import MOVES, Board
from racecraft.envs.battlesnake.observation import observation_specs, observe_board
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.players.battlesnake.protocol import Question
from racecraft.players.trained import GreedyPolicy
from racecraft.settings.groups import SelfPlayConfig, TrainSettings
from racecraft.settings.overrides import from_dictionary

KIND = "battlesnake"
"""What job.json calls a run of a snake."""


class TrainedSnake:
    """A policy at a board: one forward pass a move, no search.

    It plays any board, ruleset and number of snakes; how well, on others than it was trained for, nobody promises.

    Args:
        learner: The policy.
        seen: What it sees: side of the window, with or without the outlook.
        name: Whose it is, for messages.
    """

    def __init__(self, learner: PpoLearner, seen: SelfPlayConfig, name: str = "policy") -> None:
        self._learner, self.seen, self.name = learner, seen, name

    @property
    def policy(self) -> GreedyPolicy:
        """The bare policy, for worlds that show what it sees."""
        return GreedyPolicy(self._learner)

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the likeliest move."""
        return self.choose_many([Question(board, snake_id, settings)])[0]

    def choose_many(self, questions: Sequence[Question]) -> list[str]:
        """Return the likeliest move for every question, from one forward pass for all."""
        seen, mask = self._see(questions)
        return [MOVES[int(way)] for way in self._learner.choose(seen, mask)]

    def chances(self, questions: Sequence[Question]) -> Array:
        """Return how likely the policy makes each move, float32 (Q, 4); exactly 0 where a move is surely fatal."""
        seen, mask = self._see(questions)
        return self._learner.chances(seen, mask)

    def weigh(self, board: Board, settings: GameSettings) -> Array:
        """Return for every living snake, in their order, how likely the policy makes its moves, float32 (M, 4)."""
        return self.chances([Question(board, snake.id, settings) for snake in board.alive()])

    def _see(self, questions: Sequence[Question]) -> tuple[dict[str, Array], Array]:
        looks = [
            observe_board(board, settings, snake_id, self.seen.view, self.seen.outlook)
            for board, snake_id, settings in questions
        ]
        seen = {name: np.stack([one[name] for one, _ in looks]) for name in looks[0][0]}
        return seen, np.stack([mask for _, mask in looks])


def split(name: str) -> tuple[str, str]:
    """Return the folder and which checkpoint of it, "best" where none is named.

    >>> split("runs/snakes-1:last"), split("runs/snakes-1")
    (('runs/snakes-1', 'last'), ('runs/snakes-1', 'best'))
    """
    path, colon, which = name.rpartition(":")
    return (path, which) if colon and (which in ("best", "last") or which.isdigit()) else (name, "best")


def load_trained_snake(name: str) -> TrainedSnake:
    """Load a snake from its run folder.

    Args:
        name: RUN, RUN:best, RUN:last or RUN:N.

    Raises:
        RunFolderError: No run folder, or the run of something else than a snake.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    path, which = split(name)
    run = RunFolder.open(path)
    run.read_job_of(KIND)
    weights, card = Checkpoints(run.checkpoints).load_policy(which)
    settings = from_dictionary(TrainSettings, card["settings"])
    return TrainedSnake(_rebuild(settings, weights), settings.selfplay, name)


def _rebuild(settings: TrainSettings, weights: Mapping[str, Any]) -> PpoLearner:
    seen = observation_specs(settings.selfplay.view, settings.selfplay.outlook)
    spec = WorldSpec("battlesnake", 1, 1, seen, DiscreteActions(4, MOVES), has_action_mask=True)
    learner = PpoLearner(spec, settings.network, replace(settings.ppo, precision="float32"), seed=0)
    learner.load_state_dict({"network": to_tensors(weights)})
    return learner
