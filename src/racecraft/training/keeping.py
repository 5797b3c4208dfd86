"""What a training leaves on the disk, iteration by iteration; every file arrives whole."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from racecraft.algorithms.ppo import PpoLearner
from racecraft.algorithms.weights import to_arrays
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.whole import write_whole
from racecraft.rollout.collector import Collector
from racecraft.training.aws_files import AwsFiles
from racecraft.training.events import IterationReport
from racecraft.training.recorder import EpisodeRecorder


class RunKeeper:
    """Keeps a training in its run folder: the disk's side of `TrainingLoop`.

    Args:
        run: The folder.
        learner, collector: What checkpoints are made of.
        card: What a stranger needs to rebuild the policy; goes into every checkpoint.
        recorder: The ticks of each iteration, where they are kept.
        aws: Writes AWS's files beside ours, where that is wanted; needs a recorder.
    """

    def __init__(
        self,
        run: RunFolder,
        learner: PpoLearner,
        collector: Collector,
        card: dict[str, Any],
        recorder: EpisodeRecorder | None = None,
        aws: AwsFiles | None = None,
    ) -> None:
        self._run, self._learner, self._collector = run, learner, collector
        self._card, self._recorder, self._aws = card, recorder, aws
        self._shelf = Checkpoints(run.checkpoints)

    def keep_start(self) -> None:
        """Keep the untrained policy, as checkpoint 0."""
        if self._aws is not None:
            self._aws.begin()
        self._shelf.save(0, 0, self._weights(), self._card)

    def keep(self, report: IterationReport, loop_state: Callable[[], dict[str, Any]]) -> None:
        """Keep an iteration. The checkpoint comes last: once it stands, everything it speaks of stands."""
        if self._recorder is not None:
            columns = self._recorder.take(report.iteration)
            write_episodes(self._run.episodes / f"{report.iteration}.parquet", columns)
            if self._aws is not None:
                self._aws.keep(columns, report)
        if report.verdict is not None:
            text = json.dumps({"iteration": report.iteration, **report.verdict.details}, indent=2)
            write_whole(self._run.evaluations / f"{report.iteration}.json", text + "\n")
        self._run.append_metrics(metrics_row(report))
        state = {
            "learner": to_arrays(self._learner.state_dict()),
            "collector": self._collector.state(),
            "loop": loop_state(),
        }
        if self._aws is not None:
            state["aws"] = self._aws.state()
        score = report.verdict.score if report.verdict else None
        self._shelf.save(
            report.iteration, report.steps, self._weights(), self._card, state, score=score, best=report.is_best
        )

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a checkpoint's state; one that was saved without AWS's files begins them here."""
        if self._aws is not None and "aws" in state:
            self._aws.restore(state["aws"])
        elif self._aws is not None:
            self._aws.begin()

    def close(self) -> None:
        """Write what is still held back."""
        if self._aws is not None:
            self._aws.close()

    def _weights(self) -> dict[str, Any]:
        weights: dict[str, Any] = to_arrays(self._learner.state_dict()["network"])
        return weights


def metrics_row(report: IterationReport) -> dict[str, Any]:
    """Return one line of metrics.jsonl; docs/metrics.md explains every name."""
    verdict = report.verdict
    return {
        "iteration": report.iteration,
        "steps": report.steps,
        "seconds": round(report.seconds, 4),
        "steps_per_second": round(report.steps_per_second, 1),
        "episodes": report.episodes,
        "training_score": report.training_score,
        "evaluation_score": verdict.score if verdict else None,
        "best_lap_seconds": verdict.best_lap_seconds if verdict else None,
        **report.losses,
        **{f"seconds_{phase}": round(spent, 4) for phase, spent in report.phase_seconds.items()},
    }
