"""What was asked of a Unity training, made definite before a player starts. Begin with `plan_unity`.

The scene has the last word: how many agents there are and what they see is known once it runs; `unity_settling.py`
goes on from there.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from racecraft.algorithms.apex import ApexConfig
from racecraft.algorithms.dqn import DqnConfig
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig
from racecraft.algorithms.registry import Algorithm, find_algorithm
from racecraft.contract.errors import RunFolderError, UserInputError
from racecraft.formats.run_folder import RunFolder
from racecraft.rollout.settings import RolloutConfig
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import apply_overrides, from_dictionary
from racecraft.training.request import DEFAULT_ALGORITHM, TrainRequest
from racecraft.training.resume import open_to_resume
from racecraft.training.settings import JUDGING_SHARE, EvaluationConfig, RuntimeConfig, composed
from racecraft.training.stopping import SCORE, StopCondition, parse_stops
from racecraft.worlds.unity.env.behaviors import Behavior
from racecraft.worlds.unity.env.builds import Build, find_build
from racecraft.worlds.unity.env.trainer_options import words_of
from racecraft.worlds.unity.files.trainer_config import SAC
from racecraft.worlds.unity.files.trainer_yaml import TrainerConfig, read_trainer_yaml

KIND = "unity"
"""What job.json calls a run of a Unity scene."""
BASIC = "builtin:Basic"
BASIC_SCORE = 0.92
"""What counts as solved; 0.93 is the best there is."""
TRAINER_FILE = "trainer.yaml"
"""ML-Agents' configuration, as it was, in the run folder."""

WORLD_SETTINGS = Settings(
    rollout=RolloutConfig(num_worlds=32, horizon=64),
    network=NetworkConfig(hidden_units=(64, 64), activation="tanh"),
    evaluation=EvaluationConfig(every=5, episodes=20, stable_after=1, share=JUDGING_SHARE),
    runtime=RuntimeConfig(threads=1),
)
"""Settings for small scenes. One thread: networks this small only wait for a second one."""
TUNED: Mapping[str, Any] = {
    "ppo": PpoConfig(
        learning_rate=1e-3, discount=0.99, gae_lambda=0.95, epochs=4, batch_size=256, entropy_weight=0.005
    ),
    "dqn": DqnConfig(
        learning_rate=1e-3, batch_size=128, train_every=16, target_every=128, epsilon_last=0.04, epsilon_steps=20_000,
        optimiser="adam", max_grad_norm=10.0, double=True, n_step=3,
    ),
    "apex": ApexConfig(learning_rate=1e-3, target_every=128, optimiser="adam"),
}  # fmt: skip
"""What each algorithm learns small scenes with."""
SAC_OVERRIDES = ("rollout.horizon=8",)
"""What SAC learns scenes with: it learns from each step, not from long rollouts."""
BASIC_OVERRIDES = ("rollout.horizon=32", "evaluation.every=3")
BASIC_PPO = ("ppo.learning_rate=3e-3", "ppo.discount=0.95")
"""What Basic learns soonest with: its episodes are short."""


@dataclass(frozen=True)
class UnityRequest(TrainRequest):
    """What was asked.

    Where it names no stop: score=0.92 for builtin:Basic, and the configuration's max_steps or minutes=30; where it
    names no seed: the configuration's, or 1.
    """

    kind: ClassVar[str] = KIND
    build: str | None = None
    """What `find_build` understands; None: the configuration's env_path."""
    config: Path | None = None
    """ML-Agents' trainer configuration."""
    behavior: str | None = None
    """Which behavior learns, where the scene has several; None: those that the configuration names, else all."""
    graphics: bool | None = None
    """Whether the player opens a window; None: as the configuration says, else none."""
    max_agents: int | None = None
    """Rows kept for the agents of a behavior in one player; None: as many as ask first."""
    env_args: tuple[str, ...] = ()
    """Arguments for the player; none: the configuration's."""
    num_envs: int | None = None
    """Players that teach side by side; None: as the configuration says, else one."""
    time_scale: float | None = None
    """Simulated seconds a second; None: as the configuration says, else 20."""
    nearest: bool = False
    """Whether PPO may learn where the configuration asks for POCA, self-play, or SAC of actions with choices."""
    base_port: int | None = None
    """The first player's port, the judge's comes after the last one's; None: the configuration's, else free ones."""


