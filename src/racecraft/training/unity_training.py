"""Train on a Unity scene, on the same loop as the cars. Begin with `train_unity`.

The agents of a behavior learn side by side in one player (or several), and the greedy policy is judged in a player of
its own that stays open: starting one takes seconds. A RESET need not put an agent back, so from the second judgement on
each agent's first episode, perhaps half told, is left out. The Editor is one player only; there the training episodes
themselves are the judgement.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.algorithms.ppo import PpoLearner
from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, World
from racecraft.envs.unity.behaviors import card_of
from racecraft.envs.unity.builds import Build, find_build
from racecraft.envs.unity.trainer_words import words_of
from racecraft.envs.unity.world import UnityWorld
from racecraft.formats.checkpoint import save_state
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.trainer_yaml import TrainerConfig, read_trainer_yaml
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.statistics import summarise
from racecraft.settings.groups import (
    EvaluationConfig,
    NetworkConfig,
    PpoConfig,
    RolloutConfig,
    RuntimeConfig,
    TrainSettings,
)
from racecraft.settings.overrides import apply_overrides, as_dictionary, with_values
from racecraft.training.bounded_episodes import CUT, play_bounded
from racecraft.training.car_plan import versions
from racecraft.training.events import Listener, Verdict
from racecraft.training.keeping import RunKeeper
from racecraft.training.loop import Judge, Outcome, TrainingLoop
from racecraft.training.racing import use_threads
from racecraft.training.stopping import Stop, parse_stops

KIND = "unity"
"""What job.json calls a run of a Unity scene."""
BASIC = "builtin:Basic"
BASIC_SCORE = 0.92
"""What counts as solved; 0.93 is the best there is."""
OBSERVATIONS = "observations.safetensors"
"""What the judged policy saw, in the run folder; an export is checked on it."""
OBSERVATIONS_KEPT = 256
SHORTEST_PATIENCE, PATIENCE = 200, 3
"""A judged episode may last so many ticks, or so many times the longest training episode, whichever is more."""

UNITY_SETTINGS = TrainSettings(
    rollout=RolloutConfig(num_worlds=32, horizon=64),
    network=NetworkConfig(hidden_units=(64, 64), activation="tanh"),
    ppo=PpoConfig(learning_rate=1e-3, discount=0.99, gae_lambda=0.95, epochs=4, batch_size=256, entropy_weight=0.005),
    evaluation=EvaluationConfig(every=5, episodes=20, stable_after=1),
    runtime=RuntimeConfig(threads=1),
)
"""Settings for small scenes. One thread: networks this small only wait for a second one."""
BASIC_OVERRIDES = ("rollout.horizon=32", "ppo.learning_rate=3e-3", "ppo.discount=0.95", "evaluation.every=3")
"""What Basic learns soonest with: its episodes are short."""


@dataclass(frozen=True)
class UnityRequest:
    """What was asked."""

    build: str | None = None
    """What `find_build` understands; None: the configuration's env_path."""
    config: Path | None = None
    """ML-Agents' trainer configuration."""
    behavior: str | None = None
    """Which behavior learns, where the scene has several."""
    stops: tuple[str, ...] = ()
    """As typed; none: score=0.92 for builtin:Basic, and the configuration's max_steps or minutes=30."""
    run: Path | None = None
    seed: int | None = None
    """None: the configuration's, or 1."""
    overrides: tuple[str, ...] = ()
    graphics: bool | None = None
    """Whether the player opens a window; None: as the configuration says, else none."""


@dataclass(frozen=True)
class TrainedUnity:
    """A training that ended, and where it lies."""

    run: RunFolder
    outcome: Outcome
    build: str
    behavior: str
    seed: int
    notes: tuple[str, ...]
    seconds_in_all: float
    """Players' starts included."""

    def summary(self) -> dict[str, Any]:
        """Return the figures of `racecraft unity train --json`."""
        outcome, judged = self.outcome, self.outcome.last
        return {
            "build": self.build,
            "behavior": self.behavior,
            "solved": bool(judged and judged.is_perfect),
            "seconds": round(outcome.seconds, 3),
            "seconds_with_start": round(self.seconds_in_all, 3),
            "env_steps": outcome.steps,
            "iterations": outcome.iterations,
            "env_steps_per_second": round(outcome.steps / outcome.seconds, 1),
            "evaluation": judged.details if judged else None,
            "stopped_by": outcome.reason,
            "run": str(self.run.path),
            "seed": self.seed,
            "notes": list(self.notes),
            "versions": versions(),
        }


