"""Curves of algorithms over seeds, on two worlds: the simple ones, those that learn what choices are worth, or PPO.

    python benchmarks/algorithm_curves.py simple            REINFORCE, evolution strategies, behavioural cloning
    python benchmarks/algorithm_curves.py worths            DQN and Ape-X
    python benchmarks/algorithm_curves.py ppo               PPO, and PPO with short rollouts
    python benchmarks/algorithm_curves.py simple --draw     draw again what was run

Writes benchmarks/curves-GROUP.json and the group's picture, and prints the table of its docs page. Every run has the
settings that `racecraft gym train ID --algorithm NAME` begins with and the same budget of steps; behavioural cloning,
which takes none, learns from twenty episodes of a run that solved the world. Steps count and not seconds, so a machine
that does other things meanwhile changes nothing but the column of seconds: those of the processor, of one thread, or of
the clock where a run kept no others.
"""

from __future__ import annotations

import argparse
import io
import json
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from racecraft.formats.demonstrations import write_demonstrations
from racecraft.training.callbacks import TrainingCallback
from racecraft.training.demonstrating import record_run
from racecraft.training.progress import LineWatcher
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.training.trainer import GymRequest

HERE = Path(__file__).resolve().parent
PICTURES = {"simple": "simple-algorithms.png", "worths": "worths.png", "ppo": "ppo.png"}
WORLDS = {"CartPole-v1": 475.0, "Acrobot-v1": -100.0}
"""Worlds, and the mean return that counts as solved."""
BUDGET = 200_000
"""Steps of one run at most."""
CLONES = "behavioural cloning"
SHORT = (
    "rollout.horizon=32", "ppo.epochs=20", "ppo.batch_size=256", "ppo.discount=0.98", "ppo.gae_lambda=0.8",
    "ppo.entropy_weight=0", "network.separate_networks=false", "evaluation.every=8",
)  # fmt: skip
"""What was tuned for poles: little is collected, and looked over often, by a policy that nothing keeps open."""
GROUPS: dict[str, dict[str, tuple[str, tuple[str, ...]]]] = {
    "simple": {
        "REINFORCE, value baseline": ("reinforce", ()),
        "REINFORCE, no baseline": ("reinforce", ("reinforce.baseline=none",)),
        "evolution strategies": ("es", ()),
        CLONES: ("bc", ()),
    },
    "worths": {"DQN": ("dqn", ()), "Ape-X": ("apex", ())},
    "ppo": {"PPO": ("ppo", ()), "PPO, short rollouts": ("ppo", SHORT)},
}
"""Of each group the kinds: what they are called, the algorithm, and settings that differ."""
SMOOTHED = 5_000
"""Over so many steps what was earned is averaged, however long an iteration is."""
COLOURS = ("#1b6ca8", "#8fbcd4", "#d1622b")
SEEDS = (1, 2, 3)
MORE_SEEDS = {"ppo": (4, 5)}


def quiet() -> TrainingCallback:
    """Return a watcher that says nothing."""
    return LineWatcher(io.StringIO())


def one_run(world: str, algorithm: str, seed: int, folder: Path, overrides: tuple[str, ...], stop: str) -> Any:
    """Train once; return what came of it and the curve: [steps, mean training return] of each iteration."""
    stops = (f"score={WORLDS[world]:g}", stop)
    request = GymRequest(world, algorithm=algorithm, seed=seed, run=folder, stops=stops, overrides=overrides)
    began = time.process_time()
    told = train(request, quiet(), lambda text: None).summary()
    spent = time.process_time() - began
    rows = [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]
    curve = [[row["steps"], row["training_score"]] for row in rows if row["training_score"] is not None]
    return {
        "solved": told["solved"],
        "steps": told["env_steps"],
        "seconds": told["seconds"],
        "processor_seconds": round(spent, 1),
        "return": told["evaluation"]["mean_return"],
        "iterations": told["iterations"],
        "curve": curve,
    }


def results_of(group: str) -> Path:
    """Return where what a group did is kept."""
    return HERE / f"curves-{group}.json"


