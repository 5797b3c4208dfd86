"""AWS's chart of distributed training on snakes on this machine: reward and length over minutes of training.

    python benchmarks/four_runs.py                          train the rows, two minutes each, then judge them
    python benchmarks/four_runs.py --minutes 6 --row old --row apex
    python benchmarks/four_runs.py --gym exact              the official rules instead of the starter pack's
    python benchmarks/four_runs.py --slowed --minutes 16    games as slow as those of 2020, for 1, 4 and 12 workers
    python benchmarks/four_runs.py --slowed --together FOLDER FOLDER … --folder OUT    table and chart of several seeds

Rows train one after the other: the old hand-written DQN, DQN on one core, DQN and Ape-X on all cores, and ours (PPO,
masked). Then checkpoints from along the way play whole games greedily, every row the same games. The folder keeps a run
and a JSON file for each row, `chart.png` and `table.md`; the same command continues an interrupted comparison. Run
nothing else meanwhile, but for --slowed.

--slowed counts time instead of sleeping it, so that two cores carry twelve workers and a busy machine tells the same: a
worker plays one game, a turn of it takes TURN_SECONDS, all workers play at once, and learning goes on beside them. A
row's minutes are its turns times TURN_SECONDS.

Facts: battlesnake-and-sagemaker-rl.md B.2, B.3, D. The source states five snakes, one reward, one observation, the same
hyperparameters and time for all; the old trainer's figures are its script's defaults. Ours are the number of games side
by side, the layers behind the convolutions and the switches of the memory (RLlib's defaults). All five snakes share one
network here; RLlib's runs had one each. The source's heterogeneous row gives the learner a GPU; one machine without a
GPU has no such row.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import racecraft as rc
from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, StepBuffers, World
from racecraft.rollout.episodes import play_episodes

WORLDS = "racecraft.worlds.battlesnake.env.source_experiment"
PLAIN = {"starter-pack": "StarterPackGames", "exact": "ExactGames"}
MASKED = {"starter-pack": "MaskedStarterPackGames", "exact": "MaskedExactGames"}
NETWORKS = {
    "starter-pack": (
        "network.conv_filters=16,32,256", "network.conv_kernels=5,3,3", "network.conv_strides=4,1,1",
        "network.hidden_units=256", "network.activation=relu", "network.stack_size=2",
    ),
    "exact": (
        "network.conv_filters=", "network.conv_kernels=", "network.conv_strides=", "network.image_units=128",
        "network.hidden_units=128,128", "network.activation=relu",
    ),
}  # fmt: skip
"""Of the starter pack: the convolutions of its own RLlib model (B.2) over two frames."""
LOOP = ("evaluation.every=1000000", "evaluation.episodes=5")
"""No evaluation while the clock runs."""
MOMENTS = 8
"""Checkpoints of each row that are judged, the last one included."""
RANDOM = "random moves"
SEED_OF_JUDGING = 1_000_000_007
TURN_SECONDS = 0.1
"""Of a turn of a slowed game. In a training of 2020 with 15 workers a step of a worker's two games took 53 ms (its log,
facts: D.2), and the source's rows had 210 minutes."""
SLOWED = f"counted: a turn of a worker's game takes {TURN_SECONDS:g} s"
TURNS_OF_AN_ITERATION = 8
"""Of the rows that remember, but for the old one at today's speed."""


@dataclass(frozen=True)
class Row:
    """One training of the chart."""

    title: str
    algorithm: str
    world: str
    settings: tuple[str, ...]
    cores: int
    is_slowed: bool = False

    def stop(self, minutes: float) -> str:
        """Return where a training of so many minutes stops."""
        if self.is_slowed:
            return f"iterations={round(60 * minutes / TURN_SECONDS / TURNS_OF_AN_ITERATION)}"
        return f"minutes={minutes:g}"

    def minutes(self, line: dict[str, Any]) -> float:
        """Return how long the row had trained by a line of its metrics."""
        if self.is_slowed:
            return int(line["iteration"]) * TURNS_OF_AN_ITERATION * TURN_SECONDS / 60
        return float(line["seconds"]) / 60


