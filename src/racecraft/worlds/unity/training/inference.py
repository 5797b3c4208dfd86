"""Play in a scene without learning, as `mlagents-learn --inference` does. Begin with `play_scene`.

The policy takes the likeliest action every time. One player with a window, by the clock on the wall, unless something
else is said; no run folder is made.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.contract.world import EpisodeRecord, allocate
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import TrainedPolicy, load_policy
from racecraft.rollout.statistics import EpisodeCounter, summarise
from racecraft.training.resume import MessageCallback
from racecraft.training.stopping import Progress, StopCondition, parse_stops, reached
from racecraft.worlds.unity.env.behavior_specs import behaviors_in
from racecraft.worlds.unity.env.behaviors import Behavior, card_of
from racecraft.worlds.unity.env.errors import PlayerLeftError
from racecraft.worlds.unity.env.world import UnityWorld
from racecraft.worlds.unity.training.plan import KIND, UnityRequest, plan_unity

SAY_SECONDS = 10.0
"""How often a line says how it goes."""


@dataclass
class _Report:
    """What was played so far."""

    episodes: list[EpisodeRecord] = field(default_factory=list)
    steps: int = 0
    began: float = field(default_factory=time.perf_counter)
    said: float = 0.0

    @property
    def seconds(self) -> float:
        return time.perf_counter() - self.began

    def line(self) -> str:
        if not self.episodes:
            return f"{self.steps} steps, no episode has ended yet"
        return f"{len(self.episodes)} episodes, mean return {summarise(self.episodes).mean_reward:.3f}"


def play_scene(request: UnityRequest, on_message: MessageCallback = print) -> dict[str, Any]:
    """Let a trained policy play until a stop holds, Ctrl-C, or its player is closed; return what it came to.

    Args:
        request: `clone_from` names the policy; a build that is not named is the one it was trained in. Stops are
            `minutes=` and `steps=`.
        on_message: Called with a line for a person.

    Raises:
        SettingError: No policy is named, or a stop has no meaning here.
        RunFolderError: The policy is of another kind of world, or of another scene.
        UnityError: A player cannot be brought to talk, or is lost.
    """
    policy, request = _policy_for(request)
    stops = _stops_of(request.stops)
    planned = plan_unity(request, learns=False)
    world = UnityWorld(planned.build, **planned.world_arguments(inference=True))
    report, reason = _Report(), "Ctrl-C"
    with contextlib.closing(world):
        _require_same_scene(policy, world.behaviors)
        on_message(f"plays without learning until {' or '.join(map(str, stops)) or 'Ctrl-C, or the player is closed'}")
        try:
            reason = _play(policy, world, planned.seed, stops, report, on_message)
        except KeyboardInterrupt:
            pass
        except PlayerLeftError:
            reason = "the player was closed"
    summary = summarise(report.episodes)
    return {
        "run": str(policy.run.path),
        "checkpoint": policy.checkpoint.iteration,
        "episodes": len(report.episodes),
        "mean_return": summary.mean_reward if report.episodes else None,
        "mean_steps": summary.mean_steps if report.episodes else None,
        "env_steps": report.steps,
        "seconds": round(report.seconds, 3),
        "stopped_by": reason,
    }


def _policy_for(request: UnityRequest) -> tuple[TrainedPolicy, UnityRequest]:
    """Return the policy that is to play, and the request with the build and the behaviors of its run."""
    if request.clone_from is None:
        raise SettingError("--inference plays what was learned; expected --from RUN, or --run RUN --resume.")
    path, which = split_source(request.clone_from)
    run = RunFolder.open(path)
    asked = run.read_job_of(KIND)["asked"]
    build, behavior = request.build, request.behavior
    if build is None and request.config is None:
        build = asked["build"]
    return load_policy(run, which), replace(request, build=build, behavior=behavior or asked.get("wish"))


def _stops_of(texts: Sequence[str]) -> tuple[StopCondition, ...]:
    stops = parse_stops(texts)
    for stop in stops:
        if stop.kind not in ("minutes", "steps"):
            raise SettingError(
                "--stop {stop} can never hold while nothing is learned; expected minutes or steps.", stop=stop
            )
    return stops


def _require_same_scene(policy: TrainedPolicy, behaviors: Sequence[Behavior]) -> None:
    then = {base: card_of(behavior) for base, (behavior, _) in behaviors_in(policy.metadata).items()}
    now = {behavior.base_name: card_of(behavior) for behavior in behaviors}
    for base in {**then, **now}:
        one, other = then.get(base, {}), now.get(base, {})
        for name in ("sensors", "actions"):
            if one.get(name) != other.get(name):
                raise RunFolderError(
                    "{path}: was trained with {name} {one} of '{base}'; the scene has "
                    "{other}. Expected the scene it was trained in.",
                    path=policy.run.path,
                    name=name,
                    one=one.get(name),
                    base=base,
                    other=other.get(name),
                )


def _play(
    policy: TrainedPolicy,
    world: UnityWorld,
    seed: int,
    stops: Sequence[StopCondition],
    report: _Report,
    on_message: MessageCallback,
) -> str:
    """Play until a stop holds, and return which."""
    spec, buffers, counter = world.spec, allocate(world.spec), EpisodeCounter(world)
    rows = spec.num_worlds * spec.num_agents
    world.reset(buffers, seed)
    counter.begin()
    policy.reset_state(np.ones(rows, bool))
    while (reason := reached(stops, Progress(report.seconds, 0, report.steps, False))) is None:
        seen = {name: part.reshape(rows, *part.shape[2:]) for name, part in buffers.observations.items()}
        mask = None if buffers.action_mask is None else buffers.action_mask.reshape(rows, -1)
        actions = policy.act(seen, mask).reshape(spec.num_worlds, spec.num_agents, *spec.actions.shape)
        report.steps += int(buffers.active.sum())
        world.step(actions, buffers)
        counter.count(buffers)
        report.episodes += counter.pop()
        policy.reset_state(buffers.ended.reshape(rows))
        if report.seconds - report.said > SAY_SECONDS:
            report.said = report.seconds
            on_message(report.line())
    return str(reason)
