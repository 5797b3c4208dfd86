"""`racecraft reward`: what a reward function pays for, before a training and after it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from racecraft.cli.from_request import command
from racecraft.cli.output import print_files
from racecraft.contract.message import ends, figure
from racecraft.worlds.deepracer.actions.reward import (
    CheckedReward,
    ExplainedReward,
    MappedReward,
    RescoredLaps,
    RewardSamples,
    TestedReward,
    check_reward,
    explain_reward,
    map_reward,
    rescore,
    reward_samples,
    run_reward_cases,
)

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.driving.reward.paying import Failure

MAX_LAPS, MAX_LINES = 20, 15

app = typer.Typer(help="Check a reward function, see what it pays, and pay old laps again.", no_args_is_help=True)


def _show_check(checked: CheckedReward) -> None:
    found = checked.check
    for one in found.findings:
        place = f"{found.source.path}:{one.line}" if one.line else str(found.source.path)
        print(f"{one.level.upper()} {place}: {one.text}.")
        if one.hint:
            print(f"      {one.hint}")
    if found.lowest is None or found.highest is None:
        print(f"None of {found.situations} moments was paid.")
    else:
        pays = " to ".join(ends(found.lowest, found.highest))
        print(f"{found.situations} moments pay {pays}; a call takes {found.cost}.")
    if found.tricks:
        print("What would pay more than lapping?")
        for trick in found.tricks:
            pays, lap_pays = figure(trick.pays), figure(trick.lap_pays)
            print(f"  {trick.name:28} {pays:>10} {trick.unit:8}  lap {lap_pays:>10}  {trick.answer}")
    if found.speed is not None and all(one.kind != "speed" for one in found.findings):
        print(f"The reward {found.speed.sentence}.")
    notes = len(found.findings) - found.faults
    print(f"{found.faults} fault{'s' * (found.faults != 1)}, {notes} note{'s' * (notes != 1)}.")
    if checked.page is not None:
        print(f"page: {checked.page}")


def _show_rescored(done: RescoredLaps) -> None:
    found = done.laps
    before, after = found.time_ranks
    print(f"{len(found.rewards):,} rows, {len(found.episodes):,} episodes, {len(found.laps):,} complete laps on "
          f"{found.track.name}.")  # fmt: skip
    print(f"Both rewards order the episodes with a rank correlation of {found.agreement:+.2f}.")
    if found.laps:
        print(f"Lap time and reward: {before:+.2f} in the log, {after:+.2f} now (positive: slow laps earn more).")
        print(f"{'episode':>8} {'lap':>8} {'then':>10} {'now':>10}  place by reward")
        for lap, old, new in found.places()[:MAX_LAPS]:
            moved = "" if old == new else f"  {'up' if new < old else 'down'} {abs(new - old)}"
            pays = f"{figure(lap.old):>10} {figure(lap.new):>10}"
            print(f"{lap.episode:8} {lap.seconds:6.2f} s {pays}  {old} → {new}{moved}")
    _show_failures(found.failures)
    print_files(done.files)


def _show_lines(explained: ExplainedReward) -> None:
    import numpy as np

    found, track = explained.lines, explained.track
    print(f"{found.rows:,} rows on {track.name} were paid {figure(found.total)}" + (
        f"; `{found.variable}` is built up line by line." if found.variable else ".")
    )  # fmt: skip
    for one in found.lines[:MAX_LINES]:
        tenth = int(np.argmax(np.abs(one.by_part)))
        where = f"most at {10 * tenth} to {10 * tenth + 10} % of the lap"
        print(f"{one.line:5} {figure(one.total):>12} {100 * one.share:4.0f} %  {where}   {one.text}")
    if found.values:
        print("Other numbers, on average: " + ", ".join(f"{name} {value:.4g}" for name, value in found.values.items()))
    _show_failures(found.failures)


def _show_map(done: MappedReward) -> None:
    import numpy as np

    mapped, facts = done.map, done.as_dictionary()
    print(f"{mapped.what} on {done.track.name} at {done.speed:g} m/s: {facts['lowest']:.4g} to {facts['highest']:.4g}")
    lanes = np.nanmean(mapped.pay, axis=0)
    for lane in range(len(lanes) - 1, -1, -2):
        print(f"  {float(mapped.offsets[:, lane].mean()):+.2f} m  {lanes[lane]:10.4g}")
    if done.pull is not None:
        for one in sorted(facts["pull"]["actions"], key=lambda one: -one["mean_pay"]):
            best = f"best at {100 * one['best_share']:3.0f} % of the places"
            print(f"  {one['action']:28} {one['mean_pay']:10.4g}  {best}")
    print_files(done.files)


def _show_tests(tested: TestedReward) -> None:
    for one in tested.results:
        print(f"{'ok  ' if one.passed else 'FAIL'} {one.case.name}{'' if one.passed else f': {one.text}'}")
    print(f"{len(tested.results) - tested.failed} of {len(tested.results)} cases hold.")


def _show_samples(found: RewardSamples) -> None:
    print(found.text, end="")
    for name, sentence in found.samples.items():
        print(f"{name:18} {sentence}")


def _show_failures(failures: Sequence[Failure]) -> None:
    from racecraft.worlds.deepracer.driving.reward.paying import MAX_FAILURES

    for failure in failures[:5]:
        print(f"row {failure.row}: line {failure.line}: {failure.message}")
    if failures:
        end = ", and the rows behind the last of them were not tried" if len(failures) == MAX_FAILURES else ""
        print(f"{len(failures)} rows failed and are counted as 0{end}.")


app.command("check")(command(check_reward, _show_check))
app.command("map")(command(map_reward, _show_map))
app.command("rescore")(command(rescore, _show_rescored, messages_aside=True))
app.command("test")(command(run_reward_cases, _show_tests))
app.command("explain")(command(explain_reward, _show_lines))
app.command("samples")(command(reward_samples, _show_samples))
