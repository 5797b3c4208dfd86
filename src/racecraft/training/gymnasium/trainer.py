"""Train on any registered Gymnasium environment, on the same loop as the cars. Begin with `train_gym`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium

from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.world import EpisodeRecord, World
from racecraft.envs.adapters.from_gymnasium import GymnasiumWorld
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise
from racecraft.settings.groups import (
    EvaluationConfig,
    NetworkConfig,
    PpoConfig,
    RolloutConfig,
    RuntimeConfig,
    TrainSettings,
)
from racecraft.settings.overrides import apply_overrides, from_dictionary
from racecraft.training.callbacks import Listener, Verdict
from racecraft.training.deepracer.presets import fit_worlds_to_episodes
from racecraft.training.loop import Outcome
from racecraft.training.resume import Say, open_to_resume
from racecraft.training.stopping import Stop, parse_stops
from racecraft.training.trainer import Course, resume, summary_of, train

KIND = "gymnasium"
"""What job.json calls a run of a Gymnasium environment."""
CONFIRMING_EPISODES = 100
"""A score that meets the environment's threshold is confirmed over so many episodes, Gymnasium's own measure."""
JUDGING_WORLDS = 20
SEED_OF_JUDGING = 1_000_000_007

VECTOR_SETTINGS = TrainSettings(
    rollout=RolloutConfig(num_worlds=8, horizon=32),
    network=NetworkConfig(hidden_units=(64, 64), activation="tanh"),
    ppo=PpoConfig(learning_rate=1e-3, discount=0.98, gae_lambda=0.8, epochs=20, batch_size=256, entropy_weight=0.0),
    evaluation=EvaluationConfig(every=8, episodes=20, stable_after=1),
    runtime=RuntimeConfig(threads=1),
)
"""Settings that serve small worlds of vectors. One thread: networks this small only wait for a second one."""


@dataclass(frozen=True)
class GymRequest:
    """What was asked."""

    environment: str
    """A registered id, such as "CartPole-v1"."""
    stops: tuple[str, ...] = ()
    """As typed; none: the environment's own threshold where it has one, and minutes=30."""
    run: Path | None = None
    seed: int = 1
    overrides: tuple[str, ...] = ()
    clone_from: str | None = None
    """RUN, RUN:best, RUN:last or RUN:N, whose weights the training begins with; None: fresh weights."""


@dataclass(frozen=True)
class TrainedGym:
    """A training that ended, and where it lies."""

    environment: str
    seed: int
    run: RunFolder
    outcome: Outcome

    def summary(self) -> dict[str, Any]:
        """Return the figures of `racecraft gym train --json`."""
        return {"environment": self.environment, **summary_of(self.outcome, self.run, self.seed)}


def train_gym(request: GymRequest, listener: Listener, say: Say = print) -> TrainedGym:
    """Train until a stop holds.

    Args:
        request: What is trained.
        listener: Watches the training.
        say: Says a line to a person.

    Raises:
        UserInputError: No such environment, a space that cannot be learned, a setting or a stop that is not legal.
    """
    settings = fit_worlds_to_episodes(apply_overrides(VECTOR_SETTINGS, request.overrides), [])
    threshold = reward_threshold(request.environment)
    default_stops = ((f"score={threshold:g}",) if threshold is not None else ()) + ("minutes=30",)
    with _course(request.environment, settings, parse_stops(request.stops or default_stops), request.seed) as course:
        run, outcome = train(course, request.run, listener, say, request.clone_from)
    return TrainedGym(request.environment, request.seed, run, outcome)


