"""What the report of a car's run says first: the circuit, its best lap, what the car saw and was paid for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from racecraft.analysis.run_facts import RunFacts, WorldFacts
from racecraft.contract.errors import TrackError
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.logs.judged import judged_in_run
from racecraft.worlds.deepracer.files.sensor_names import SENSORS
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track

PAID = "paid for "
"""What a note of the run says before what a car without a reward function is paid for."""
SENSOR_TEXTS = {one.name: one.text for one in SENSORS}


def car_facts(facts: RunFacts) -> WorldFacts:
    """Return what a car's run adds to the first words of its report."""
    track, lap = track_of(facts.job), facts.best_row.get("best_lap_seconds")
    return WorldFacts(
        title=(track.title or track.name) if track else "",
        verb="drive",
        tiles=((f"{lap:.2f} s", "its best lap in evaluation") if lap else ("none yet", "best lap"),),
        asked=(*_car(facts.job.get("model_metadata", {})), *_reward_sentences(facts, reward_of(facts.run))),
        happened=tuple(_laps(facts)),
    )


def reward_of(run: RunFolder) -> str:
    """Return the text of the reward function, as far as it is text; "" where the run has none."""
    if not run.reward_function.is_file():
        return ""
    return run.reward_function.read_text(encoding="utf-8", errors="replace")


def track_of(job: Mapping[str, Any]) -> Track | None:
    """Return the circuit as it was driven, if it can be found and is the same."""
    entry = job.get("track") or {}
    for name in (entry.get("name"), (job.get("asked") or {}).get("track")):
        try:
            track = load_track(name) if name else None
        except TrackError:
            continue
        if track is not None and entry.get("hash") in (None, track.hash()):
            is_reversed = job.get("settings", {}).get("race", {}).get("reverse", False)
            return track.reversed() if is_reversed else track
    return None


def _car(metadata: Mapping[str, Any]) -> Iterator[str]:
    """Yield what the car saw and could do."""
    actions = metadata.get("action_space")
    if not actions:
        return
    eyes = " and ".join(SENSOR_TEXTS.get(name, name) for name in metadata.get("sensor", ())) or "its sensors"
    if isinstance(actions, Mapping):
        angle, speed = actions["steering_angle"], actions["speed"]
        yield (
            f"The car saw by {eyes} and chose any wheel angle from {_angle(angle['low'])} to {_angle(angle['high'])} "
            f"and any speed from {speed['low']:g} to {speed['high']:g} m/s."
        )
        return
    angles = sorted(float(one["steering_angle"]) for one in actions)
    speeds = sorted({float(one["speed"]) for one in actions})
    pace = f"{speeds[0]:g} m/s" if len(speeds) == 1 else f"{speeds[0]:g} to {speeds[-1]:g} m/s"
    yield (
        f"The car saw by {eyes} and chose among {len(actions)} actions, from {_angle(angles[0])} to "
        f"{_angle(angles[-1])}, at {pace}."
    )


def _angle(degrees: float) -> str:
    """Return a wheel angle of AWS's files (degrees, left positive) as people say it.

    >>> _angle(-30.0), _angle(12.5), _angle(0.0)
    ('30° right', '12.5° left', 'straight')
    """
    return "straight" if degrees == 0 else f"{abs(degrees):g}° {'left' if degrees > 0 else 'right'}"


def _reward_sentences(facts: RunFacts, reward: str) -> Iterator[str]:
    """Yield what it was paid for, where nobody wrote a reward function, else whose function paid."""
    notes: Sequence[str] = facts.job.get("notes", ())
    own = next((note.partition(PAID)[2] for note in notes if note.startswith("no ") and PAID in note), "")
    folder = facts.job.get("asked", {}).get("folder")
    if own:
        yield f"It was {PAID}{own}, as no reward function was given."
    elif reward:
        yield f"It was paid by the reward function {f'of {folder}' if folder else 'below'}."


def _laps(facts: RunFacts) -> Iterator[str]:
    """Yield its fastest lap, and whether it completes laps."""
    judged = judged_in_run(facts.metrics)
    if judged.best_lap_seconds:
        yield f"Its fastest lap took {judged.best_lap_seconds:.2f} s."
    yield "It completes laps." if judged.completes_laps else "It does not complete laps yet."