@dataclass(frozen=True)
class UnityPlan:
    """A request made definite, as far as it can be before the scene runs."""

    request: UnityRequest
    config: TrainerConfig
    build_name: str
    build: Build
    seed: int
    algorithm: Algorithm
    settings: Settings
    """The defaults and what was typed; a resumed run's own, whole."""
    resumed_run: RunFolder | None = None
    """The run to go on with."""
    notes: tuple[str, ...] = ()

    def world_arguments(self, for_judge: bool = False, inference: bool = False) -> dict[str, Any]:
        """Return the arguments of `UnityWorld`: of the players that teach, of the one that judges, of those watched."""
        request = self.request
        named = request.behavior or [name for name in self.config.behaviors if name != "*"]
        words = words_of(replace(self.config, inference=inference)) | {
            "seed": self.seed,
            "behavior": named,
            "several": request.behavior is None,
        }
        asked = {
            "graphics": request.graphics,
            "max_agents": request.max_agents,
            "args": request.env_args or None,
            "num_players": request.num_envs,
            "time_scale": request.time_scale,
        }
        words |= {name: value for name, value in asked.items() if value is not None}
        first = self.config.base_port if request.base_port is None else request.base_port
        if first is not None and not self.build.is_editor:  # the Editor insists on a port of its own
            words["base_port"] = first + (words.get("num_players", 1) if for_judge else 0)
        if for_judge:
            words |= {"num_players": 1, "restart_on_reset": False}
        if inference:  # somebody watches, and closes the window when he has seen enough
            words = {"graphics": True, "max_lifetime_restarts": 0} | words
        if self.build_name == BASIC and "args" not in words:  # a real scene has as many agents as it has
            each = math.ceil(self.settings.rollout.num_worlds / words.get("num_players", 1))
            words["args"] = ("--agents", str(self.settings.evaluation.episodes if for_judge else each))
        return words

    def request_values(self, behaviors: Sequence[Behavior]) -> dict[str, Any]:
        """Return what job.json tells of the request: enough to begin again from it."""
        return {
            "build": self.build_name,
            "behavior": behaviors[0].name if len(behaviors) == 1 else [behavior.name for behavior in behaviors],
            "wish": self.request.behavior,
            "config": None if self.request.config is None else self.request.config.name,
            "graphics": self.request.graphics,
            "max_agents": self.request.max_agents,
            "env_args": list(self.request.env_args),
            "num_envs": self.request.num_envs,
            "time_scale": self.request.time_scale,
            "base_port": self.request.base_port,
            "nearest": self.request.nearest,
            "from": self.request.clone_from,
        }


def plan_unity(request: UnityRequest, learns: bool = True) -> UnityPlan:
    """Read and check everything a request names; no player is started.

    Args:
        request: What was asked.
        learns: Whether something is to be learned; False: `inference.py` plays.

    Raises:
        UserInputError: A build, a configuration, a setting or a stop that cannot be used.
    """
    config = read_trainer_yaml(request.config) if request.config else TrainerConfig({})
    if config.inference and learns:
        raise UserInputError(
            "{config}: checkpoint_settings.inference is true, so nothing would be learned. Take it out, or "
            "let a trained policy play: racecraft unity train --inference --from RUN",
            config=request.config,
        )
    build_name = request.build or config.env_path
    if build_name is None:
        raise UserInputError(
            "no build is named; expected BUILD, or env_path in the configuration's env_settings. "
            "Try: racecraft unity train builtin:Basic"
        )
    parse_stops(request.stops, SCORE)
    if learns and not request.nearest and request.algorithm is None:
        _require_followed(config, request)
    algorithm = find_algorithm(request.algorithm or _trainer_of(config, request.behavior))
    settings = apply_overrides(defaults_for(build_name, algorithm), request.overrides)
    seed = request.seed if request.seed is not None else 1 if config.seed is None else config.seed
    return UnityPlan(request, config, _lasting_name(build_name), find_build(build_name), seed, algorithm, settings)


def _require_followed(config: TrainerConfig, request: UnityRequest) -> None:
    """Refuse a configuration that asks for another way of learning than there is here.

    Raises:
        UserInputError: POCA, self-play or an unknown trainer is asked for.
    """
    sections = [config.behavior(request.behavior)] if request.behavior else list(config.behaviors.values())
    for section in sections:
        if section.unfollowed:
            raise UserInputError(
                "{config}: behaviors.{behavior} asks for {asked}, which racecraft does not have; expected trainer_type "
                "ppo or sac, without self_play. --nearest lets PPO learn it instead, all teams by one policy.",
                config=request.config,
                behavior=section.name,
                asked=" and ".join(section.unfollowed),
            )


