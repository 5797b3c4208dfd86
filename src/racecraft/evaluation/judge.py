"""Judge the greedy policy of any run in a world of its own kind. Begin with `judge_run`.

Cars are judged by laps, everything else by whole episodes; a snake by its rating against the anchors.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from racecraft.contract.errors import RunFolderError, SettingError, nearest
from racecraft.contract.world import World
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import TrainedPolicy, load_policy
from racecraft.rollout.episodes import CUT, play_episodes
from racecraft.rollout.statistics import summarise

LAPS = 3
"""Of a car, where nobody says."""
EPISODES = 100
"""Gymnasium's own measure."""
JUDGING_WORLDS = 20
MOST_TICKS = 100_000
"""A policy that never comes to an end is cut."""
MOST_STEPS = "most_steps"
"""What an evaluation of a training calls the ticks that it gave an episode before it was cut."""
SEED_OF_JUDGING = 1_000_000_007


def judge_run(run: str | Path, which: str = "", **words: Any) -> dict[str, Any]:
    """Judge the greedy policy of a run and return plain figures.

    Args:
        run: The run folder; RUN:best, RUN:last and RUN:N name a checkpoint.
        which: "best", "last" or the number of an iteration; "": what `run` says, else the best.
        words: What that kind of world is judged by: `track`, or several `tracks`, and `laps` for cars; `episodes`,
            `seed` for others.

    Raises:
        RunFolderError: No run folder, or of a kind that is not judged so.
        SettingError: A word that this kind does not know.
    """
    path, named = split_source(str(run))
    folder = RunFolder.open(path)
    kind = str(folder.read_job().get("kind"))
    judges: Mapping[str, Callable[..., dict[str, Any]]] = {
        "deepracer": _judge_car,
        "gymnasium": _judge_gymnasium,
        "battlesnake": _judge_snake,
        "unity": _judge_unity,
    }
    if kind not in judges:
        raise RunFolderError(f"{folder.path}: the run is of an unknown kind, {kind!r}; expected one of racecraft's.")
    known = ("track", "tracks", "laps") if kind == "deepracer" else ("episodes", "seed")
    for word in words:
        if word not in known:
            raise SettingError(f"a {kind} run is not judged by '{word}'. {nearest(word, known)}")
    return judges[kind](folder, which or named, **words)


def judge_episodes(
    policy: TrainedPolicy, world: World, episodes: int, seed: int, spare: int = 0, most_steps: int | None = None
) -> dict[str, Any]:
    """Play so many whole episodes and return what they came to.

    Args:
        policy: Who plays.
        world: Where; its agents play side by side.
        episodes: How many count, all agents together.
        seed: Of the world.
        spare: Episodes of each agent that are played before those that count.
        most_steps: Ticks that an episode may last, on average; None: MOST_TICKS in all.
    """
    each = -(-episodes // (world.spec.num_worlds * world.spec.num_agents))
    ticks = (each + spare) * most_steps if most_steps else MOST_TICKS
    told = play_episodes(policy, world, episodes_each=each, seed=seed, spare=spare, max_ticks=ticks)[:episodes]
    summary = summarise(told)
    return {
        "episodes": summary.episodes,
        "mean_return": summary.mean_reward,
        "std_return": summary.std_reward,
        "mean_steps": summary.mean_steps,
        "cut": sum(one.status == CUT for one in told),
    }


def _judge_car(
    run: RunFolder,
    which: str,
    track: str | None = None,
    laps: int | None = None,
    tracks: Sequence[str] | None = None,
) -> dict[str, Any]:
    from racecraft.worlds.deepracer.evaluation.by_track import STARTS, judge_named, told_of
    from racecraft.worlds.deepracer.evaluation.laps import judge_laps
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    car = load_trained_car(run.path, which)
    if tracks is not None:
        if track is not None:
            raise SettingError("`track` and `tracks` were given; expected all names in one of them.")
        names = tracks.split(",") if isinstance(tracks, str) else tracks
        return told_of(car, judge_named(car, names, laps or STARTS), laps or STARTS)
    circuit, laps = load_track(track) if track else car.trained_on, laps or LAPS
    world = car.world(circuit, num_cars=1, start_shares=[0.0], laps=laps)
    report = judge_laps(car.policy, world, laps)
    return _facts(run, car.policy) | {"track": circuit.name, **report.as_dictionary()}


def _judge_gymnasium(
    run: RunFolder, which: str, episodes: int = EPISODES, seed: int = SEED_OF_JUDGING
) -> dict[str, Any]:
    from racecraft.worlds.gymnasium.evaluation import opened_judging_world

    policy = load_policy(run, which)
    with opened_judging_world(run, min(episodes, JUDGING_WORLDS)) as world:
        return _facts(run, policy) | judge_episodes(policy, world, episodes, seed)


def _judge_unity(run: RunFolder, which: str, episodes: int = 20, seed: int = 0) -> dict[str, Any]:
    from racecraft.worlds.unity.env.builds import find_build
    from racecraft.worlds.unity.env.world import UnityWorld

    policy, asked = load_policy(run, which), run.read_job()["asked"]
    behaviors = asked["behavior"]
    named = [behaviors] if isinstance(behaviors, str) else behaviors
    several = len(named) > 1
    told = tuple(asked.get("env_args", ()))
    if not told and asked["build"] == "builtin:Basic":
        told = ("--agents", str(episodes))
    arguments: dict[str, Any] = {"args": told} if told else {}
    world = UnityWorld(
        find_build(asked["build"]), behavior=named if several else named[0], several=several, seed=seed, **arguments
    )
    try:
        return _facts(run, policy) | judge_episodes(policy, world, episodes, seed, most_steps=_patience_of(run))
    finally:
        world.close()


def _patience_of(run: RunFolder) -> int | None:
    """Return how long the latest evaluation of a training let an episode last; None where none tells.

    A greedy policy may stand still for ever in a scene that knows no end; what is told of it afterwards is then what
    the training told.
    """
    for path in sorted(run.evaluations.glob("*.json"), key=lambda one: one.stat().st_mtime, reverse=True):
        with contextlib.suppress(ValueError, AttributeError, OSError):
            told = json.loads(path.read_text(encoding="utf-8")).get(MOST_STEPS)
            if isinstance(told, int) and told > 0:
                return told
    return None


def _judge_snake(run: RunFolder, which: str, episodes: int = 50, seed: int = SEED_OF_JUDGING) -> dict[str, Any]:
    from racecraft.evaluation.rating import wilson
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.env.world import WorldSettings
    from racecraft.worlds.battlesnake.evaluation.batch import play_batch
    from racecraft.worlds.battlesnake.players.anchors import ANCHORS
    from racecraft.worlds.battlesnake.players.trained import snake_config_in

    policy, game = load_policy(run, which), GameSettings(**run.read_job()["asked"]["game"])
    seen = snake_config_in(policy.metadata["settings"])
    played = WorldSettings(game, view=seen.view, outlook=seen.outlook)
    against = {}
    for name in ANCHORS:
        results = play_batch([policy, *[name] * (game.players - 1)], played, episodes, seed)
        won = sum(one.places[0] == 0 and one.places.count(0) == 1 for one in results)
        low, high = wilson(won, len(results))
        against[name] = {
            "games": len(results), "won": won, "won_share": won / len(results),
            "won_share_low": low, "won_share_high": high,
        }  # fmt: skip
    return _facts(run, policy) | {"against": against}


def _facts(run: RunFolder, policy: TrainedPolicy) -> dict[str, Any]:
    return {"run": str(run.path), "checkpoint": policy.checkpoint.iteration}