def resume_gym(path: Path, stops: tuple[str, ...], listener: Listener, say: Say = print) -> TrainedGym:
    """Go on with a run from its last whole iteration, as if it had never stopped.

    The world begins each copy's episode again and plays its actions up to where it was; an environment that then shows
    something else (its state hangs on more than seed and actions) begins its episodes anew, and that is said.

    Args:
        path: The run folder.
        stops: New stops; none: those the run was begun with.
        listener: Watches the training.
        say: Says a line to a person.

    Raises:
        RunFolderError: No run of a Gymnasium environment, or it is being trained.
    """
    run, job, notes = open_to_resume(path, KIND)
    environment, seed = job["asked"]["environment"], job["seed"]
    settings = from_dictionary(TrainSettings, job["settings"])
    with _course(environment, settings, parse_stops(stops or job["asked"]["stops"]), seed, notes) as course:
        outcome = resume(course, run, listener, say)
    return TrainedGym(environment, seed, run, outcome)


@contextlib.contextmanager
def _course(
    environment: str, settings: TrainSettings, stops: tuple[Stop, ...], seed: int, notes: tuple[str, ...] = ()
) -> Iterator[Course]:
    """Open the worlds that are learned and judged in; they are closed afterwards."""
    threshold = reward_threshold(environment)
    with contextlib.ExitStack() as opened:
        world = GymnasiumWorld(environment, settings.rollout.num_worlds)
        opened.callback(world.close)
        judged = GymnasiumWorld(environment, min(settings.evaluation.episodes, JUDGING_WORLDS))
        opened.callback(judged.close)
        yield Course(
            kind=KIND,
            world=world,
            settings=settings,
            seed=seed,
            stops=stops,
            judge=lambda learner, _: ReturnJudge(
                judged, GreedyPolicy(learner), settings.evaluation.episodes, threshold
            ),
            asked={"environment": environment},
            card={"environment": environment},
            title=environment,
            folder_name=environment.replace("/", "-"),
            notes=notes,
            lasting=None,
        )


class ReturnJudge:
    """Judges by the mean return of greedy episodes.

    Args:
        world: Copies that are judged in.
        policy: The judged policy.
        episodes: How many episodes count.
        threshold: The mean return that counts as solved; None where none does.
    """

    score_name = "return"

    def __init__(self, world: World, policy: GreedyPolicy, episodes: int, threshold: float | None) -> None:
        self._world, self._policy, self._episodes, self._threshold = world, policy, episodes, threshold

    def score(self, episode: EpisodeRecord) -> float:
        """Return an episode's return."""
        return episode.reward

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether one episode alone met the threshold."""
        return self._threshold is not None and episode.reward >= self._threshold

    def judge(self) -> Verdict:
        """Play; a mean that meets the threshold is confirmed over CONFIRMING_EPISODES."""
        episodes = self._play(self._episodes, SEED_OF_JUDGING)
        if self._meets(episodes) and len(episodes) < CONFIRMING_EPISODES:
            episodes += self._play(CONFIRMING_EPISODES - len(episodes), SEED_OF_JUDGING + 1)
        summary = summarise(episodes)
        details = {
            "episodes": summary.episodes,
            "mean_return": summary.mean_reward,
            "std_return": summary.std_reward,
            "mean_steps": summary.mean_steps,
            "threshold": self._threshold,
        }
        return Verdict(summary.mean_reward, self._meets(episodes), details=details)

    def _play(self, count: int, seed: int) -> list[EpisodeRecord]:
        each = -(-count // self._world.spec.num_worlds)
        return play_episodes(self._policy, self._world, episodes_each=each, seed=seed)[:count]

    def _meets(self, episodes: list[EpisodeRecord]) -> bool:
        return self._threshold is not None and summarise(episodes).mean_reward >= self._threshold


def reward_threshold(environment: str) -> float | None:
    """Return the mean return at which an environment counts as solved, where its registration says one.

    Raises:
        UserInputError: No such environment.
    """
    try:
        return gymnasium.spec(environment).reward_threshold
    except gymnasium.error.Error as error:
        known = sorted(gymnasium.registry)
        raise UserInputError(
            f"There is no Gymnasium environment '{environment}'. {_hint(environment, known)}"
        ) from error


def _hint(name: str, known: list[str]) -> str:
    hint = nearest(name, known)
    return hint if hint.startswith("Did") else "`import` the package that registers it, or name a built-in one."
