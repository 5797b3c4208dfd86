"""Train on any registered Gymnasium environment. Begin with `build_experiment`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

from racecraft.algorithms.apex import ApexConfig
from racecraft.algorithms.building import build_learner
from racecraft.algorithms.dqn import DqnConfig
from racecraft.algorithms.es import EsConfig
from racecraft.algorithms.learner import Learner
from racecraft.algorithms.multi_policy import MultiPolicyLearner, group_spec
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig
from racecraft.algorithms.registry import Algorithm, find_algorithm
from racecraft.algorithms.reinforce import ReinforceConfig
from racecraft.algorithms.sac import SacConfig
from racecraft.contract.world import World
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.replay_settings import ReplayConfig
from racecraft.rollout.settings import RolloutConfig
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import apply_overrides, from_dictionary
from racecraft.training.custom_code import OwnCode, copy_code, own_code_of_names
from racecraft.training.loop import Outcome
from racecraft.training.plain import SMALL_WORLDS
from racecraft.training.request import DEFAULT_ALGORITHM, TrainRequest
from racecraft.training.resume import MessageCallback, open_to_resume
from racecraft.training.return_evaluator import CONFIRMING_EPISODES, ReturnEvaluator
from racecraft.training.settings import JUDGING_SHARE, EvaluationConfig, composed
from racecraft.training.stopping import SCORE, StopCondition, parse_stops
from racecraft.training.trainer import Experiment, summary_of
from racecraft.worlds.gymnasium.env.from_vector_env import VectorEnvWorld
from racecraft.worlds.gymnasium.env.recipe import Recipe
from racecraft.worlds.gymnasium.evaluation import (
    is_judged_as_rows,
    open_judging_world,
    open_world,
    reward_threshold,
)

KIND = "gymnasium"
"""What job.json calls a run of a Gymnasium environment."""
JUDGING_WORLDS = 20
SEEDS_APART = 1_000
"""Between the seeds of groups that learn side by side."""

TUNED: Mapping[str, Any] = {
    "ppo": PpoConfig(learning_rate=1e-3, discount=0.99, gae_lambda=0.9, epochs=10, batch_size=64, entropy_weight=0.01),
    "dqn": DqnConfig(
        learning_rate=1e-3, batch_size=64, train_every=2, target_every=128, epsilon_last=0.04, epsilon_steps=8000,
        optimiser="adam", max_grad_norm=10.0, double=True, n_step=3,
    ),
    "apex": ApexConfig(
        learning_rate=1e-3, batch_size=64, train_every=2, target_every=128, ladder=4.0, optimiser="adam",
        max_grad_norm=10.0,
    ),
    "sac": SacConfig(learning_rate=1e-3, noise_correlation=0.8),
    "reinforce": ReinforceConfig(learning_rate=3e-3),
    "es": EsConfig(),
}  # fmt: skip
"""What each algorithm learns small worlds with; one that is not here takes its own defaults."""
VALUES = {"network": NetworkConfig(hidden_units=(128, 128), activation="relu")}
APART = NetworkConfig(hidden_units=(64, 64), activation="tanh", separate_networks=True)
"""Of -100 points an episode the critic's error is so large that layers it shared would learn little of the policy."""
TUNED_WORLDS: Mapping[str, Mapping[str, Any]] = {
    "ppo": {
        "rollout": RolloutConfig(num_worlds=8, horizon=128),
        "network": APART,
        "evaluation": EvaluationConfig(every=2, episodes=20, stable_after=1),
    },
    "dqn": VALUES,
    "apex": VALUES,
    "sac": {
        "rollout": RolloutConfig(num_worlds=8, horizon=16),
        "network": NetworkConfig(hidden_units=(64, 64), activation="relu"),
        "replay": ReplayConfig(learning_starts=500),
    },
    "reinforce": {"network": APART},
    "es": {"rollout": RolloutConfig(num_worlds=32)},
    "bc": {
        "rollout": RolloutConfig(num_worlds=1, horizon=1),
        "network": APART,  # as PPO's, which goes on from it
        "evaluation": EvaluationConfig(episodes=20, every=1),
    },
}
"""Groups of SMALL_WORLDS that an algorithm wants otherwise."""


@dataclass(frozen=True)
class GymRequest(TrainRequest):
    """What was asked."""

    kind: ClassVar[str] = KIND
    environment: str
    """A registered id, such as "CartPole-v1", or "module:Class"."""
    recipe: Recipe = field(default_factory=Recipe)
    """How it is made beside its name."""
    environment_code: OwnCode | None = None
    """What it is remade from elsewhere; None: the files of its own class, where it has one."""


@dataclass(frozen=True)
class GymPlan:
    """A request made definite."""

    request: GymRequest
    algorithm: Algorithm
    settings: Settings
    stops: tuple[StopCondition, ...]
    seed: int
    threshold: float | None
    """The mean return that counts as solved; None where none does."""
    notes: tuple[str, ...] = ()


Request = GymRequest


def plan(request: GymRequest) -> GymPlan:
    """Read and check what is asked.

    Raises:
        UserInputError: No such environment, a setting or a stop that is not legal.
    """
    algorithm = find_algorithm(request.algorithm or DEFAULT_ALGORITHM)
    request.recipe.load_wrappers()
    defaults = with_judging_share(default_settings(algorithm), request.environment, request.recipe)
    settings = fit_worlds_to_episodes(overridden(defaults, request.overrides))
    threshold = reward_threshold(request.environment)
    default_stops = ((f"score={threshold:g}",) if threshold is not None else ()) + ("minutes=30",)
    stops = parse_stops(request.stops or default_stops, SCORE)
    return GymPlan(request, algorithm, settings, stops, 1 if request.seed is None else request.seed, threshold)


