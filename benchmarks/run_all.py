"""Run the benchmarks one after the other and write `benchmarks/README.md`, the table of what this machine can do.

    make bench                                  everything, about 40 minutes; nothing else should run
    python benchmarks/run_all.py start_up laps  some of it; the other rows stay as they were

Figures live in `benchmarks/results.json`; the README is made from them and from nothing else.
"""

from __future__ import annotations

import datetime
import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
RESULTS = HERE / "results.json"
PAGE = HERE / "README.md"

COMMANDS = {
    "world": ["-m", "racecraft", "bench", "world", "--json"],
    "laps": ["-m", "racecraft", "bench", "laps", "--json"],
    "sb3": [str(HERE / "sb3_cars.py")],
    "start_up": [str(HERE / "start_up.py")],
    "cartpole": [str(HERE / "cartpole.py")],
    "snake_server": [str(HERE / "snake_server.py")],
    "snakes_training": [str(HERE / "snakes_training.py")],
}
"""Each prints its figures as one JSON object on its last line."""


def main(names: list[str]) -> None:
    """Run what is asked for, keep the figures, write the page."""
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for name in names or COMMANDS:
        print(f"{name} …", flush=True)
        done = subprocess.run([sys.executable, *COMMANDS[name]], capture_output=True, text=True, check=True)
        figures = json.loads(done.stdout.strip().splitlines()[-1])
        results[name] = {**figures, "machine": machine(), "date": datetime.date.today().isoformat()}
        RESULTS.write_text(json.dumps(results, indent=2) + "\n")
        PAGE.write_text(page(results))
    print(PAGE.read_text())


def machine() -> str:
    """Return the machine in words."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [
            line.split(":")[1].strip() for line in cpuinfo.read_text().splitlines() if line.startswith("model name")
        ]
        model = names[0] if names else model
    return f"{model}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"


def page(results: dict[str, Any]) -> str:
    """Return the table as Markdown."""
    rows = [row for name, make in ROWS.items() if name in results for row in make(results[name])]
    machines = sorted({f"{part['machine']}, measured {part['date']}" for part in results.values()})
    return "\n".join(
        [
            "# Benchmarks",
            "",
            "Made by `make bench` from `results.json`; scripts stand beside this page. "
            f"Machine: {'; '.join(machines)}. A dash in the last column means that there is no spread to tell.",
            "",
            "| what | measured | at least | aim | spread |",
            "|---|---|---|---|---|",
            *(f"| {what} | {value} | {floor} | {aim} | {spread} |" for what, value, floor, aim, spread in rows),
            "",
            "The benchmark car is the default one: profile v6, ten actions (±30°, ±15°, 0° at 0.5 and 1.0 m/s), the "
            "centre-line reward, re:Invent 2018. Seconds to stable laps run from the first training tick to the second "
            "evaluation in a row in which all five starts bring a full lap, evaluations in, compilation out. "
            "Stable-Baselines3 drives the same world with the same minibatches, epochs, step size, discount and policy "
            "network, judged the same way, seeds interleaved with ours in the same run. It was given our "
            "settings; no search for better ones of its own was made.",
            "",
        ]
    )


def world_rows(figures: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of the car world's speed."""

    def row(what: str, name: str, floor: str, aim: str) -> tuple[str, ...]:
        key = f"ticks_per_second_{name}"
        return (
            what, f"{figures[key]:,} ticks/s", floor, aim, f"{figures[f'{key}_low']:,} – {figures[f'{key}_high']:,}"
        )  # fmt: skip

    scaling = figures["ticks_per_second_two_cores"] / figures["ticks_per_second_one_core"]
    return [
        row("world + 160×120 anti-aliased grey + all reward parameters, one core, 64 cars", "one_core", "15k", "25k"),
        row("the same with the default Python reward", "one_core_python_reward", "8k", "15k"),
        row("the same on two cores, without Python reward", "two_cores", "-", "-"),
        ("two cores over one", f"{scaling:.2f}×", "1.7×", "1.9×", "-"),
    ]