def plan_resume(path: Path, stops: tuple[str, ...] = ()) -> UnityPlan:
    """Read what a run was asked for, from its own folder, so that it can go on.

    Args:
        path: The run folder; its copy of the trainer configuration is used.
        stops: New stops; none: those the run was begun with.

    Raises:
        RunFolderError: No run of a Unity scene.
        UserInputError: Its build is no longer there.
    """
    run, job, notes = open_to_resume(path, KIND)
    asked, copy = job["asked"], path / TRAINER_FILE
    if asked["config"] is not None and not copy.exists():
        raise RunFolderError(
            "{copy}: is missing; the run was begun with a configuration, {asked}, and its copy is expected "
            "here. Put it back, or begin a new run with --from.",
            copy=copy,
            asked=asked["config"],
        )
    request = UnityRequest(
        build=asked["build"],
        config=copy if copy.exists() else None,
        behavior=asked.get("wish"),
        stops=stops or tuple(asked["stops"]),
        run=path,
        seed=job["seed"],
        graphics=asked.get("graphics"),
        max_agents=asked.get("max_agents"),
        env_args=tuple(asked.get("env_args", ())),
        num_envs=asked.get("num_envs"),
        time_scale=asked.get("time_scale"),
        base_port=asked.get("base_port"),
        algorithm=job.get("algorithm", DEFAULT_ALGORITHM),
    )
    config = read_trainer_yaml(copy) if request.config else TrainerConfig({})
    algorithm = find_algorithm(request.algorithm or DEFAULT_ALGORITHM)
    settings = from_dictionary(defaults_for(asked["build"], algorithm), job["settings"])
    return UnityPlan(
        request, config, asked["build"], find_build(asked["build"]), job["seed"], algorithm, settings, run, notes
    )


def stops_for(request: UnityRequest, max_steps: int | None, build_name: str) -> tuple[StopCondition, ...]:
    """Return when a training ends: what was typed, else the defaults; a configuration's max_steps always counts.

    >>> [str(stop) for stop in stops_for(UnityRequest(stops=("minutes=2",)), 5000, BASIC)]
    ['minutes=2', 'steps=5000']
    >>> [str(stop) for stop in stops_for(UnityRequest(), None, BASIC)]
    ['score=0.92', 'minutes=30']
    """
    stops = list(request.stops)
    if not stops and build_name == BASIC:
        stops.append(f"score={BASIC_SCORE:g}")
    if max_steps is not None and not any(stop.startswith("steps=") for stop in stops):
        stops.append(f"steps={max_steps}")
    elif not request.stops:
        stops.append("minutes=30")
    return parse_stops(stops, SCORE)


def default_settings(algorithm: Algorithm) -> Settings:
    """Return what a training of a scene that is not known runs with where nothing is said."""
    return composed(WORLD_SETTINGS, algorithm, TUNED.get(algorithm.name))


def defaults_for(build_name: str, algorithm: Algorithm) -> Settings:
    """Return what a training runs with where nothing is said."""
    settings = default_settings(algorithm)
    if algorithm.name == SAC:
        settings = apply_overrides(settings, SAC_OVERRIDES)
    if build_name != BASIC:
        return settings
    return apply_overrides(settings, (*BASIC_OVERRIDES, *(BASIC_PPO if algorithm.name == "ppo" else ())))


def _trainer_of(config: TrainerConfig, behavior: str | None) -> str:
    """Return what the configuration lets learn: SAC where every section that counts says so."""
    sections = [config.behavior(behavior)] if behavior else list(config.behaviors.values())
    named = [one for one in sections if one.name != "*"] or sections
    return SAC if named and all(one.trainer == SAC for one in named) else DEFAULT_ALGORITHM


def with_scene(plan: UnityPlan, behaviors: Sequence[Behavior]) -> UnityPlan:
    """Return the plan now that the scene is known.

    Where only the configuration asks for SAC, and SAC cannot learn this scene, PPO learns instead, and that is said, if
    the request takes the nearest.

    Raises:
        UserInputError: SAC cannot learn this scene.
    """
    if plan.algorithm.name != SAC or plan.request.algorithm or plan.resumed_run is not None:
        return plan
    if len(behaviors) > 1:
        why = "teaches one policy, and here several learn"
    elif behaviors[0].actions.branches:
        why = f"decides numbers alone, and an action of '{behaviors[0].base_name}' has choices"
    else:
        return plan
    if not plan.request.nearest:
        raise UserInputError(
            "{config}: trainer_type 'sac' {why}; expected ppo. --nearest lets PPO learn it instead.",
            config=plan.request.config,
            why=why,
        )
    ppo = find_algorithm(DEFAULT_ALGORITHM)
    settings = apply_overrides(defaults_for(plan.build_name, ppo), plan.request.overrides)
    note = f"trainer_type: 'sac' {why}; PPO learns instead"
    return replace(plan, algorithm=ppo, settings=settings, notes=(*plan.notes, note))


def _lasting_name(build_name: str) -> str:
    """Return a file's absolute path, so that the run can be resumed from another folder; other names stay."""
    return os.path.abspath(build_name) if os.path.exists(build_name) else build_name
