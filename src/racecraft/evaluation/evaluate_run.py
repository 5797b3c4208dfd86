"""Judge the greedy policy of any run in a world of its own kind. Begin with `evaluate_run`.

A kind judges in its own way (`WorldKind.evaluate`); whichever has none is judged by whole episodes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.kinds import find_kind
from racecraft.contract.world import World
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import TrainedPolicy, load_policy
from racecraft.rollout.episodes import CUT, play_episodes
from racecraft.rollout.statistics import summarise

EPISODES = 100
"""Gymnasium's own measure."""
JUDGING_WORLDS = 20
MAX_TICKS = 100_000
"""A policy that never comes to an end is cut."""
MAX_STEPS = "most_steps"
"""What an evaluation of a training calls the ticks that it gave an episode before it was cut."""
SEED_OF_JUDGING = 1_000_000_007


def evaluate_run(run: str | Path, which: str = "", **words: Any) -> dict[str, Any]:
    """Judge the greedy policy of a run and return plain figures.

    Args:
        run: The run folder; RUN:best, RUN:last and RUN:N name a checkpoint.
        which: "best", "last" or the number of an iteration; "": what `run` says, else the best.
        words: What that kind of world is judged by (`WorldKind.evaluate_words`): `track`, or several `tracks`, and
            `laps` for cars; `episodes`, `seed` for others.

    Raises:
        RunFolderError: No run folder.
        MissingWorldError: The world of the run is not installed.
        SettingError: A word that this kind does not know, or a kind that cannot be judged.
    """
    path, named = split_source(str(run))
    folder = RunFolder.open(path)
    kind = find_kind(str(folder.read_job().get("kind")), str(folder.path))
    for word in words:
        if word not in kind.evaluate_words:
            raise SettingError(
                "a {name} run is not judged by '{word}'. {hint}",
                name=kind.name,
                word=word,
                hint=nearest(word, kind.evaluate_words),
            )
    evaluate = kind.piece("evaluate") or _evaluate
    figures: dict[str, Any] = evaluate(folder, which or named, **words)
    return figures


def _evaluate(run: RunFolder, which: str, episodes: int = EPISODES, seed: int = SEED_OF_JUDGING) -> dict[str, Any]:
    """Judge a run by whole episodes in its kind's own `judging_world`.

    Raises:
        SettingError: It has none.
    """
    kind = find_kind(run.read_job()["kind"], str(run.path))
    judging_world = kind.piece("judging_world")
    if judging_world is None:
        raise SettingError(
            "{path}: the kind {name!r} has no judging_world; expected one to judge it in.",
            path=run.path,
            name=kind.name,
        )
    policy = load_policy(run, which)
    with judging_world(run, min(episodes, JUDGING_WORLDS)) as world:
        return what_is_judged(run, policy) | judge_episodes(policy, world, episodes, seed)


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
        most_steps: Ticks that an episode may last, on average; None: MAX_TICKS in all.
    """
    each = -(-episodes // (world.spec.num_worlds * world.spec.num_agents))
    ticks = (each + spare) * most_steps if most_steps else MAX_TICKS
    records = play_episodes(policy, world, episodes_each=each, seed=seed, spare=spare, max_ticks=ticks)[:episodes]
    summary, returns = summarise(records), [one.reward for one in records]
    return {
        "episodes": summary.episodes,
        "mean_return": summary.mean_reward,
        "total_return": sum(returns),
        "max_return": max(returns, default=0.0),
        "min_return": min(returns, default=0.0),
        "std_return": summary.std_reward,
        "mean_steps": summary.mean_steps,
        "cut": sum(one.status == CUT for one in records),
    }


def what_is_judged(run: RunFolder, policy: TrainedPolicy) -> dict[str, Any]:
    """Return the figures that every evaluation begins with: the run, and the iteration of the checkpoint."""
    return {"run": str(run.path), "checkpoint": policy.checkpoint.iteration}