def train_unity(request: UnityRequest, listener: Listener) -> TrainedUnity:
    """Train until a stop holds.

    Raises:
        UserInputError: A build, a configuration, a setting or a stop that cannot be used.
        UnityError: A player cannot be brought to talk, or was lost.
    """
    began = time.perf_counter()
    config = read_trainer_yaml(request.config) if request.config else TrainerConfig({})
    build_name = _build_name(request, config)
    parse_stops(request.stops)  # refused before a player starts, as is a setting
    settings = apply_overrides(_defaults(build_name), request.overrides)
    seed = request.seed if request.seed is not None else 1 if config.seed is None else config.seed
    build = find_build(build_name)
    words = _words(request, config, seed)
    world = _open(build, words, build_name, settings.rollout.num_worlds)
    judged: UnityWorld | None = None
    try:
        settings, notes = _settle(request, config, build_name, world, settings)
        stops = stops_for(request, config.behavior(world.behavior.name).max_steps, build_name)
        use_threads(settings.runtime.threads, settings.runtime.device)
        if not build.is_editor:
            words_of_judge = {**words, "num_players": 1, "restart_on_reset": False}
            judged = _open(build, words_of_judge, build_name, settings.evaluation.episodes)
        run = _make_run(request, world, _job(request, build_name, world, settings, stops, seed))
        with run.lock():
            learner = PpoLearner(world.spec, settings.network, settings.ppo, seed, settings.runtime.device)
            judge = _judge_of(judged, learner, settings, stops, run)
            collector = Collector(world, learner, settings.rollout.horizon, seed)
            keeper = RunKeeper(run, learner, collector, _card(build_name, world, settings))
            loop = TrainingLoop(
                collector, learner, judge, keeper, listener, settings.rollout, settings.evaluation, stops
            )
            outcome = loop.run(f"{world.behavior.base_name} of {build_name}, run {run.path}")
    finally:
        for opened in filter(None, (world, judged)):
            opened.close()
    seconds = time.perf_counter() - began
    return TrainedUnity(run, outcome, build_name, world.behavior.base_name, seed, notes, seconds)


def stops_for(request: UnityRequest, max_steps: int | None, build_name: str) -> tuple[Stop, ...]:
    """Return when a training ends: what was typed, else the defaults; a configuration's max_steps always counts.

    >>> [str(stop) for stop in stops_for(UnityRequest(stops=("minutes=2",)), 5000, BASIC)]
    ['minutes=2', 'steps=5000']
    >>> [str(stop) for stop in stops_for(UnityRequest(), None, BASIC)]
    ['score=0.92', 'minutes=30']
    """
    told = list(request.stops)
    if not told and build_name == BASIC:
        told.append(f"score={BASIC_SCORE:g}")
    if max_steps is not None and not any(stop.startswith("steps=") for stop in told):
        told.append(f"steps={max_steps}")
    elif not request.stops:
        told.append("minutes=30")
    return parse_stops(told)