def rows_of(gym: str, cores: int, is_slowed: bool) -> dict[str, Row]:
    plain, masked, network = PLAIN[gym], MASKED[gym], (*NETWORKS[gym], *LOOP)
    old_trainers = ("learning_rate=5e-4", "discount=0.95", "batch_size=64", "train_every=20", "optimiser=adam")
    keep_every = "runtime.keep_every=50" if is_slowed else "runtime.keep_every=1"
    rllib = ("replay.capacity=50000", "replay.keep_mib=0", keep_every)
    old = (
        *_group("dqn", *old_trainers, "target_every=1", "target_share=0.001", "epsilon_last=0.01",
                "epsilon_steps=40000"),
        "replay.capacity=5000", "replay.prioritised=false", "replay.keep_mib=0", "rollout.num_worlds=1",
        "runtime.threads=1",
    )  # fmt: skip
    dqn = (
        *_group("dqn", *old_trainers, "double=true", "dueling=true", "target_every=25", "epsilon_last=0.02",
                "epsilon_steps=10000"),
        "replay.prioritised=true", *rllib,
    )  # fmt: skip
    apex = (*_group("apex", *old_trainers, "n_step=3", "target_every=25"), *rllib)
    ppo = _group(
        "ppo", "learning_rate=5e-4", "discount=0.99", "gae_lambda=0.95", "epochs=3", "batch_size=1024",
        "entropy_weight=0.01",
    )  # fmt: skip
    games = ("rollout.num_worlds=64", "rollout.horizon=32", "runtime.keep_every=1")
    if is_slowed:
        old += (f"rollout.horizon={TURNS_OF_AN_ITERATION}", keep_every)
        one, four, twelve = ((*network, *way, *_side_by_side(k, 1)) for way, k in ((dqn, 1), (dqn, 4), (apex, 12)))
        return {
            "old": Row("hand-written DQN, one worker", "dqn", plain, (*network, *old), 1, True),
            "dqn-1": Row("DQN, one worker", "dqn", plain, one, 1, True),
            "dqn-4": Row("DQN, four workers", "dqn", plain, four, 1, True),
            "apex-12": Row("Ape-X, twelve workers", "apex", plain, twelve, cores, True),
        }
    old += ("rollout.horizon=20", "runtime.keep_every=5")
    return {
        "old": Row("hand-written DQN, one game, one core", "dqn", plain, (*network, *old), 1),
        "dqn-1-core": Row("DQN, one core", "dqn", plain, (*network, *dqn, *_side_by_side(16, 1)), 1),
        "dqn-all-cores": Row(
            f"DQN, {cores} cores", "dqn", plain, (*network, *dqn, *_side_by_side(16 * cores, cores)), cores
        ),
        "apex": Row(
            f"Ape-X, {cores} cores shared alike", "apex", plain,
            (*network, *apex, *_side_by_side(16 * cores, 1)), cores,
        ),
        "ours": Row(
            f"ours: PPO, self-play, masked, {cores} cores", "ppo", masked,
            (*network, *ppo, *games, f"runtime.threads={cores}"), cores,
        ),
    }  # fmt: skip


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--minutes", type=float, default=2.0, help="of training, each row")
    words.add_argument("--games", type=int, default=100, help="whole games behind each mean")
    words.add_argument("--gym", choices=sorted(PLAIN), default="starter-pack")
    words.add_argument("--row", action="append", help="train only these rows")
    words.add_argument("--slowed", action="store_true", help="count time by turns of slow games, for 1 to 12 workers")
    words.add_argument("--seed", type=int, default=1, help="of the trainings")
    words.add_argument("--folder", type=Path)
    words.add_argument("--together", type=Path, nargs="+", metavar="FOLDER", help="train nothing: means of these seeds")
    asked = words.parse_args()
    name = f"{asked.gym}{'-slowed' * asked.slowed}-{asked.minutes:g}-{asked.games}-{asked.seed}"
    folder = asked.folder or Path("four-runs") / name
    rows = rows_of(asked.gym, len(_usable_cores()), asked.slowed)
    if unknown := set(asked.row or ()) - set(rows):
        words.error(f"--row {', '.join(sorted(unknown))}; expected some of {', '.join(rows)}")
    folder.mkdir(parents=True, exist_ok=True)
    if asked.together:
        write_result(folder, means_of(asked.together, rows), asked.slowed)
        return
    judged = {
        title: _kept(folder, name, lambda world=world: [_chance(f"{WORLDS}:{world[asked.gym]}", asked.games)])
        for name, title, world in (("random", RANDOM, PLAIN), ("masked", f"{RANDOM}, masked", MASKED))
    }
    for name, row in rows.items():
        if asked.row and name not in asked.row:
            continue
        print(f"{name}: {row.title}, {asked.minutes:g} min", flush=True)
        judged[row.title] = _kept(folder, name, lambda row=row, name=name: train_and_judge(folder / name, row, asked))
        write_result(folder, judged, asked.slowed)


