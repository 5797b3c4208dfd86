"""From the figures of each benchmark to rows of the table: what, measured, at least, aim, spread. Begin with `ROWS`."""

from __future__ import annotations

import re
from typing import Any

Row = tuple[str, ...]
"""What, measured, at least, aim, spread; "-" where there is none."""

LARGE = {"k": 1e3, "M": 1e6, "GB": 1e3}
"""What a figure's ending multiplies it by, beside megabytes and plain numbers."""
LESS_IS_BETTER = ("s", "ms", "MB", "late")
"""Units of which "at least" means at most."""


def meets(row: Row) -> bool | None:
    """Tell whether a row's measured figure keeps its "at least" (of seconds, memory and late answers: at most).

    >>> meets(("speed", "50,763 ticks/s", "15k", "-", "-")), meets(("two cores over one", "1.65×", "1.8×", "-", "-"))
    (True, False)
    >>> meets(("demo", "644 MB", "2 GB", "-", "-")), meets(("late", "3 of 34,211", "0", "0", "-"))
    (True, False)
    """
    if row[2] == "-":
        return None
    (measured, unit), (least, _) = _figure(row[1]), _figure(row[2])
    return measured <= least if unit in LESS_IS_BETTER else measured >= least


def told(row: Row) -> Row:
    """Return a row as the page shows it: one that misses its "at least" says so."""
    return (row[0], f"{row[1]}, **misses**", *row[2:]) if meets(row) is False else row


def _figure(text: str) -> tuple[float, str]:
    """Return a figure and its unit."""
    found = re.match(r"([\d,.]+) ?(k|M\b|GB|of|[^\d\s]*)", text)
    assert found is not None, text
    number, unit = float(found[1].replace(",", "")), found[2]
    return number * LARGE.get(unit, 1.0), "late" if unit == "of" else unit


def world_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the rows of the car world's speed."""

    def row(what: str, name: str, floor: str, aim: str) -> Row:
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


def laps_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the row of seconds to stable laps."""
    spread = ", ".join("not reached" if value is None else f"{value:g}" for value in figures["seconds_to_stable_laps"])
    what = f"`train --stop laps` on reinvent_base, median of {len(figures['seeds'])} seeds"
    return [(what, f"{figures['median_seconds']:g} s", "3 s", "1.5 s", spread)]


def car_goals_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the rows of other tracks, other learners and AWS's networks."""

    def seconds(what: str, name: str, floor: str, aim: str) -> Row:
        each = figures[name]["seconds"]
        spread = ", ".join("not reached" if value is None else f"{value:g}" for value in each)
        told = f"{what}, median of {len(each)} seeds"
        return (told, f"{figures[name]['median_seconds']:g} s", floor, aim, spread)

    aws = figures["aws"]
    return [
        seconds("stable laps on July_2020 (60 m)", "july", "90 s", "40 s"),
        seconds("SAC, continuous car, front camera: stable laps on reinvent_base", "sac", "360 s", "120 s"),
        (f"preset `aws`, exact networks, training steps a second, evaluations in, {aws['minutes']:g} minutes",
         f"{aws['steps_per_second']:,} steps/s", "300", "400",
         f"{aws['steps_per_second_judging_out']:,} with evaluations out"),
    ]  # fmt: skip


def sb3_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the rows beside Stable-Baselines3."""
    ours, theirs = (", ".join(f"{value:g}" for value in figures[key]) for key in ("ours_seconds", "sb3_seconds"))
    speed = figures["median_ours_steps_per_second"] / figures["median_sb3_steps_per_second"]
    mean = figures["mean_sb3_seconds"] / figures["mean_ours_seconds"]
    median = figures["median_sb3_seconds"] / figures["median_ours_seconds"]
    what = "Stable-Baselines3 PPO on our world over ours"
    return [
        (f"{what}: median seconds to stable laps", f"{median:.2f}×", "1.5×", "3×", f"ours {ours}; theirs {theirs}"),
        (f"{what}: mean seconds to stable laps", f"{mean:.2f}×", "-", "-", "the same runs"),
        ("training steps a second, evaluations in, ours over Stable-Baselines3", f"{speed:.2f}×", "-", "-",
         f"{figures['median_ours_steps_per_second']:,} over {figures['median_sb3_steps_per_second']:,}"),
    ]  # fmt: skip


def start_up_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the rows of waiting and of memory."""
    return [
        ("command to first tick, warm", f"{figures['warm_seconds']:g} s", "4 s", "2 s",
         f"{figures['warm_low']:g} – {figures['warm_high']:g}"),
        ("`dr-start-training` to first tick, over `racecraft train` with the same folder, by turns",
         f"{figures['dr_start_training_seconds']:g} s over {figures['train_folder_seconds']:g} s", "-", "-", "-"),
        ("command to first tick, first run ever", f"{figures['first_run_ever_seconds']:g} s", "60 s", "30 s", "-"),
        ("resident memory of `make demo`", f"{figures['demo_memory_mb']:,} MB", "2 GB", "1 GB", "-"),
    ]  # fmt: skip


