"""`racecraft reward`: what a reward function pays for, before a training and after it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.options import Json
from racecraft.contract.errors import SettingError

if TYPE_CHECKING:
    import polars as pl

    from racecraft.worlds.deepracer.driving.reward.check import RewardCheck
    from racecraft.worlds.deepracer.driving.reward.lines_paid import LinesPaid
    from racecraft.worlds.deepracer.driving.reward.rescore import Rescored
    from racecraft.worlds.deepracer.tracks.track import Track

app = typer.Typer(help="Check a reward function, see what it pays, and pay old laps again.", no_args_is_help=True)

File = Annotated[Path, typer.Argument(help="reward_function.py, or the folder that holds one.")]
Logs = Annotated[list[Path], typer.Argument(help="Run folders, DeepRacer log folders, .tar.gz, logs or traces.")]
LogTrack = Annotated[
    str | None, typer.Option("--track", help="The track they were driven on, or its waypoint file; found by default.")
]
Page = Annotated[Path | None, typer.Option(help="Write one page (.html) that works offline.")]
PAGE_SPEED = 2.0
"""m/s, of the map on the page."""
Picture = Annotated[Path | None, typer.Option(help="Draw it into this file (.png, .svg or .pdf).")]
MAX_LAPS, MAX_LINES, MAX_TRACED = 20, 15, 4000


@app.command()
def check(
    file: File,
    for_: Annotated[
        str | None, typer.Option("--for", help="race: a reward by which slow laps earn more counts as a fault.")
    ] = None,
    track: Annotated[str, typer.Option(help="The track of the map on the page.")] = "reinvent_base",
    page: Page = None,
    json: Json = False,
) -> None:
    """Look for faults before a training: errors on 200 moments, slips of unit and sign, what pays more than lapping.

    Exit code 0: no fault; 1: at least one; 2: the file cannot be loaded.

    Examples:

        racecraft reward check my-car/reward_function.py

        racecraft reward check my-car --for race --json

        racecraft reward check my-car --page reward.html
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.driving.reward.check import check_reward

    if for_ not in (None, "race"):
        raise SettingError("--for is {found!r}; expected race.", found=for_)
    found = check_reward(_file(file), for_race=for_ == "race")
    facts = found.as_dictionary()
    if page is not None:
        from racecraft.worlds.deepracer.analysis.reward_page import write_reward_page
        from racecraft.worlds.deepracer.driving.reward.pay_map import pay_map
        from racecraft.worlds.deepracer.tracks.catalogue import load_track

        write_reward_page(page, str(found.source.path), found, pay_map(_payer(file), load_track(track), PAGE_SPEED))
        facts["page"] = str(page)
    if json:
        print_json(facts)
    else:
        _print_check(found)
        if page is not None:
            print(f"page: {page}")
    if found.faults:
        raise typer.Exit(1)


@app.command("map")
def map_(
    file: File,
    track: Annotated[str, typer.Option(help="A name from `racecraft tracks list`, or a waypoint file (.npy).")],
    *,
    speed: Annotated[float, typer.Option(min=0.1, max=5.0, help="Commanded speed, m/s.")] = 2.0,
    heading: Annotated[float, typer.Option(help="Against the road, degrees, left positive.")] = 0.0,
    steering: Annotated[float, typer.Option(help="Commanded angle, degrees, left positive.")] = 0.0,
    term: Annotated[str | None, typer.Option(help="Show this variable of the function in place of the pay.")] = None,
    table: Annotated[
        str | None,
        typer.Option(
            help="Also tell what each action of this table earns, held for half a second: a model_metadata.json, "
            "'default' or 7x1.5,2.5."
        ),
    ] = None,
    picture: Picture = None,
    page: Page = None,
    json: Json = False,
) -> None:
    """Show what a reward pays at every place of a track, at one speed and heading; one term at a time with --term.

    Examples:

        racecraft reward map my-car --track reinvent_base --picture pay.png

        racecraft reward map my-car --track reinvent_base --speed 3 --term on_line --picture line.png

        racecraft reward map my-car --track reinvent_base --table my-car/model_metadata.json --json
    """
    import numpy as np

    from racecraft.cli.output import print_json
    from racecraft.contract.errors import nearest
    from racecraft.worlds.deepracer.analysis.reward_page import write_reward_page
    from racecraft.worlds.deepracer.driving.action_tables import read_table
    from racecraft.worlds.deepracer.driving.reward.pay_map import draw_map, pay_map, pull_of_actions
    from racecraft.worlds.deepracer.env.actions import ActionTable
    from racecraft.worlds.deepracer.env.vehicle import PROFILES
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    circuit, payer = load_track(track), _payer(file)
    mapped = pay_map(payer, circuit, speed, float(np.radians(heading)), float(np.radians(steering)), term)
    if term is not None and term not in mapped.terms:
        raise SettingError(
            "--term is {found!r}; expected a variable that holds a number. {hint}",
            found=term,
            hint=nearest(term, mapped.terms),
        )
    facts = mapped.as_dictionary()
    pull = None
    if table is not None:
        actions = read_table(table)
        if not isinstance(actions, ActionTable):
            raise SettingError("--table {found} has ranges; expected a table of actions.", found=table)
        pull = pull_of_actions(payer, circuit, PROFILES["v6"], actions, speed)
        facts["pull"] = pull.as_dictionary()
    if picture is not None:
        draw_map(mapped, picture, f"{circuit.name}: {mapped.what} at {speed:g} m/s, heading {heading:+g}°")
        facts["picture"] = str(picture)
    if page is not None:
        write_reward_page(page, f"{_file(file).name} on {circuit.name}", mapped=mapped)
        facts["page"] = str(page)
    if json:
        print_json(facts)
        return
    lanes = np.nanmean(mapped.pay, axis=0)
    print(f"{mapped.what} on {circuit.name} at {speed:g} m/s: {facts['lowest']:.4g} to {facts['highest']:.4g}")
    for lane in range(len(lanes) - 1, -1, -2):
        print(f"  {float(mapped.offsets[:, lane].mean()):+.2f} m  {lanes[lane]:10.4g}")
    if pull is not None:
        for one in sorted(facts["pull"]["actions"], key=lambda one: -one["mean_pay"]):
            print(
                f"  {one['action']:28} {one['mean_pay']:10.4g}  best at {100 * one['best_share']:3.0f} % of the places"
            )
    for kind in ("picture", "page"):
        if kind in facts:
            print(f"{kind}: {facts[kind]}")


