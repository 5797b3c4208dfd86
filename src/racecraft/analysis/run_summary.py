"""What was asked of a training and what came of it, in plain words. Begin with `request_text` and `happened_words`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from racecraft.analysis.run_facts import RunFacts
from racecraft.pages.filters import duration

UNTIL = {
    "laps": "it laps", "minutes": "{} min are over", "iterations": "{} iterations are done",
    "steps": "{} steps are done", "score": "it scores {}", "rating": "it is rated {}",
    "episodes": "{} episodes are done", "reward": "its mean reward exceeds {}", "lap": "it laps within {} s",
    "gap": "its lap comes within {} % of the best known one",
}  # fmt: skip
"""What ends a training, by the word of --stop."""


def request_text(facts: RunFacts) -> str:
    """Return sentences that say what was asked: of whom, until when, of what car, paid by what, beginning where."""
    request = facts.job.get("asked", {})
    who = str(facts.job.get("algorithm", "a learner")).upper()
    until = _until(request.get("stops") or request.get("stop") or ())
    sentences = [f"{who} was asked to {facts.world.verb} {facts.title}{until}.", *facts.world.asked]
    if request.get("from"):
        sentences.append(f"It began with the weights of {request['from']}.")
    if request.get("set"):
        sentences.append(f"Set by hand: {', '.join(map(str, request['set']))}.")
    sentences += _resumed(facts.job.get("resumed", ()))
    return " ".join(sentences)


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

    >>> _until(["laps", "minutes=7"]), _until(["gap=3"]), _until(())
    (' until it laps or 7 min are over', ' until its lap comes within 3 % of the best known one', '')
    """
    conditions = []
    for stop in [stops] if isinstance(stops, str) else stops:
        kind, _, amount = str(stop).partition("=")
        conditions.append(UNTIL[kind].format(amount) if kind in UNTIL else str(stop))
    return f" until {' or '.join(conditions)}" if conditions else ""


def happened_words(facts: RunFacts) -> str:
    """Return sentences that say what came of it: the first score, the best, the last, and whether it completes laps."""
    last = facts.metrics[-1]
    text = f"It trained for {duration(last['seconds'])} and {last['steps']:,} steps."
    scored = [row for row in facts.metrics if row.get("evaluation_score") is not None]
    if not scored:
        return f"{text} It was not judged yet."
    best = max(scored, key=lambda row: row["evaluation_score"])
    first, top, now = (_score(facts, row["evaluation_score"]) for row in (scored[0], best, scored[-1]))
    if first == top == now:
        always = ", from the first time to the last" if len(scored) > 1 else ""
        text += f" Judged without exploration it came to {now}{always}."
    elif best is scored[0] and len(scored) > 1:
        text += (
            f" Judged without exploration it came to {top} in iteration {best['iteration']}, its first judgement and "
        )
        text += f"its best; the last was {now}."
    else:
        text += f" Judged without exploration it went from {first} to {top} in iteration {best['iteration']}"
        text += "." if now == top else f"; the last judgement was {now}."
    return " ".join([text, *facts.world.happened])


def _score(facts: RunFacts, score: float) -> str:
    return facts.kind.score.sentence.format(score)
