"""What the figures of a training's updates suggest, whatever it learned: sentences with a figure and a command each.

Begin with `learning_advice`. Each rule looks at one thing and stays silent where it has too little to go by.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from racecraft.analysis import figures
from racecraft.analysis.advice import Advice
from racecraft.analysis.figures import Curve, MetricRows, Panel
from racecraft.analysis.learner import Learner
from racecraft.analysis.plot import Plot
from racecraft.contract.world import Array
from racecraft.pages.colours import GREEN

FEWEST = 10
"""Iterations below which nothing is said."""
GONE, SOON = 0.25, 0.5
"""Entropy below this share of its start is gone; before this share of the training it is too soon."""
SOLVED = 0.9
"""Share of the best score there can be from which an early end of exploration is no loss."""
FORGOTTEN, WORTH_TELLING = 0.2, 0.1
"""Share of the best score that is lost before it is called forgotten; and of the best there can be."""
ROSE = 0.1
"""A reward that grew by more than this share of itself while what was learned got lost is told beside it."""
BLIND, FAR = 0.2, 0.05
"""Explained variance below which a critic is blind; change of the policy, in nats, above which a step is far."""


def learning_advice(metrics: MetricRows, learner: Learner, top_score: float | None = None) -> list[Advice]:
    """Return what a training's metrics suggest, the weightiest first.

    Args:
        metrics: Lines of metrics.jsonl.
        learner: Which algorithm learned, and how it was set.
        top_score: The best score there can be, such as 100 per cent of a lap; None: unknown.
    """
    if len(metrics) < FEWEST:
        return []
    return [
        *_entropy(metrics, learner, top_score),
        *_forgetting(metrics, learner, top_score),
        *_steps(metrics, learner),
        *_critic(metrics, learner, top_score),
    ]


def _entropy(metrics: MetricRows, learner: Learner, top_score: float | None) -> Iterator[Advice]:
    entropy, score = column(metrics, "entropy"), column(metrics, "evaluation_score")
    there = np.isfinite(entropy)
    more = learner.more_exploration()
    if not more or there.sum() < FEWEST or np.nanmin(entropy) < 0.0:
        return  # it does not weigh the entropy, or it decides numbers, whose entropy has no nought to come to
    start = float(np.nanmean(entropy[there][:3]))
    gone = np.flatnonzero(there & (entropy < GONE * start))
    if not len(gone) or gone[0] > SOON * len(metrics):
        return
    best = np.nanmax(score) if np.isfinite(score).any() else np.nan
    if _is_solved(metrics, top_score):
        return
    yield Advice(
        f"The entropy fell from {start:.2f} to {entropy[gone[0]]:.2f} nat by iteration "
        f"{metrics[gone[0]]['iteration']} of {metrics[-1]['iteration']}, and the best score is {best:.4g}: it stopped "
        "trying other actions early.",
        "Exploration ended too soon: ask for more entropy, or a smaller learning rate, and begin anew.",
        _panel(metrics, Panel("entropy of the policy (nat)", (Curve("entropy", "entropy", GREEN),), 0.0)),
        f"racecraft train{more}",
    )


def rose(then: float, now: float) -> bool:
    """Tell whether a reward grew by so much that it is worth a word.

    >>> rose(100.0, 109.0), rose(100.0, 120.0), rose(-50.0, -40.0)
    (False, True, True)
    """
    return now - then > ROSE * abs(then)


def _forgetting(metrics: MetricRows, learner: Learner, top_score: float | None) -> Iterator[Advice]:
    score = column(metrics, "evaluation_score")
    evaluated = np.flatnonzero(np.isfinite(score))
    if len(evaluated) < 4:
        return
    best, last = evaluated[np.argmax(score[evaluated])], float(np.mean(score[evaluated][-2:]))
    lost = score[best] - last
    if top_score is not None and lost < WORTH_TELLING * top_score:
        return  # a car that never got far has little to forget
    if score[best] > 0 and lost > FORGOTTEN * score[best]:
        paid = column(metrics, "mean_reward")
        then, now = float(paid[best]), float(np.mean(paid[evaluated[-2:]]))
        pays_otherwise = top_score is not None and rose(then, now)
        command = f"racecraft train --from RUN:best{learner.smaller_steps()}"
        yield Advice(
            f"Iteration {metrics[best]['iteration']} scored {score[best]:.4g}, the last two evaluations {last:.4g} on "
            f"average{f', while its mean reward rose from {then:.4g} to {now:.4g}' if pays_otherwise else ''}.",
            "It forgot what it could do and was paid more for it: see whether the reward pays for something else than "
            "getting round and change it, then go on from the best checkpoint."
            if pays_otherwise
            else "It forgot what it could do: go on from the best checkpoint, with a smaller learning rate.",
            _panel(metrics, Panel("score", figures.LEARNING.curves)),
            command.replace("train", "train my-car", 1) if pays_otherwise else command,
        )


def _steps(metrics: MetricRows, learner: Learner) -> Iterator[Advice]:
    change = _last_third(metrics, "approx_kl")
    if len(change) >= 3 and float(np.median(change)) > FAR:
        yield Advice(
            f"An update changes the policy by {np.median(change):.3f} nat in the median of the last third; "
            f"up to {FAR:g} is usual.",
            "Updates go too far: take a smaller learning rate or fewer epochs.",
            _panel(metrics, Panel("change of the policy (KL, nat)", (Curve("approx_kl", "KL", GREEN),), 0.0)),
            f"racecraft train{learner.smaller_steps()}",
        )


def _critic(metrics: MetricRows, learner: Learner, top_score: float | None) -> Iterator[Advice]:
    explained = _last_third(metrics, "explained_variance")
    if _is_solved(metrics, top_score):
        return  # episodes that all go well hardly vary, and what does not vary cannot be explained
    if len(explained) >= 3 and float(np.mean(explained)) < BLIND:
        yield Advice(
            f"The critic explains {100 * np.mean(explained):.0f} % of how returns vary in the last third.",
            "The critic learns nothing: the reward jumps or is too large. Keep it between 0 and about 5 a step, and "
            "give an update more steps.",
            _panel(metrics, Panel("explained variance", (Curve("explained_variance", "explained", GREEN),))),
            f"racecraft train{learner.more_experience()}",
        )


def _is_solved(metrics: MetricRows, top_score: float | None) -> bool:
    """Tell whether a score came near the best there can be."""
    score = column(metrics, "evaluation_score")
    return top_score is not None and bool((score[np.isfinite(score)] >= SOLVED * top_score).any())


def column(metrics: MetricRows, name: str) -> Array:
    """Return a column of the metrics, (I,), NaN where it is not told."""
    return np.array([np.nan if row.get(name) is None else row[name] for row in metrics], float)


def _last_third(metrics: MetricRows, name: str) -> Array:
    values = column(metrics, name)
    late = values[-max(3, len(values) // 3) :]
    return late[np.isfinite(late)]


def _panel(metrics: MetricRows, panel: Panel) -> Any:
    """Return a maker of the plot of one panel over training time."""
    import polars as pl

    def make() -> Plot:
        names = [curve.column for curve in panel.curves]
        rows = [{"iteration": row["iteration"], **{name: row.get(name) for name in names}} for row in metrics]
        data = pl.DataFrame(rows, infer_schema_length=None)
        return Plot(names[0], panel.title, data, lambda: figures.panel_figure(metrics, panel, 6.0, 3.0))

    return make
