"""`racecraft train`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.actions.train_run import TrainedRun
from racecraft.cli.output import print_next_steps, word
from racecraft.cli.train import train_command
from racecraft.formats.run_folder import ten_minutes_more
from racecraft.worlds.deepracer.actions.train import RACES
from racecraft.worlds.deepracer.actions.train import train as action


def _show(trained: TrainedRun) -> None:
    _say_what_came_of_it(trained, {kind: path for kind, path in trained.files.items() if kind != RACES})
    if RACES in trained.files:
        _say_who_is_better(trained.files[RACES])


def _say_who_is_better(races: dict[str, Any]) -> None:
    gain = races["last_over_first"]
    print(
        f"\nAgainst others: {gain['points']:+.0f} Elo over its first self ({gain['low']:+.0f} to {gain['high']:+.0f})."
    )
    for one in races["selves"]:
        print(f"  {one['name']:20} {one['points']:6.0f}   {one['wins']} of {one['races']} races won, ", end="")
        print(f"{one['overtakes']} overtakes, {one['crashes']} crashes")
    passing = races["against_a_slower_self"]
    opponent = f"against itself at {passing['pace']:.0%} of its pace"
    print(f"  {opponent}: {passing['overtakes_per_race']:.2f} overtakes a race, ", end="")
    print(f"{passing['wins']} of {passing['races']} races won, {passing['crashes']} crashes")
    for kind, place in races["files"].items():
        print(f"  {kind:8} {place}")


def what_came_of_it(stable_seconds: float | None, best_lap_seconds: float | None) -> str:
    """Return what a training came to, a line; the lap is the fastest of the best checkpoint's own evaluation.

    >>> what_came_of_it(21.5, 20.8)
    'It laps: stable after 21.5 s of training; best lap of the best checkpoint 20.80 s.'
    """
    lap = "" if best_lap_seconds is None else f"best lap of the best checkpoint {best_lap_seconds:.2f} s"
    if stable_seconds is not None:  # compared by reward, the best checkpoint need not be one that laps
        return f"It laps: stable after {stable_seconds:.1f} s of training; {lap or 'the best checkpoint does not lap'}."
    return f"It drives full laps, but it is not stable yet; {lap}." if lap else "It does not lap yet."


def _say_what_came_of_it(trained: TrainedRun, files: dict[str, Any]) -> None:
    summary, path = trained.summary(), word(trained.run.path)
    stable = summary["seconds_to_stable_laps"]
    print(f"\n{what_came_of_it(stable, summary['best_lap_seconds'])}")
    for kind, place in files.items():
        print(f"  {kind:8} {place}")
    print("\nWhat to try next:")
    if stable is None:
        more = ten_minutes_more(trained.run.read_metrics())
        print_next_steps(("go on", f"racecraft train --run {path} --resume --stop {more}"))
    print_next_steps(
        ("see every drive again, and each car's camera", f"racecraft watch {path}"),
        ("film three laps", f"racecraft evaluate {path} --laps 3 --video three-laps.mp4"),
        *next_trainings(trained.run.read_job()["asked"]),
    )


def next_trainings(request: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what to train next, purpose and command; whoever trained a folder has a reward of their own already.

    Args:
        request: What job.json says was asked for.

    >>> next_trainings({"folder": "my-car", "track": "Oval_track"})[0]
    ('change the reward and train it again', 'racecraft train my-car --track Oval_track')
    >>> next_trainings({"folder": "my-car", "track": "Oval_track", "tracks": ["Oval_track", "LGSWide"]})[0][1]
    'racecraft train my-car --tracks Oval_track,LGSWide'
    >>> next_trainings({"folder": "my-car", "against": ["self"]})[0][1]
    'racecraft train my-car --against self'
    """
    from racecraft.worlds.deepracer.training.plan import DEFAULT_TRACK

    folder, track = request.get("folder"), request.get("track", DEFAULT_TRACK)
    train = "racecraft train" if folder is None else f"racecraft train {word(folder)}"
    elsewhere = ("try another track", f"{train} --track {'Oval_track' if track != 'Oval_track' else DEFAULT_TRACK}")
    if folder is None:
        return [("write a reward function of your own", "racecraft new my-car"), elsewhere]
    again = train if track == DEFAULT_TRACK else f"{train} --track {word(track)}"
    if many := request.get("tracks"):
        again = f"{train} --tracks {word(','.join(many))}"
    again += "".join(f" --against {word(rival)}" for rival in request.get("against", ()))
    return [("change the reward and train it again", again), elsewhere]


train = train_command(action, _show)