def means_of(folders: list[Path], rows: dict[str, Row]) -> dict[str, list[dict[str, float]]]:
    """Return each row's curve as the mean over seeds, with the standard error of that mean."""
    titles = {"random": RANDOM, "masked": f"{RANDOM}, masked", **{name: row.title for name, row in rows.items()}}
    found = {}
    for name, title in titles.items():
        if not all((folder / f"{name}.json").is_file() for folder in folders):
            continue
        curves = [json.loads((folder / f"{name}.json").read_text(encoding="utf-8")) for folder in folders]
        found[title] = [_mean(moments) for moments in zip(*curves, strict=True)]
    return found


def _mean(seeds: tuple[dict[str, float], ...]) -> dict[str, float]:
    means = {key: float(np.mean([one[key] for one in seeds])) for key in seeds[0]}
    for name in ("reward", "length"):
        means[f"{name}_error"] = float(np.std([one[name] for one in seeds], ddof=1) / len(seeds) ** 0.5)
    return means


def write_result(folder: Path, judged: dict[str, list[dict[str, float]]], is_slowed: bool) -> None:
    """Write chart and table, and print the table."""
    write_chart(folder / "chart.png", judged, "minutes of training" + is_slowed * f", {SLOWED}")
    (folder / "table.md").write_text(table(judged), encoding="utf-8")
    print(table(judged) + f"\n{folder / 'chart.png'}")


def train_and_judge(run: Path, row: Row, asked: argparse.Namespace) -> list[dict[str, float]]:
    """Train a row in a process of its own on the cores it is given; return what its checkpoints come to."""
    sets = [f"--set={one}" for one in row.settings]
    new = [f"{WORLDS}:{row.world}", f"--algorithm={row.algorithm}", *sets, f"--seed={asked.seed}"]
    words = ["--resume"] if run.exists() else new
    stop = [f"--stop={row.stop(asked.minutes)}", f"--run={run}"]
    with _on_cores(row.cores):
        subprocess.run([sys.executable, "-m", "racecraft", "gym", "train", *words, *stop], check=True)
    trained = rc.read_run(run)
    lines = {int(line["iteration"]): line for line in trained.metrics().iter_rows(named=True)}
    kept = sorted(lines.keys() & {entry.iteration for entry in trained.checkpoints})
    if not kept:
        sys.exit(f"{run}: {asked.minutes:g} minutes kept no checkpoint; give more --minutes")
    return [
        {
            "minutes": row.minutes(lines[iteration]),
            "steps": lines[iteration]["steps"],
            **_play(f"{WORLDS}:{row.world}", trained.policy(str(iteration)), asked.games),
        }
        for iteration in _along_the_way(kept, [row.minutes(lines[one]) for one in kept], asked.minutes)
    ]


def table(judged: dict[str, list[dict[str, float]]]) -> str:
    """Return the rows at the end of their training as Markdown."""
    head = ("| row | minutes | steps | reward of a game | turns of a game |", "|---|---|---|---|---|")
    lines = [
        f"| {title} | {end['minutes']:.2f} | {end['steps']:,.0f} | {end['reward']:.1f} ± {end['reward_error']:.1f} "
        f"| {end['length']:.0f} ± {end['length_error']:.0f} |"
        for title, (*_, end) in judged.items()
    ]
    return "\n".join((*head, *lines)) + "\n"


