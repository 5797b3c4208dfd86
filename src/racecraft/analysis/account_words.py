"""What was asked of a training and what came of it, in plain words. Begin with `asked_words` and `happened_words`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from racecraft.analysis import page
from racecraft.analysis.run_facts import RunFacts
from racecraft.worlds.deepracer.analysis.logs.judged import judged_in_run

PAID = "paid for "
"""What a note of the run says before what a car without a reward function is paid for."""
EYES = {
    "FRONT_FACING_CAMERA": "its front camera", "observation": "its front camera", "STEREO_CAMERAS": "two cameras",
    "LEFT_CAMERA": "its left camera", "LIDAR": "a LiDAR", "SECTOR_LIDAR": "a LiDAR in sectors",
    "DISCRETIZED_SECTOR_LIDAR": "a LiDAR in sectors",
}  # fmt: skip
UNTIL = {
    "laps": "it laps", "minutes": "{} min are over", "iterations": "{} iterations are done",
    "steps": "{} steps are done", "score": "it scores {}", "rating": "it is rated {}",
}  # fmt: skip
"""What ends a training, by the word of --stop."""


def asked_words(facts: RunFacts) -> str:
    """Return sentences that say what was asked: of whom, until when, of what car, paid by what, beginning where."""
    asked = facts.job.get("asked", {})
    who = str(facts.job.get("algorithm", "a learner")).upper()
    what = f"to drive {facts.title}" if facts.is_race else f"to play {facts.title}"
    told = [f"{who} was asked {what}{_until(asked.get('stops') or asked.get('stop') or ())}."]
    if facts.is_race:
        told += _car(facts.job.get("model_metadata", {}))
        told += _paid(facts)
    if asked.get("from"):
        told.append(f"It began with the weights of {asked['from']}.")
    if asked.get("set"):
        told.append(f"Set by hand: {', '.join(map(str, asked['set']))}.")
    told += _resumed(facts.job.get("resumed", ()))
    return " ".join(told)


def _resumed(times: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield how the training was resumed, if it was.

    >>> list(_resumed([{"after_iteration": 3, "stops": []}, {"after_iteration": 9, "stops": ["minutes=15"]}]))
    ['It was resumed 2 times, the last time after iteration 9, until 15 min are over.']
    """
    if times:
        how_often = f"{len(times)} times, the last time" if len(times) > 1 else "once,"
        until = _until(times[-1].get("stops", ()))
        yield f"It was resumed {how_often} after iteration {times[-1]['after_iteration']}{until and ','}{until}."


def _until(stops: str | Sequence[str]) -> str:
    """Return what ends the training.

    >>> _until(["laps", "minutes=7"]), _until(())
    (' until it laps or 7 min are over', '')
    """
    told = []
    for stop in [stops] if isinstance(stops, str) else stops:
        kind, _, amount = str(stop).partition("=")
        told.append(UNTIL[kind].format(amount) if kind in UNTIL else str(stop))
    return f" until {' or '.join(told)}" if told else ""


def _car(metadata: Mapping[str, Any]) -> Iterator[str]:
    """Yield what the car saw and could do."""
    actions = metadata.get("action_space")
    if not actions:
        return
    eyes = " and ".join(EYES.get(name, name) for name in metadata.get("sensor", ())) or "its sensors"
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


def _paid(facts: RunFacts) -> Iterator[str]:
    """Yield what it was paid for, where nobody wrote a reward function, else whose function paid."""
    notes: Sequence[str] = facts.job.get("notes", ())
    own = next((note.partition(PAID)[2] for note in notes if note.startswith("no ") and PAID in note), "")
    folder = facts.job.get("asked", {}).get("folder")
    if own:
        yield f"It was {PAID}{own}, as no reward function was given."
    elif facts.reward:
        yield f"It was paid by the reward function {f'of {folder}' if folder else 'below'}."


def happened_words(facts: RunFacts) -> str:
    """Return sentences that say what came of it: the first score, the best, the last, and whether it gets round."""
    last = facts.metrics[-1]
    told = f"It trained for {page.duration(last['seconds'])} and {last['steps']:,} steps."
    scored = [row for row in facts.metrics if row.get("evaluation_score") is not None]
    if not scored:
        return f"{told} It was not judged yet."
    best = max(scored, key=lambda row: row["evaluation_score"])
    first, top, now = (_score(facts, row["evaluation_score"]) for row in (scored[0], best, scored[-1]))
    if first == top == now:
        told += f" Judged without exploration it came to {now}, from the first time to the last."
    elif best is scored[0] and len(scored) > 1:
        told += (
            f" Judged without exploration it came to {top} in iteration {best['iteration']}, its first judgement and "
        )
        told += f"its best; the last was {now}."
    else:
        told += f" Judged without exploration it went from {first} to {top} in iteration {best['iteration']}"
        told += "." if now == top else f"; the last judgement was {now}."
    if not facts.is_race:
        return told
    judged = judged_in_run(facts.metrics)
    if judged.best_lap_seconds:
        told += f" Its fastest lap took {judged.best_lap_seconds:.2f} s."
    return f"{told} {'It gets round.' if judged.gets_round else 'It does not get round yet.'}"


def _score(facts: RunFacts, score: float) -> str:
    return f"{score:.3g} % of a lap" if facts.is_race else f"{score:.4g}"