@app.command()
def rescore(
    file: File, logs: Logs, track: LogTrack = None, picture: Picture = None, page: Page = None, json: Json = False
) -> None:
    """Pay the laps of old logs again, ours or AWS's: which earn more now, and which change places.

    Examples:

        racecraft reward rescore my-car runs/reinvent_base-1

        racecraft reward rescore new_reward.py model.tar.gz --picture then-and-now.png --json
    """
    from racecraft.cli.output import print_json, say
    from racecraft.worlds.deepracer.driving.reward.rescore import rescore as pay_again

    payer = _payer(file)
    ticks, circuit = _ticks(logs, track)
    found = pay_again(ticks, circuit, payer)
    if any("has no objects" in remark for remark in payer.process.source.remarks):
        say("The function reads objects, and logs do not say where they stood: it is told of none.", quiet_stdout=True)
    facts = found.as_dictionary()
    if picture is not None:
        _draw_scatter(found, picture)
        facts["picture"] = str(picture)
    if page is not None:
        from racecraft.worlds.deepracer.analysis.reward_page import write_reward_page

        write_reward_page(page, f"{_file(file).name} on {', '.join(log.name for log in logs)}", rescored=found)
        facts["page"] = str(page)
    if json:
        print_json(facts)
        return
    _print_rescored(found)
    for kind in ("picture", "page"):
        if kind in facts:
            print(f"{kind}: {facts[kind]}")


@app.command()
def test(
    file: File,
    cases: Annotated[
        Path | None, typer.Option(help="The file of cases. [default: reward_test.toml beside the function]")
    ] = None,
    json: Json = False,
) -> None:
    """Run your own expectations of a reward: cases such as "the centre pays more than the border".

    A file reward_test.toml beside reward_function.py is run before every training. One case:

        [[case]]

        name = "the centre pays more than the border"

        here = { share = 0.1, offset_m = 0.0, speed_mps = 2.0 }

        more_than = { share = 0.1, offset_m = 0.3, speed_mps = 2.0 }

    Other expectations: pays, at_least, at_most, less_than. Other keys of a place: heading_degrees, steering_degrees,
    ticks. Exit code 1 when a case fails.

    Example: racecraft reward test my-car
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.driving.reward.cases import CASES, run_cases

    payer = _payer(file)
    results = run_cases(cases or _file(file).with_name(CASES), payer)
    failed = [result for result in results if not result.passed]
    if json:
        rows = [{"name": one.case.name, "passed": one.passed, "text": one.text} for one in results]
        print_json({"cases": rows, "failed": len(failed)})
    else:
        for one in results:
            print(f"{'ok  ' if one.passed else 'FAIL'} {one.case.name}{'' if one.passed else f': {one.text}'}")
        print(f"{len(results) - len(failed)} of {len(results)} cases hold.")
    if failed:
        raise typer.Exit(1)


@app.command()
def explain(
    run: Annotated[Path, typer.Argument(help="Run folder, or any log with --reward.")],
    reward: Annotated[Path | None, typer.Option(help="The reward function. [default: the run's own]")] = None,
    track: LogTrack = None,
    json: Json = False,
) -> None:
    """Tell which lines of a run's reward paid, and where on the track: its latest rows are paid again, line by line.

    Examples:

        racecraft reward explain runs/reinvent_base-1

        racecraft reward explain model.tar.gz --reward reward_function.py --json
    """
    from racecraft.cli.output import print_json
    from racecraft.formats.run_folder import REWARD_FUNCTION
    from racecraft.worlds.deepracer.driving.reward.lines_paid import lines_paid
    from racecraft.worlds.deepracer.driving.reward.rescore import rows_of

    payer = _payer(reward or run / REWARD_FUNCTION)
    ticks, circuit = _ticks([run], track)
    rows, has_reward = rows_of(ticks, circuit)
    found = lines_paid(payer, circuit, rows[has_reward][-MAX_TRACED:])
    if json:
        print_json({"track": circuit.name, **found.as_dictionary()})
    else:
        _print_lines(found, circuit)


@app.command()
def samples(
    name: Annotated[str | None, typer.Argument(help="Print this sample; without a name all are listed.")] = None,
    json: Json = False,
) -> None:
    """List rewards to begin with, or print one.

    Examples:

        racecraft reward samples

        racecraft reward samples metres_gained > reward_function.py
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.files.reward_samples import describe_sample, read_sample, sample_names

    if name is not None:
        text = read_sample(name)
        if json:
            print_json({"name": name, "text": text})
        else:
            print(text, end="")
        return
    told = {one: describe_sample(one) for one in sample_names()}
    if json:
        print_json({"samples": told})
        return
    for one, text in told.items():
        print(f"{one:18} {text}")


