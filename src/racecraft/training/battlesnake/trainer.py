"""Train a snake by self-play, on the same loop as the cars. Begin with `train_snakes`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from racecraft.algorithms.ppo import PpoLearner
from racecraft.contract.errors import SettingError
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.envs.battlesnake.world import WorldSettings
from racecraft.formats.run_folder import RunFolder
from racecraft.players.battlesnake.trained import KIND
from racecraft.players.trained import GreedyPolicy
from racecraft.settings.groups import (
    EvaluationConfig,
    NetworkConfig,
    PpoConfig,
    RolloutConfig,
    TrainSettings,
)
from racecraft.settings.overrides import apply_overrides, from_dictionary
from racecraft.training.battlesnake.evaluator import RatingJudge
from racecraft.training.battlesnake.self_play import SelfPlayWorld, world_settings
from racecraft.training.callbacks import Listener
from racecraft.training.loop import Outcome
from racecraft.training.resume import Say, open_to_resume
from racecraft.training.stopping import Stop, parse_stops
from racecraft.training.trainer import Course, resume, summary_of, train

DEFAULT_STOPS = ("minutes=10",)

SNAKE_SETTINGS = TrainSettings(
    rollout=RolloutConfig(num_worlds=256, horizon=64),
    network=NetworkConfig(
        conv_filters=(), conv_kernels=(), conv_strides=(), image_units=(128,), hidden_units=(128, 128)
    ),
    ppo=PpoConfig(learning_rate=5e-4, discount=0.995, gae_lambda=0.95, epochs=3, batch_size=2048, entropy_weight=0.01),
    evaluation=EvaluationConfig(every=10, episodes=50),
)
"""Settings that make a snake strong soonest on two cores (benchmarks)."""


@dataclass(frozen=True)
class SnakeRequest:
    """What was asked."""

    game: GameSettings
    stops: tuple[str, ...] = ()
    """As typed; none: `DEFAULT_STOPS`."""
    run: Path | None = None
    seed: int = 1
    overrides: tuple[str, ...] = ()
    clone_from: str | None = None
    """RUN, RUN:best, RUN:last or RUN:N, whose weights the training begins with; None: fresh weights."""


@dataclass(frozen=True)
class TrainedSnakes:
    """A training that ended, and where it lies."""

    game: GameSettings
    seed: int
    run: RunFolder
    outcome: Outcome

    def summary(self) -> dict[str, Any]:
        """Return the figures of `racecraft snakes train --json`."""
        figures = summary_of(self.outcome, self.run, self.seed)
        del figures["solved"]
        return {"game": asdict(self.game), **figures}


def train_snakes(request: SnakeRequest, listener: Listener, say: Say = print) -> TrainedSnakes:
    """Train until a stop holds.

    Args:
        request: What is trained.
        listener: Watches the training.
        say: Says a line to a person.

    Raises:
        UserInputError: A game that cannot be played or learned, a setting or a stop that is not legal.
    """
    settings = apply_overrides(SNAKE_SETTINGS, request.overrides)
    stops = parse_stops(request.stops or DEFAULT_STOPS)
    with _course(request.game, settings, stops, request.seed) as course:
        run, outcome = train(course, request.run, listener, say, request.clone_from)
    return TrainedSnakes(request.game, request.seed, run, outcome)


def resume_snakes(path: Path, stops: tuple[str, ...], listener: Listener, say: Say = print) -> TrainedSnakes:
    """Go on with a run from its last whole iteration, as if it had never stopped.

    Args:
        path: The run folder.
        stops: New stops; none: those the run was begun with.
        listener: Watches the training.
        say: Says a line to a person.

    Raises:
        RunFolderError: No run of a snake, or it is being trained.
    """
    run, job, notes = open_to_resume(path, KIND)
    game, seed = GameSettings(**job["asked"]["game"]), job["seed"]
    settings = from_dictionary(TrainSettings, job["settings"])
    with _course(game, settings, parse_stops(stops or job["asked"]["stops"]), seed, notes) as course:
        outcome = resume(course, run, listener, say)
    return TrainedSnakes(game, seed, run, outcome)


@contextlib.contextmanager
def _course(
    game: GameSettings, settings: TrainSettings, stops: tuple[Stop, ...], seed: int, notes: tuple[str, ...] = ()
) -> Iterator[Course]:
    """Open the games that are learned in; they are closed afterwards."""
    _check(game, settings)
    asked = {"game": asdict(game)}
    with contextlib.ExitStack() as opened:
        played = world_settings(WorldSettings(game), settings.selfplay, settings.rollout.num_worlds)
        world = SelfPlayWorld(played, settings, seed)
        opened.callback(world.close)

        def judge(learner: PpoLearner, _: RunFolder) -> RatingJudge:
            most_turns = settings.selfplay.max_turns
            return RatingJudge(GreedyPolicy(learner), played, settings.evaluation.episodes, most_turns)

        yield Course(
            kind=KIND,
            world=world,
            settings=settings,
            seed=seed,
            stops=stops,
            judge=judge,
            asked=asked,
            card=asked,
            title=f"snakes: {game.ruleset}, {game.players} on {game.width}x{game.height}, map {game.map}",
            folder_name="snakes",
            notes=notes,
            after_update=world.learned,
        )


def _check(game: GameSettings, settings: TrainSettings) -> None:
    """Refuse what cannot be learned by self-play."""
    if game.players < 2:
        raise SettingError(f"--snakes is {game.players}; expected at least 2: a snake learns from those it meets.")
    if settings.rollout.episodes_per_iteration is not None:
        raise SettingError(
            "rollout.episodes_per_iteration is set; snakes learn from rollout.horizon turns of every game, since games "
            "differ much in length. Leave it out."
        )
    if settings.selfplay.view % 2 == 0:
        raise SettingError(f"selfplay.view is {settings.selfplay.view}; expected an odd number of squares.")