def plan_resume(path: Path, stops: tuple[str, ...] = ()) -> GymPlan:
    """Read from a run folder what it was asked for, so that it can go on.

    The world begins each copy's episode again and plays its actions up to where it was; an environment that then shows
    something else (its state hangs on more than seed and actions) begins its episodes anew, and that is said.

    Raises:
        RunFolderError: No run of a Gymnasium environment.
    """
    _, job, notes = open_to_resume(path, KIND)
    asked = job["asked"]
    algorithm = find_algorithm(job.get("algorithm", DEFAULT_ALGORITHM))
    request = GymRequest(
        asked["environment"], run=path, seed=job["seed"], algorithm=algorithm.name, recipe=Recipe.of_data(asked)
    )
    settings = from_dictionary(default_settings(algorithm), job["settings"])
    conditions = parse_stops(stops or asked["stops"], SCORE)
    threshold = reward_threshold(request.environment)
    return GymPlan(request, algorithm, settings, conditions, job["seed"], threshold, notes)


@contextlib.contextmanager
def build_experiment(planned: GymPlan, on_message: MessageCallback) -> Iterator[Experiment]:
    """Open the copies that are learned and judged in."""
    environment, recipe, settings = planned.request.environment, planned.request.recipe, planned.settings
    code = planned.request.environment_code or own_code_of_names([environment, *recipe.wrappers])
    with contextlib.ExitStack() as worlds:
        world = open_world(environment, settings.rollout.num_worlds, recipe)
        worlds.callback(world.close)
        judged = open_judging_world(environment, min(settings.evaluation.episodes, JUDGING_WORLDS), recipe)
        worlds.callback(judged.close)
        has_rows = isinstance(judged, VectorEnvWorld)
        confirming = open_judging_world(environment, CONFIRMING_EPISODES, recipe) if has_rows else judged
        worlds.callback(confirming.close)
        yield Experiment(
            kind=KIND,
            world=world,
            algorithm=planned.algorithm,
            settings=settings,
            seed=planned.seed,
            stops=planned.stops,
            evaluator=lambda learner, _: ReturnEvaluator(
                judged, confirming, GreedyPolicy(learner), settings.evaluation.episodes, planned.threshold
            ),
            request={"environment": environment, **recipe.as_data()},
            metadata={"environment": environment},
            title=environment,
            folder_name=environment.replace("/", "-").replace(":", "-"),
            notes=(*planned.notes, *code.stays),
            copy_user_files=lambda run: copy_code(code.texts, run),
            learner=(lambda: _learner_of_groups(planned, world)) if world.spec.groups else None,
            world_lasts=None,
        )


def _learner_of_groups(planned: GymPlan, world: World) -> Learner:
    """Return a learner for each group of a user's own world, side by side.

    The world may say in `group_settings` what a group has otherwise, as after --set, and in `still_groups` which learn
    nothing.
    """
    spec, groups = world.spec, getattr(world, "group_settings", {})
    members = {}
    for number, (name, group) in enumerate(spec.groups.items()):
        settings = overridden(planned.settings, groups.get(name, ()))
        rows = group_spec(name, group, spec.num_worlds * spec.num_agents)
        members[name] = build_learner(planned.algorithm, rows, settings, planned.seed + SEEDS_APART * number)
    return MultiPolicyLearner(spec, members, getattr(world, "still_groups", frozenset()))


def summary(planned: GymPlan, run: RunFolder, outcome: Outcome) -> dict[str, Any]:
    """Return the figures of `racecraft gym train --json`."""
    return {"environment": planned.request.environment, **summary_of(outcome, run, planned.seed)}


def default_settings(algorithm: Algorithm) -> Settings:
    """Return what small worlds of vectors are learned with."""
    settings = SMALL_WORLDS
    for name, group in TUNED_WORLDS.get(algorithm.name, {}).items():
        settings = settings.with_group(name, group)
    return composed(settings, algorithm, TUNED.get(algorithm.name))


def with_judging_share(settings: Settings, environment: str, recipe: Recipe) -> Settings:
    """Return settings whose evaluations take a fifth of the steps at most; vector versions judge quickly, and more."""
    if is_judged_as_rows(environment, recipe):
        return settings
    return settings.with_group("evaluation", replace(settings.evaluation, share=JUDGING_SHARE))


def overridden(settings: Settings, overrides: Sequence[str]) -> Settings:
    """Return settings with what was said otherwise; a policy of the user's own brings its critic unless told so."""
    composed = apply_overrides(settings, overrides)
    if composed.network.policy is None or any(one.startswith("network.separate_networks=") for one in overrides):
        return composed
    return composed.with_group("network", replace(composed.network, separate_networks=False))


def fit_worlds_to_episodes(settings: Settings) -> Settings:
    """Give every world the same quota of whole episodes: their number must divide the episodes of an iteration."""
    episodes, worlds = settings.rollout.episodes_per_iteration, settings.rollout.num_worlds
    if episodes is None or episodes % worlds == 0:
        return settings
    fitting = max(count for count in range(1, min(episodes, worlds) + 1) if episodes % count == 0)
    return settings.with_group("rollout", replace(settings.rollout, num_worlds=fitting))