def write_chart(path: Path, judged: dict[str, list[dict[str, float]]], time_label: str) -> None:
    """Draw reward and length over minutes of training; a band is a standard error, a dotted line is chance."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, both = plt.subplots(2, 1, figsize=(8.6, 8.0), sharex=True, layout="constrained")
    for axes, name, head in zip(
        both, ("reward", "length"), ("mean reward of a game, all snakes together", "mean length of a game, turns"),
        strict=True,
    ):  # fmt: skip
        for title, curve in judged.items():
            minutes, means, errors = (
                np.array([one[key] for one in curve]) for key in ("minutes", name, f"{name}_error")
            )
            if len(curve) == 1 and not minutes[0]:
                axes.axhline(means[0], color="grey", ls=":" if title == RANDOM else "--", label=title)
                continue
            (line,) = axes.plot(minutes, means, marker="o", ms=3.5, label=title)
            axes.fill_between(minutes, means - errors, means + errors, color=line.get_color(), alpha=0.15, lw=0)
        axes.set_title(head, loc="left", fontsize=9)
    both[1].set_yscale("log")
    both[1].set_xlabel(time_label)
    figure.legend(*both[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)
    plt.close(figure)


class RandomMoves:
    """A policy of equally likely moves; a mask removes some."""

    def __init__(self) -> None:
        self._rng = np.random.default_rng(1)

    def act(self, observations: dict[str, Array], action_mask: Array | None = None) -> Array:
        liking = self._rng.random((len(next(iter(observations.values()))), 4))
        return np.asarray((liking if action_mask is None else liking * action_mask).argmax(axis=1))

    def reset_state(self, rows: Array) -> None:
        pass


class Tally:
    """Adds up the first game of each world; it ends when every snake's episode has ended."""

    def __init__(self, world: World) -> None:
        self._ended = np.zeros((world.spec.num_worlds, world.spec.num_agents), bool)
        self.reward = np.zeros(world.spec.num_worlds)
        self.length = np.zeros(world.spec.num_worlds)

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        playing = ~self._ended.all(axis=1)
        self.length += playing
        self.reward += np.where(playing, buffers.reward.sum(axis=1, dtype=np.float64), 0.0)
        self._ended |= buffers.ended


def _chance(world_name: str, games: int) -> dict[str, float]:
    return {"minutes": 0.0, "steps": 0.0, **_play(world_name, RandomMoves(), games)}


def _play(world_name: str, policy: Policy, games: int) -> dict[str, float]:
    """Return means and standard errors over whole games."""
    module, _, name = world_name.partition(":")
    with contextlib.closing(getattr(importlib.import_module(module), name)(games)) as world:
        tally = Tally(world)
        play_episodes(policy, world, seed=SEED_OF_JUDGING, observers=[tally])
    means: dict[str, float] = {}
    for name, values in (("reward", tally.reward), ("length", tally.length)):
        means |= {name: float(values.mean()), f"{name}_error": float(values.std() / games**0.5)}
    return means


def _along_the_way(kept: list[int], moments: list[float], minutes: float) -> list[int]:
    """Return the kept iterations, of these moments, nearest to evenly spread ones, and the last."""
    wanted = minutes * np.arange(1, MOMENTS + 1) / MOMENTS
    return sorted({kept[int(np.abs(np.array(moments) - moment).argmin())] for moment in wanted} | {kept[-1]})


def _kept(folder: Path, name: str, make: Any) -> list[dict[str, float]]:
    """Return a row's figures from its file, or make them and keep them."""
    path = folder / f"{name}.json"
    if not path.is_file():
        path.write_text(json.dumps(make(), indent=1) + "\n", encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))


def _usable_cores() -> list[int]:
    return sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else list(range(os.cpu_count() or 1))


@contextlib.contextmanager
def _on_cores(count: int) -> Iterator[None]:
    """Give processes that start meanwhile the first `count` cores (Linux); elsewhere threads alone limit them."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, set(sorted(before)[:count]))
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def _side_by_side(games: int, threads: int) -> tuple[str, ...]:
    return (f"rollout.num_worlds={games}", f"rollout.horizon={TURNS_OF_AN_ITERATION}", f"runtime.threads={threads}")


def _group(name: str, *settings: str) -> tuple[str, ...]:
    return tuple(f"{name}.{one}" for one in settings)


if __name__ == "__main__":
    main()
