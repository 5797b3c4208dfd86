"""What a run of a Unity scene is judged by: whole episodes in that scene."""

from __future__ import annotations

import contextlib
import json
from typing import Any

from racecraft.evaluation.evaluate_run import MAX_STEPS, judge_episodes, what_is_judged
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import load_policy
from racecraft.worlds.unity.env.builds import find_build
from racecraft.worlds.unity.env.world import UnityWorld


def judge_unity(run: RunFolder, which: str, episodes: int = 20, seed: int = 0) -> dict[str, Any]:
    """Judge a run by whole episodes in the scene that it was trained in."""
    policy, request = load_policy(run, which), run.read_job()["asked"]
    behaviors = request["behavior"]
    named = [behaviors] if isinstance(behaviors, str) else behaviors
    several = len(named) > 1
    env_args = tuple(request.get("env_args", ()))
    if not env_args and request["build"] == "builtin:Basic":
        env_args = ("--agents", str(episodes))
    arguments: dict[str, Any] = {"args": env_args} if env_args else {}
    world = UnityWorld(
        find_build(request["build"]), behavior=named if several else named[0], several=several, seed=seed, **arguments
    )
    try:
        return what_is_judged(run, policy) | judge_episodes(policy, world, episodes, seed, most_steps=_patience_of(run))
    finally:
        world.close()


def _patience_of(run: RunFolder) -> int | None:
    """Return how long the latest evaluation of a training let an episode last; None where none tells.

    A greedy policy may stand still for ever in a scene that knows no end; what is told of it afterwards is then what
    the training told.
    """
    for path in sorted(run.evaluations.glob("*.json"), key=lambda one: one.stat().st_mtime, reverse=True):
        with contextlib.suppress(ValueError, AttributeError, OSError):
            max_steps = json.loads(path.read_text(encoding="utf-8")).get(MAX_STEPS)
            if isinstance(max_steps, int) and max_steps > 0:
                return max_steps
    return None
