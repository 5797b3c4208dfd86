"""What a training leaves on the disk, iteration by iteration; every file arrives whole.

A state of large networks is a hundred megabytes, and a disk takes seconds for it. So an iteration is copied in memory,
and a thread writes the copy while the next one is driven: never two at once, in the order of the iterations, the
checkpoint last. A training that is killed meanwhile goes on from the last one that stands. `close` waits.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from racecraft.algorithms.multi_policy import Learner
from racecraft.algorithms.weights import to_arrays
from racecraft.contract.world import Array
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.whole import write_whole
from racecraft.rollout.collector import Collector
from racecraft.training.background import Background
from racecraft.training.callbacks import IterationReport
from racecraft.training.deepracer.aws.files import AwsFiles
from racecraft.training.deepracer.recorder import EpisodeRecorder

Columns = dict[str, Array]
"""Ticks, as `formats/episodes.py` holds them."""


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
        learner: Learner,
        collector: Collector,
        card: dict[str, Any],
        recorder: EpisodeRecorder | None = None,
        aws: AwsFiles | None = None,
    ) -> None:
        self._run, self._learner, self._collector = run, learner, collector
        self._card, self._recorder, self._aws = card, recorder, aws
        self._shelf = Checkpoints(run.checkpoints)
        self._background = Background()

    def keep_start(self) -> None:
        """Keep the untrained policy, as checkpoint 0."""
        if self._aws is not None:
            self._aws.begin()
        self._shelf.save(0, 0, to_arrays(self._learner.state_dict())["network"], self._card)

    def keep(self, report: IterationReport, loop_state: Callable[[], dict[str, Any]]) -> None:
        """Copy an iteration; it is on the disk by the time the next one is kept, or at the latest after `close`.

        Raises:
            OutputFileError: The iteration before could not be written.
        """
        self._background.settle(wait=True)
        columns = self._recorder.take(report.iteration) if self._recorder is not None else None
        if self._aws is not None and columns is not None:
            self._aws.keep(columns, report)
        learner = to_arrays(self._learner.state_dict())
        weights = learner.pop("network")
        state = {"learner": learner, "collector": self._collector.state(), "loop": loop_state()}
        if self._aws is not None:
            state["aws"] = self._aws.state()
        self._background.give(lambda: self._write(report, columns, weights, state), lambda: None)

    def _write(
        self, report: IterationReport, columns: Columns | None, weights: dict[str, Any], state: dict[str, Any]
    ) -> None:
        """Write an iteration. The checkpoint comes last: once it stands, everything it speaks of stands."""
        if columns is not None:
            write_episodes(self._run.episodes / f"{report.iteration}.parquet", columns)
        if report.verdict is not None:
            text = json.dumps({"iteration": report.iteration, **report.verdict.details}, indent=2)
            write_whole(self._run.evaluations / f"{report.iteration}.json", text + "\n")
        self._run.append_metrics(metrics_row(report))
        score = report.verdict.score if report.verdict else None
        self._shelf.save(report.iteration, report.steps, weights, self._card, state, score=score, best=report.is_best)

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a checkpoint's state; one that was saved without AWS's files begins them here."""
        if self._aws is not None and "aws" in state:
            self._aws.restore(state["aws"])
        elif self._aws is not None:
            self._aws.begin()

    def close(self) -> None:
        """Wait until everything is on the disk. Doing so twice is doing so once.

        Raises:
            OutputFileError: Something could not be written; what stood before still stands.
        """
        try:
            self._background.close()
        finally:
            if self._aws is not None:
                self._aws.close()


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
