"""Figures of a running training for Prometheus, to be served (`serving/metrics_server.py`).

Names are those that DeepRacer for Cloud sends to Telegraf, measurement and field joined as Telegraf's own Prometheus
output joins them, so that boards made for it keep their names (facts: deepracer-systems.md A3). It sends every episode
by itself, tagged with phase and status; here the episodes of an iteration, or of an evaluation, that ended alike are
one figure, their mean. What it has no name for is called `racecraft_…`.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from racecraft.contract.kinds import find_kind
from racecraft.formats.run_folder import RunFolder
from racecraft.training.callbacks import EndedAlike, IterationReport

BY_STATUS = {
    "dr_training_episodes_reward": "Mean sum of rewards of the episodes that ended alike in the latest iteration.",
    "dr_training_episodes_progress": "Mean score of those episodes: of cars per cent of a lap.",
    "dr_training_episodes_elapsed_time": "Mean simulated time of those episodes, ms.",
    "racecraft_episodes_ended_total": "Episodes that ended so since this process began.",
}
"""Names that carry the labels phase and status besides; `evaluation` tells of the latest evaluation."""
PHASES = ("training", "evaluation")
HELP = {
    **BY_STATUS,
    "racecraft_training_reward": "Mean sum of rewards of all episodes that ended in the iteration.",
    "racecraft_training_score": "Mean score of the episodes that ended in the iteration: of cars per cent of a lap, "
    "without drives that the clock cut.",
    "dr_eval_episodes_progress": "Score of the latest evaluation: of cars per cent of a lap.",
    "dr_eval_episodes_elapsed_time": "Best lap of the latest evaluation, ms.",
    "dr_sagemaker_epochs_entropy": "Entropy of the policy, nat.",
    "racecraft_iteration": "Iterations since the run's birth.",
    "racecraft_steps_total": "Environment steps since the run's birth.",
    "racecraft_episodes_total": "Training episodes that ended since this process began.",
    "racecraft_steps_per_second": "Environment steps a second in the iteration, everything in.",
    "racecraft_training_seconds_total": "Seconds since the first training tick.",
    "racecraft_best_iteration": "Iteration of the best evaluation so far.",
    "racecraft_training_running": "1 while it trains, 0 when it is over.",
}
"""Every name, and what it is; the learner's other figures come as racecraft_learner{figure=…}."""
LEARNER = "racecraft_learner"


class LiveMetrics(Collector):
    """A training callback that keeps the latest figures.

    Args:
        model: What the label `model` says.
    """

    def __init__(self, model: str) -> None:
        self._labels = {"model": model, "worker": "0"}
        self._status_labels: Mapping[str, str] = {}
        self._values: dict[str, float] = {"racecraft_training_running": 0.0}
        self._learner: Mapping[str, float] = {}
        self._alike: dict[str, Mapping[str, EndedAlike]] = {phase: {} for phase in PHASES}
        self._ended: Counter[tuple[str, str]] = Counter()
        self._lock = threading.Lock()
        self.registry = CollectorRegistry()
        """Where Prometheus's client reads the figures."""
        self.registry.register(self)

    def run_made(self, path: Path) -> None:
        """Take what the run's world calls the ways in which episodes end."""
        self._status_labels = find_kind(RunFolder(path).read_job()["kind"]).piece("status_labels") or {}

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Say that it trains."""
        self._put({"racecraft_training_running": 1.0})

    def iteration(self, report: IterationReport) -> None:
        """Take the figures of an iteration; the last one may come again, with its evaluation."""
        is_new = report.iteration != self._values.get("racecraft_iteration")
        values: dict[str, float | None] = {
            "racecraft_training_reward": report.mean_reward,
            "racecraft_training_score": report.training_score,
            "dr_sagemaker_epochs_entropy": report.losses.get("entropy"),
            "racecraft_iteration": report.iteration,
            "racecraft_steps_total": report.steps,
            "racecraft_steps_per_second": report.steps_per_second,
            "racecraft_training_seconds_total": report.seconds,
            "racecraft_episodes_total": self._values.get("racecraft_episodes_total", 0.0) + is_new * report.episodes,
        }
        if report.result is not None:
            lap = report.result.figures.get("best_lap_seconds")
            values["dr_eval_episodes_progress"] = report.result.score
            values["dr_eval_episodes_elapsed_time"] = None if lap is None else 1000.0 * lap
        if report.is_best:
            values["racecraft_best_iteration"] = report.iteration
        self._put({name: float(value) for name, value in values.items() if value is not None}, report.losses)
        if is_new:
            self._put_episodes("training", report.by_status)
        if report.result is not None:
            self._put_episodes("evaluation", report.result.by_status)

    def end(self, reason: str) -> None:
        """Say that it is over."""
        self._put({"racecraft_training_running": 0.0})

    def collect(self) -> Iterator[Metric]:
        """Yield every figure that is known, under its name."""
        with self._lock:
            values, learner, samples = dict(self._values), dict(self._learner), self._samples()
        samples |= {name: [({}, values[name])] for name in HELP if name in values}
        for name in HELP:
            if samples.get(name):
                yield self._family(name, HELP[name], samples[name])
        if learner:
            figures = [({"figure": name}, float(value)) for name, value in learner.items()]
            yield self._family(LEARNER, "A figure of the learner's latest update.", figures)

    def _family(self, name: str, text: str, samples: list[tuple[dict[str, str], float]]) -> Metric:
        labels = [*self._labels, *samples[0][0]]
        kind = CounterMetricFamily if name.endswith("_total") else GaugeMetricFamily
        family = kind(name, text, labels=labels)
        for more, value in samples:
            family.add_metric([*self._labels.values(), *more.values()], value)
        return family

    def _samples(self) -> dict[str, list[tuple[dict[str, str], float]]]:
        """Return what is told by phase and status: the labels and the value, by name."""
        samples: dict[str, list[tuple[dict[str, str], float]]] = {name: [] for name in BY_STATUS}
        for phase, alike in self._alike.items():
            for status, one in alike.items():
                seconds = one.mean_seconds
                figures = (one.mean_reward, one.mean_score, None if seconds is None else 1000.0 * seconds)
                for name, value in zip(BY_STATUS, figures, strict=False):
                    if value is not None:
                        samples[name].append((self._tags(phase, status), float(value)))
        for (phase, status), count in self._ended.items():
            samples["racecraft_episodes_ended_total"].append((self._tags(phase, status), float(count)))
        return samples

    def _tags(self, phase: str, status: str) -> dict[str, str]:
        return {"phase": phase, "status": self._status_labels.get(status, status)}

    def _put_episodes(self, phase: str, alike: Mapping[str, EndedAlike]) -> None:
        with self._lock:
            self._alike[phase] = alike
            self._ended.update({(phase, status): one.episodes for status, one in alike.items()})

    def _put(self, values: Mapping[str, float], learner: Mapping[str, float] | None = None) -> None:
        with self._lock:
            self._values.update(values)
            self._learner = self._learner if learner is None else learner
