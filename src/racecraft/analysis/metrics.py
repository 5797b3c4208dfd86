"""What every number in metrics.jsonl means, in one table; `docs/metrics.md` is written from it."""

from __future__ import annotations

METRICS: dict[str, str] = {
    "iteration": "Turn of the loop (collect, learn, judge, keep), counted from 1 over the whole life of the run.",
    "steps": "Environment steps since the run began: ticks of all worlds together.",
    "seconds": "Training time in s since the first tick, evaluations in, compilation out.",
    "steps_per_second": "Environment steps of this iteration over its wall-clock time, everything in, 1/s.",
    "episodes": "Training episodes that ended in this iteration.",
    "mean_reward": "Mean sum of rewards of those episodes; null where none ended.",
    "training_score": "Mean score of those episodes, driven with exploration: progress in % of a lap for cars (what "
    "the clock cut is left out), return (sum of rewards) for other worlds; null for snakes, and where none ended.",
    "evaluation_score": "Mean score of the greedy policy, one episode from each start: progress in % of a lap for "
    "cars, return for other worlds, rating in Elo points for snakes; null in an iteration without evaluation.",
    "best_lap_seconds": "Fastest full lap of this evaluation in simulated s; null without one.",
    "trained_tracks_lapped": "Of a training on several tracks or with held-out ones: share, 0 to 1, of those trained "
    "on whose every lap of this evaluation was full.",
    "trained_progress": "Mean progress on them in % of a lap, every track counted alike; the evaluation's score.",
    "trained_worst_progress": "The least mean progress of one of them, in % of a lap.",
    "held_out_tracks_lapped": "As trained_tracks_lapped, of the tracks that are never trained on.",
    "held_out_progress": "As trained_progress, of those; it counts neither for the score nor for the best checkpoint.",
    "held_out_worst_progress": "As trained_worst_progress, of those.",
    "trained/TRACK": "Mean progress on one track in this evaluation, % of a lap; a column each, `reversed`, `boxes` or "
    "`bots` behind the name where it is raced so.",
    "held_out/TRACK": "As trained/TRACK, of a track that is never trained on.",
    "policy_loss": "Mean clipped policy loss of the update's minibatches, no unit: about 0 before each update; its "
    "size says little, a sudden leap does.",
    "value_loss": "Mean error of the critic, before its weight: squared units of return (mse), or Huber's, as "
    "ppo.value_loss says.",
    "entropy": "Mean entropy of the policy in nat: ln(number of actions) when it acts at random, 0 when it is sure.",
    "approx_kl": "Estimated Kullback-Leibler divergence, never negative, in nat between the policy that gathered the "
    "data and the one being trained: how far an update moves; above about 0.05 updates are too bold.",
    "clip_fraction": "Share of transitions, 0 to 1, whose probability ratio left the clip range.",
    "grad_norm": "Mean norm of the gradient before it is cut to ppo.max_grad_norm; 0 where it is never cut.",
    "explained_variance": "Share of the returns' variance that the critic foresaw: 1 perfect, 0 no better than their "
    "mean, negative worse.",
    "mean_advantage": "Mean advantage before it is standardised, in units of return: how much better than the critic "
    "foresaw it went.",
    "transitions": "Steps that the update learned from; prepare ticks and inactive agents are left out.",
    "minibatches": "Gradient steps in the update.",
    "seconds_collect": "Part of the iteration's time spent stepping worlds and choosing actions, s.",
    "seconds_learn": "Part spent on the update, s.",
    "seconds_judge": "Part spent on the evaluation, s.",
    "seconds_keep_before": "Time by which keeping the iteration before held training up, s; it belongs to this clock.",
}
"""Name in metrics.jsonl → one sentence with meaning and unit."""


def metrics_markdown() -> str:
    """Return the table for the documentation."""
    rows = [f"| `{name}` | {meaning} |" for name, meaning in METRICS.items()]
    return "\n".join(["| name | meaning |", "|---|---|", *rows]) + "\n"