def cartpole_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the row of CartPole."""
    spread = ", ".join(f"{value:g}" for value in figures["seconds"])
    what = "CartPole-v1 solved (mean 475 over 100 episodes) through `racecraft gym train`, process start included"
    return [(what, f"{figures['median_seconds']:g} s", "60 s", "20 s", spread)]


def replay_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the rows of how fast a replay is drawn from."""

    def row(what: str, name: str, floor: str, aim: str) -> Row:
        spread = f"{figures[f'{name}_low']:,} – {figures[f'{name}_high']:,}"
        return (what, f"{figures[name]:,} batches/s", floor, aim, spread)

    whole = f"replay of {figures['stored']:,} transitions, batches of {figures['batch']} by priority, one core"
    return [
        row(f"{whole}: places and their weights", "places", "5k", "20k"),
        row("the same: whole transitions of four numbers", "transitions", "5k", "20k"),
        row("the same, every priority set anew afterwards", "set_anew", "-", "-"),
        row("whole transitions, all alike", "alike", "-", "-"),
    ]


def battlesnake_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the rows of the game's own speed."""

    def row(what: str, name: str, floor: str, aim: str) -> Row:
        return (
            what, f"{figures[name]:,} game-steps/s", floor, aim,
            f"{figures[f'{name}_low']:,} – {figures[f'{name}_high']:,}",
        )  # fmt: skip

    one_core = max(figures["many_one_core"], figures["sight_one_core"])
    scaling = figures["many_two_cores"] / one_core
    return [
        row("Battlesnake, 11×11, 4 snakes, rules only, one core", "rules_one_core", "1.5M", "3M"),
        row("the same with masks and the default observation", "sight_one_core", "300k", "1M"),
        ("two cores, 2,048 games, over the best of one core, with masks and observation", f"{scaling:.2f}×", "1.8×",
         "-", f"{figures['many_two_cores']:,} over {one_core:,}"),
    ]  # fmt: skip


def unity_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the rows of the Unity protocol."""
    official = {agents: figures.get(f"official_exchanges_{agents}") for agents in (1, 64)}
    beside = {agents: f"the official client {agents * rate:,}" if rate else "-" for agents, rate in official.items()}
    basic = sorted(figures["basic_seconds"])
    return [
        ("Unity, one agent, bare exchanges", f"{figures['exchanges_1']:,} /s", "900 /s", "-", beside[1]),
        ("Unity, 64 agents in one process, agent-steps", f"{64 * figures['exchanges_64']:,} /s", "20,000 /s", "-",
         beside[64]),
        ("Unity's Basic to a mean of 0.92 over 20 greedy episodes, process start included, median of "
         f"{len(basic)} seeds", f"{basic[len(basic) // 2]:g} s", "20 s", "-", ", ".join(f"{one:g}" for one in basic)),
    ]  # fmt: skip


def snake_server_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the rows of two hundred games on one server."""
    what = f"{figures['games']} snakes at once on one server, 500 ms timeout, clients thinking 100 ms, policy"
    return [
        (f"{what}: p99 at the server", f"{figures['p99_ms']:g} ms", "100 ms", "-",
         f"p50 {figures['p50_ms']:g} ms; at the clients {figures['client_p50_ms']:g}, {figures['client_p99_ms']:g} ms"),
        ("the same: late answers", f"{figures['late']} of {figures['moves']:,}", "0", "0", "-"),
    ]  # fmt: skip


def snake_search_rows(figures: dict[str, Any]) -> list[Row]:
    """Return the rows of what search looks at in a second."""
    rows = []
    for snakes in ("2 snakes", "4 snakes"):
        told = figures[snakes]
        depth = f"{told['sure_depth'][0]:g} turns deep"
        for what, name, floor, aim in (
            (f"search, 11×11, {snakes}, no policy, one core: positions played by alpha-beta, {depth}",
             "sure_positions", "200k", "1M"),
            (f"the same, {snakes}: positions played by the tree", "tree_positions", "200k", "1M"),
            (f"the same, {snakes}: positions appraised by the tree, one a walk", "tree_walks", "-", "-"),
            (f"the same, {snakes}: turns of the rules alone, random safe moves chosen", "rules", "2M", "3M"),
        ):  # fmt: skip
            middle, low, high = told[f"{name}_a_second"]
            rows.append((what, f"{middle:,} /s", floor, aim, f"{low:,} – {high:,}"))
    return rows


def snakes_training_rows(figures: dict[str, Any]) -> list[Row]:
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
    "car_goals": car_goals_rows,
    "sb3": sb3_rows,
    "start_up": start_up_rows,
    "cartpole": cartpole_rows,
    "replay": replay_rows,
    "battlesnake": battlesnake_rows,
    "unity": unity_rows,
    "snake_search": snake_search_rows,
    "snake_server": snake_server_rows,
    "snakes_training": snakes_training_rows,
}