def run_all(group: str, folder: Path) -> dict[str, Any]:
    """Run every kind on every world with every seed."""
    found: dict[str, Any] = {}
    for world in WORLDS:
        found[world] = {}
        for kind, (algorithm, overrides) in GROUPS[group].items():
            found[world][kind] = []
            stop = f"steps={BUDGET}"
            if kind == CLONES:
                stop, overrides = "iterations=20", (f"bc.demonstrations={shown(world, group, folder)}",)
            for seed in (*SEEDS, *MORE_SEEDS.get(group, ())):
                told = one_run(world, algorithm, seed, folder / f"{world}-{kind}-{seed}", overrides, stop)
                found[world][kind].append(told)
                print(world, kind, seed, {name: told[name] for name in ("solved", "steps", "seconds", "return")})
                results_of(group).write_text(json.dumps(found))
    return found


def shown(world: str, group: str, folder: Path) -> Path:
    """Record twenty episodes of the group's first kind, first seed."""
    demos = folder / f"{world}.safetensors"
    write_demonstrations(demos, record_run(str(folder / f"{world}-{next(iter(GROUPS[group]))}-{SEEDS[0]}"), 20))
    return demos


def table(found: dict[str, Any]) -> str:
    """Return the results as Markdown."""
    lines = ["| world | algorithm | solved | steps, median | seconds, median | return at the end, median |"]
    lines.append("|---|---|---|---|---|---|")
    for world, kinds in found.items():
        for kind, runs in kinds.items():
            solved = f"{sum(run['solved'] for run in runs)} of {len(runs)}"
            steps, end = (statistics.median(run[name] for run in runs) for name in ("steps", "return"))
            seconds = statistics.median(run.get("processor_seconds", run["seconds"]) for run in runs)
            passes = statistics.median(run["iterations"] for run in runs)
            taken = f"{passes:.0f} pass{'es' * (passes > 1)}" if kind == CLONES else f"{steps:,.0f}"
            lines.append(f"| {world} | {kind} | {solved} | {taken} | {seconds:.0f} | {end:.0f} |")
    return "\n".join(lines)


def draw(group: str, found: dict[str, Any]) -> None:
    """Draw each run thin and smoothed over SMOOTHED steps."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(found), figsize=(10, 3.8), dpi=110)
    for axis, (world, kinds) in zip(axes, found.items(), strict=True):
        drawn = [kind for kind in GROUPS[group] if kind != CLONES]
        for kind, colour in zip(drawn, COLOURS, strict=False):
            for index, run in enumerate(kinds[kind]):
                steps = [point[0] for point in run["curve"]]
                smooth = [
                    statistics.fmean(value for at, value in run["curve"] if now - SMOOTHED < at <= now) for now in steps
                ]
                axis.plot(steps, smooth, color=colour, lw=1.4, label=kind if index == 0 else None)
        axis.axhline(WORLDS[world], color="#777777", lw=0.8, ls=":")
        axis.set_title(f"{world} (dotted: solved)", fontsize=10)
        axis.set_xlabel("steps", fontsize=9)
        axis.xaxis.set_major_formatter(lambda value, _: f"{value / 1000:g}k")
        axis.spines[["top", "right"]].set_visible(False)
    axes[0].set_ylabel(f"training return, mean of {SMOOTHED:,} steps", fontsize=9)
    axes[0].legend(fontsize=8, frameon=False)
    figure.tight_layout()
    figure.savefig(HERE.parent / "docs" / "pictures" / PICTURES[group])


def main() -> None:
    """Run or only draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("group", choices=GROUPS)
    parser.add_argument("--draw", action="store_true", help="only draw what was run before")
    asked = parser.parse_args()
    if asked.draw:
        found = json.loads(results_of(asked.group).read_text())
    else:
        with tempfile.TemporaryDirectory() as folder:
            found = run_all(asked.group, Path(folder))
    draw(asked.group, found)
    print(table(found))


if __name__ == "__main__":
    main()