class SceneJudge:
    """Judges by the mean return of greedy episodes in a player of its own.

    Args:
        world: That player; it is not started anew between judgements.
        policy: The judged policy.
        episodes: How many episodes count.
        threshold: The mean return that counts as solved; None where none does.
        observations: Where to keep what the policy saw.
    """

    score_name = "return"

    def __init__(
        self, world: UnityWorld, policy: GreedyPolicy, episodes: int, threshold: float | None, observations: Path
    ) -> None:
        self._world, self._policy, self._episodes, self._threshold = world, policy, episodes, threshold
        self._file, self._judgements, self._longest = observations, 0, 0

    def score(self, episode: EpisodeRecord) -> float:
        """Return an episode's return, and learn how long training episodes get."""
        self._longest = max(self._longest, episode.steps)
        return episode.reward

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether one episode alone met the threshold."""
        return self._threshold is not None and episode.reward >= self._threshold

    def judge(self) -> Verdict:
        """Play; keep what was seen. A policy that never comes to an end is cut, or it would be judged for ever."""
        rows = self._world.spec.num_worlds
        each, spare = -(-self._episodes // rows), int(self._judgements > 0)
        recorder = _Recorder()
        counted = play_bounded(
            self._policy,
            self._world,
            episodes_each=each,
            spare=spare,
            max_ticks=(each + spare) * max(SHORTEST_PATIENCE, PATIENCE * self._longest),
            seed=self._judgements,
            observe=recorder,
        )
        self._judgements += 1
        save_state(self._file, recorder.rows())
        return verdict_on(counted, self._threshold)


class TrainingEpisodesJudge:
    """Judges by the training episodes since the judgement before, where no second player can be had."""

    score_name = "return"

    def __init__(self, threshold: float | None) -> None:
        self._threshold = threshold
        self._told: list[EpisodeRecord] = []
        self._before = Verdict(float("-inf"), False, details={"episodes": 0})

    def score(self, episode: EpisodeRecord) -> float:
        """Return an episode's return, and keep the episode for the next judgement."""
        self._told.append(episode)
        return episode.reward

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether one episode alone met the threshold."""
        return self._threshold is not None and episode.reward >= self._threshold

    def judge(self) -> Verdict:
        """Take the mean; without an episode the judgement before stands."""
        if self._told:
            self._before = verdict_on(self._told, self._threshold)
            self._told = []
        return self._before


def verdict_on(episodes: list[EpisodeRecord], threshold: float | None) -> Verdict:
    """Return what episodes came to."""
    summary = summarise(episodes)
    details = {
        "episodes": summary.episodes,
        "mean_return": summary.mean_reward,
        "std_return": summary.std_reward,
        "mean_steps": summary.mean_steps,
        "cut": sum(episode.status == CUT for episode in episodes),
        "threshold": threshold,
    }
    return Verdict(summary.mean_reward, threshold is not None and summary.mean_reward >= threshold, details=details)


class _Recorder:
    """Keeps the first observations that it is shown."""

    def __init__(self) -> None:
        self._parts: list[dict[str, Array]] = []
        self._count = 0

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        if self._count < OBSERVATIONS_KEPT:
            active = buffers.active
            part = {name: values[active].copy() for name, values in buffers.observations.items()}
            self._count += len(next(iter(part.values())))
            self._parts.append(part)

    def rows(self) -> dict[str, Array]:
        """Return observations by name, (R, …), at most OBSERVATIONS_KEPT."""
        names = self._parts[0] if self._parts else {}
        return {name: np.concatenate([part[name] for part in self._parts])[:OBSERVATIONS_KEPT] for name in names}


def _build_name(request: UnityRequest, config: TrainerConfig) -> str:
    build = request.build or config.env_path
    if build is None:
        raise UserInputError(
            "no build is named; expected BUILD, or env_path in the configuration's env_settings. "
            "Try: racecraft unity train builtin:Basic"
        )
    return build


def _defaults(build_name: str) -> TrainSettings:
    return apply_overrides(UNITY_SETTINGS, BASIC_OVERRIDES if build_name == BASIC else ())


def _words(request: UnityRequest, config: TrainerConfig, seed: int) -> dict[str, Any]:
    words = words_of(config) | {"seed": seed, "behavior": request.behavior}
    return words if request.graphics is None else words | {"graphics": request.graphics}


def _open(build: Build, words: dict[str, Any], build_name: str, agents: int) -> UnityWorld:
    """Open a world; the stand-in has as many agents as are wanted, a real scene as many as it has."""
    if build_name == BASIC and "args" not in words:
        words = words | {"args": ("--agents", str(agents))}
    return UnityWorld(build, **words)


def _settle(
    request: UnityRequest, config: TrainerConfig, build_name: str, world: UnityWorld, typed: TrainSettings
) -> tuple[TrainSettings, tuple[str, ...]]:
    """Return the settings: the defaults, then the configuration, then what was typed; and what is worth saying."""
    rows, name = world.spec.num_worlds, world.behavior.name
    notes = list(config.notes)
    base = world.behavior.base_name
    if config.behaviors and not {name, base, "*"} & set(config.behaviors):
        notes.append(f"the configuration says nothing of '{base}', only of {', '.join(config.behaviors)}")
    told = config.behavior(name).overrides(rows)
    if config.device is not None:
        told = (*told, f"runtime.device={config.device}")
    settings = apply_overrides(_defaults(build_name), (*told, *request.overrides))
    if typed.rollout.num_worlds not in (rows, UNITY_SETTINGS.rollout.num_worlds):
        notes.append(f"rollout.num_worlds is {rows}: the scene has so many agents")
    return with_values(settings, "rollout", {"num_worlds": rows}), tuple(notes)


def _judge_of(
    judged: UnityWorld | None, learner: PpoLearner, settings: TrainSettings, stops: tuple[Stop, ...], run: RunFolder
) -> Judge:
    threshold = next((stop.amount for stop in stops if stop.kind == "score"), None)
    if judged is None:
        return TrainingEpisodesJudge(threshold)
    episodes = settings.evaluation.episodes
    return SceneJudge(judged, GreedyPolicy(learner), episodes, threshold, run.path / OBSERVATIONS)


def _job(
    request: UnityRequest,
    build_name: str,
    world: UnityWorld,
    settings: TrainSettings,
    stops: tuple[Stop, ...],
    seed: int,
) -> dict[str, Any]:
    return {
        "kind": KIND,
        "asked": {
            "build": build_name,
            "behavior": world.behavior.name,
            "config": None if request.config is None else request.config.name,
            "stops": [str(stop) for stop in stops],
        },
        "settings": as_dictionary(settings),
        "seed": seed,
        "versions": versions(),
        "started": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def _card(build_name: str, world: UnityWorld, settings: TrainSettings) -> dict[str, Any]:
    return {
        "kind": KIND,
        "build": build_name,
        "behavior": card_of(world.behavior),
        "settings": as_dictionary(settings),
    }


def _make_run(request: UnityRequest, world: UnityWorld, job: dict[str, Any]) -> RunFolder:
    if request.run is not None:
        return RunFolder.create(request.run, job)
    name = "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in world.behavior.base_name)
    return RunFolder.create_numbered(Path("runs"), name, job)
