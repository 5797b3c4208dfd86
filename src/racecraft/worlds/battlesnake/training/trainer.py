"""Train a snake by self-play: what its games bring along to the common steps. Begin with `build_experiment`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

from racecraft.algorithms.alphazero import AlphaZeroLearner
from racecraft.algorithms.apex import ApexConfig
from racecraft.algorithms.building import build_learner
from racecraft.algorithms.dqn import DqnConfig
from racecraft.algorithms.learner import Learner
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig
from racecraft.algorithms.registry import Algorithm, find_algorithm, require_fit
from racecraft.algorithms.weights import to_arrays
from racecraft.contract.errors import SettingError
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.settings import RolloutConfig
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import apply_overrides, from_dictionary
from racecraft.training.loop import Outcome
from racecraft.training.opponent_pool import OpponentPool
from racecraft.training.request import DEFAULT_ALGORITHM, TrainRequest
from racecraft.training.resume import MessageCallback, open_to_resume
from racecraft.training.settings import JUDGING_SHARE, EvaluationConfig, RuntimeConfig, composed
from racecraft.training.stopping import RATING, StopCondition, parse_stops
from racecraft.training.trainer import Experiment, summary_of
from racecraft.worlds.battlesnake.env.settings import GameSettings, SnakeConfig
from racecraft.worlds.battlesnake.env.world import WorldSettings
from racecraft.worlds.battlesnake.players.network_tree import Network
from racecraft.worlds.battlesnake.players.trained import KIND
from racecraft.worlds.battlesnake.training.evaluator import RatingEvaluator
from racecraft.worlds.battlesnake.training.searched_play import SearchedWorld
from racecraft.worlds.battlesnake.training.self_play import SelfPlayWorld, world_settings
from racecraft.worlds.battlesnake.training.settings import SearchConfig, SelfPlayConfig
from racecraft.worlds.battlesnake.training.symmetries import SYMMETRIES

DEFAULT_STOPS = ("minutes=10",)

WORLD_SETTINGS = Settings(
    snake=SnakeConfig(),
    selfplay=SelfPlayConfig(),
    rollout=RolloutConfig(num_worlds=256, horizon=64),
    network=NetworkConfig(
        conv_filters=(), conv_kernels=(), conv_strides=(), image_units=(128,), hidden_units=(128, 128)
    ),
    evaluation=EvaluationConfig(every=10, episodes=50, share=JUDGING_SHARE),
    runtime=RuntimeConfig(),
)
SEARCHED_SETTINGS = (
    WORLD_SETTINGS.with_group("search", SearchConfig())
    .with_group("rollout", RolloutConfig(num_worlds=64, horizon=32))
    .with_group("selfplay", SelfPlayConfig(anchor_share=0.125, pool_share=0.125))
)
"""Fewer games at once where each position is searched, and most against itself: there a tree teaches all its snakes."""
TUNED: Mapping[str, Any] = {
    "ppo": PpoConfig(
        learning_rate=5e-4, discount=0.995, gae_lambda=0.95, epochs=3, batch_size=2048, entropy_weight=0.01
    ),
    "dqn": DqnConfig(
        learning_rate=5e-4, discount=0.99, batch_size=512, train_every=128, target_every=500, epsilon_last=0.02,
        epsilon_steps=500_000, optimiser="adam", max_grad_norm=10.0, double=True, n_step=3,
    ),
    "apex": ApexConfig(
        learning_rate=5e-4, batch_size=512, train_every=128, target_every=500, optimiser="adam"
    ),
}  # fmt: skip
"""Settings that make a snake strong soonest on two cores (benchmarks); those of dqn and apex are not searched for."""


@dataclass(frozen=True)
class SnakeRequest(TrainRequest):
    """What was asked."""

    kind: ClassVar[str] = KIND
    game: GameSettings


@dataclass(frozen=True)
class SnakePlan:
    """A request made definite."""

    request: SnakeRequest
    algorithm: Algorithm
    settings: Settings
    stops: tuple[StopCondition, ...]
    seed: int
    notes: tuple[str, ...] = ()


Request = SnakeRequest


def plan(request: SnakeRequest) -> SnakePlan:
    """Read and check what is asked.

    Raises:
        UserInputError: A game that cannot be learned, a setting or a stop that is not legal.
    """
    algorithm = find_algorithm(request.algorithm or DEFAULT_ALGORITHM)
    settings = apply_overrides(default_settings(algorithm), request.overrides)
    stops = parse_stops(request.stops or DEFAULT_STOPS, RATING)
    _check(request.game, settings, algorithm)
    return SnakePlan(request, algorithm, settings, stops, 1 if request.seed is None else request.seed)


def plan_resume(path: Path, stops: tuple[str, ...] = ()) -> SnakePlan:
    """Read from a run folder what it was asked for, so that it can go on.

    Raises:
        RunFolderError: No run of a snake.
    """
    _, job, notes = open_to_resume(path, KIND)
    game, algorithm = GameSettings(**job["asked"]["game"]), find_algorithm(job.get("algorithm", DEFAULT_ALGORITHM))
    request = SnakeRequest(game, run=path, seed=job["seed"], algorithm=algorithm.name)
    settings = from_dictionary(default_settings(algorithm), job["settings"])
    return SnakePlan(
        request, algorithm, settings, parse_stops(stops or job["asked"]["stops"], RATING), job["seed"], notes
    )


@contextlib.contextmanager
def build_experiment(planned: SnakePlan, on_message: MessageCallback) -> Iterator[Experiment]:
    """Open the games that are learned in, and the pool of past selves that are met there."""
    settings, game = planned.settings, planned.request.game
    played = world_settings(WorldSettings(game), settings.snake, settings.rollout.num_worlds)
    with contextlib.closing(_games(played, planned)) as world:
        title = f"snakes: {game.ruleset}, {game.players} on {game.width}x{game.height}, map {game.map}"
        require_fit(planned.algorithm, world.spec.actions, title, is_searched=True)
        pool = _pool_of_untrained(planned, world)
        world.meet(pool)

        def evaluator(learner: Learner, run: RunFolder) -> RatingEvaluator:
            return RatingEvaluator(
                GreedyPolicy(learner), played, settings.evaluation.episodes, settings.snake.max_turns
            )

        yield Experiment(
            kind=KIND,
            world=world,
            algorithm=planned.algorithm,
            settings=settings,
            seed=planned.seed,
            stops=planned.stops,
            evaluator=evaluator,
            request={"game": asdict(game)},
            metadata={"game": asdict(game)},
            title=title,
            folder_name="snakes",
            notes=planned.notes,
            learner=lambda: _learner(planned, world),
            after_update=pool.learned,
            parts={"opponents": pool},
        )


def summary(planned: SnakePlan, run: RunFolder, outcome: Outcome) -> dict[str, Any]:
    """Return the figures of `racecraft snakes train --json`."""
    figures = summary_of(outcome, run, planned.seed)
    del figures["solved"]
    return {"game": asdict(planned.request.game), **figures}


def default_settings(algorithm: Algorithm) -> Settings:
    """Return what snakes are taught with."""
    if algorithm.searches:
        return composed(SEARCHED_SETTINGS, algorithm)
    return composed(WORLD_SETTINGS, algorithm, TUNED.get(algorithm.name))


def _games(played: WorldSettings, planned: SnakePlan) -> SelfPlayWorld | SearchedWorld:
    """Return the games that are learned in, searched where the algorithm learns by search."""
    games = SelfPlayWorld(played, planned.settings.selfplay)
    return SearchedWorld(games, planned.settings.search) if planned.algorithm.searches else games


def _learner(planned: SnakePlan, world: SelfPlayWorld | SearchedWorld) -> Learner:
    """Return the learner; a search asks it from now on."""
    learner = build_learner(planned.algorithm, world.spec, planned.settings, planned.seed)
    if isinstance(world, SearchedWorld):
        seen = planned.settings.snake
        assert isinstance(learner, AlphaZeroLearner), "who learns by search has a critic to be asked"
        learner.symmetries = SYMMETRIES
        world.ask(Network(learner.policy, seen))
    return learner


def _pool_of_untrained(planned: SnakePlan, world: SelfPlayWorld | SearchedWorld) -> OpponentPool:
    """Return a pool that holds one untrained self."""
    learner = build_learner(planned.algorithm, world.spec, planned.settings, planned.seed)
    config = planned.settings.selfplay
    first = to_arrays(learner.state_dict())["network"]
    return OpponentPool(learner.policy_spec, first, config.pool_size, config.pool_every, planned.seed)


def _check(game: GameSettings, settings: Settings, algorithm: Algorithm) -> None:
    """Refuse what cannot be learned by self-play."""
    if settings.network.memory != "none" or settings.network.stack_size > 1:
        raise SettingError(
            "network.memory or network.stack_size is set; a snake is asked board by board, in many games at once, and "
            "sees the whole board. Leave them at none and 1."
        )
    if game.players < 2:
        raise SettingError(
            "--snakes is {players}; expected at least 2: a snake learns from those it meets.", players=game.players
        )
    if algorithm.whole_episodes:
        raise SettingError(
            "--algorithm {name} learns from whole episodes; snakes learn from rollout.horizon turns of "
            "every game, since games differ much in length. Use ppo.",
            name=algorithm.name,
        )
    if settings.rollout.episodes_per_iteration is not None:
        raise SettingError(
            "rollout.episodes_per_iteration is set; snakes learn from rollout.horizon turns of every game, since games "
            "differ much in length. Leave it out."
        )