def _file(path: Path) -> Path:
    """Return the reward function that a path means: itself, or the one in a folder."""
    return path / "reward_function.py" if path.is_dir() else path


def _payer(path: Path) -> Any:
    from racecraft.worlds.deepracer.driving.reward.paying import Payer
    from racecraft.worlds.deepracer.env.reward_process import open_reward

    return Payer(open_reward(_file(path), sys.stderr))


def _ticks(logs: list[Path], track: str | None) -> tuple[pl.DataFrame, Track]:
    """Return the ticks of logs, and the circuit that they were driven on."""
    from racecraft.worlds.deepracer.analysis.logs import find_track, track_or_none
    from racecraft.worlds.deepracer.logs import read

    found = read(logs)
    ticks = found.require_ticks()
    circuit = find_track(ticks, track) if track is not None else track_or_none(ticks, found.about.get("world"))
    return ticks, circuit or find_track(ticks)


def _print_check(found: RewardCheck) -> None:
    for one in found.findings:
        place = f"{found.source.path}:{one.line}" if one.line else str(found.source.path)
        print(f"{one.level.upper()} {place}: {one.text}.")
        if one.hint:
            print(f"      {one.hint}")
    print(f"{found.situations} moments pay {found.lowest:.4g} to {found.highest:.4g}; a call takes "
          f"{found.microseconds:.1f} µs.")  # fmt: skip
    if found.tricks:
        print("What would pay more than lapping?")
        for trick in found.tricks:
            unit = "in sum" if trick.is_sum else "a second"
            answer = "more" if trick.pays_more else "as much" if trick.pays_the_same else "less"
            print(f"  {trick.name:28} {trick.pays:10.4g} {unit:8}  lap {trick.lap_pays:10.4g}  {answer}")
    if found.speed is not None:
        print(f"The reward {found.speed.sentence}.")
    faults = f"{found.faults} fault{'' if found.faults == 1 else 's'}"
    print(f"{faults}, {len(found.findings) - found.faults} notes.")


def _print_rescored(found: Rescored) -> None:
    before, after = found.time_ranks
    print(f"{len(found.rewards):,} rows, {len(found.episodes):,} episodes, {len(found.laps):,} complete laps on "
          f"{found.track.name}.")  # fmt: skip
    print(f"Both rewards order the episodes with a rank correlation of {found.agreement:+.2f}.")
    if found.laps:
        print(f"Lap time and reward: {before:+.2f} in the log, {after:+.2f} now (positive: slow laps earn more).")
        print(f"{'episode':>8} {'lap':>8} {'then':>10} {'now':>10}  place by reward")
        for lap, old, new in found.places()[:MAX_LAPS]:
            moved = "" if old == new else f"  {'up' if new < old else 'down'} {abs(new - old)}"
            print(f"{lap.episode:8} {lap.seconds:6.2f} s {lap.old:10.4g} {lap.new:10.4g}  {old} → {new}{moved}")
    for failure in found.failures[:5]:
        print(f"row {failure.row}: line {failure.line}: {failure.message}")
    if found.failures:
        print(f"{len(found.failures)} rows failed and are counted as 0.")


def _print_lines(found: LinesPaid, track: Track) -> None:
    import numpy as np

    print(f"{found.rows:,} rows on {track.name} were paid {found.total:.4g}" + (
        f"; `{found.variable}` is built up line by line." if found.variable else ".")
    )  # fmt: skip
    for one in found.lines[:MAX_LINES]:
        tenth = int(np.argmax(np.abs(one.by_part)))
        print(f"{one.line:5} {one.total:12.4g} {100 * one.share:4.0f} %  most at {10 * tenth} to {10 * tenth + 10} % "
              f"of the lap   {one.text}")  # fmt: skip
    if found.values:
        print("Other numbers, on average: " + ", ".join(f"{name} {value:.4g}" for name, value in found.values.items()))


def _draw_scatter(found: Rescored, path: Path) -> None:
    """Draw both rewards of each episode; complete laps coloured by time."""
    from racecraft.worlds.deepracer.analysis.logs.rescoring import scatter_of_rewards

    scatter_of_rewards(found).save(path)