def laps_rows(figures: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the row of seconds to stable laps."""
    spread = ", ".join("not reached" if value is None else f"{value:g}" for value in figures["seconds_to_stable_laps"])
    what = f"`train --stop laps` on reinvent_base, median of {len(figures['seeds'])} seeds"
    return [(what, f"{figures['median_seconds']:g} s", "12 s", "6 s", spread)]


def sb3_rows(figures: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows beside Stable-Baselines3."""
    ours, theirs = (", ".join(f"{value:g}" for value in figures[key]) for key in ("ours_seconds", "sb3_seconds"))
    speed = figures["median_ours_steps_per_second"] / figures["median_sb3_steps_per_second"]
    mean = figures["mean_sb3_seconds"] / figures["mean_ours_seconds"]
    median = figures["median_sb3_seconds"] / figures["median_ours_seconds"]
    what = "Stable-Baselines3 PPO on our world over ours"
    return [
        (f"{what}: median seconds to stable laps", f"{median:.2f}×", "1.2×", "2×", f"ours {ours}; theirs {theirs}"),
        (f"{what}: mean seconds to stable laps", f"{mean:.2f}×", "-", "-", "the same runs"),
        ("training steps a second, evaluations in, ours over Stable-Baselines3", f"{speed:.2f}×", "-", "-",
         f"{figures['median_ours_steps_per_second']:,} over {figures['median_sb3_steps_per_second']:,}"),
    ]  # fmt: skip


def start_up_rows(figures: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of waiting and of memory."""
    return [
        ("command to first tick, warm", f"{figures['warm_seconds']:g} s", "4 s", "2 s",
         f"{figures['warm_low']:g} – {figures['warm_high']:g}"),
        ("command to first tick, first run ever", f"{figures['first_run_ever_seconds']:g} s", "60 s", "30 s", "-"),
        ("resident memory of `make demo`", f"{figures['demo_memory_mb']:,} MB", "2 GB", "1 GB", "-"),
    ]  # fmt: skip


def cartpole_rows(figures: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the row of CartPole."""
    spread = ", ".join(f"{value:g}" for value in figures["seconds"])
    what = "CartPole-v1 solved (mean 475 over 100 episodes) through `racecraft gym train`, process start included"
    return [(what, f"{figures['median_seconds']:g} s", "60 s", "20 s", spread)]


def snake_server_rows(figures: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of two hundred games on one server."""
    what = f"{figures['games']} snakes at once on one server, 500 ms timeout, clients thinking 100 ms, policy"
    return [
        (f"{what}: p99 at the server", f"{figures['p99_ms']:g} ms", "100 ms", "-",
         f"p50 {figures['p50_ms']:g} ms; at the clients {figures['client_p50_ms']:g}, {figures['client_p99_ms']:g} ms"),
        ("the same: late answers", f"{figures['late']} of {figures['moves']:,}", "0", "0", "-"),
    ]  # fmt: skip


def snakes_training_rows(figures: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of a snake trained for minutes."""
    greedy, searching = figures["greedy_against_flood_fill"], figures.get("with_search_against_search")
    what = f"a snake after `snakes train --snakes 2 --stop minutes={figures['minutes']:g}`"
    rows = [
        (f"{what}: share of {greedy['games']} duels on 11×11 won against flood_fill, no search",
         f"{greedy['won_share']:.1%}", "55%", "-",
         f"{greedy['low']:.1%} – {greedy['high']:.1%}; {greedy['drawn']} drawn"),
    ]  # fmt: skip
    if searching:
        rows.append(
            (f"the same with search on top, against search, {searching['milliseconds_a_move']:g} ms a move, "
             f"{searching['games']} duels, a draw counts half", f"{searching['score_share']:.1%}", "50%", "-",
             f"{searching['low']:.1%} – {searching['high']:.1%}; {searching['drawn']} drawn")
        )  # fmt: skip
    return rows


ROWS = {
    "world": world_rows,
    "laps": laps_rows,
    "sb3": sb3_rows,
    "start_up": start_up_rows,
    "cartpole": cartpole_rows,
    "snake_server": snake_server_rows,
    "snakes_training": snakes_training_rows,
}

if __name__ == "__main__":
    main(sys.argv[1:])
