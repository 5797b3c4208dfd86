"""What a training leaves on the disk, iteration by iteration; every file arrives whole.

A state of large networks is a hundred megabytes, and a disk takes seconds for it. So an iteration is copied in memory,
and a thread writes the copy while the next one is collected: never two at once, in the order of the iterations, the
checkpoint last. A training that is killed meanwhile goes on from the last one that stands. `close` waits.

Where the next one is collected by workers, who have use for every core of theirs, it is written when they have done so
and the learner learns; but no later than `HELD_SECONDS` from now.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

from racecraft.algorithms.learner import Learner
from racecraft.algorithms.weights import take_policy, to_arrays
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.rollout.collector import CollectorProtocol
from racecraft.training.background import Background, Gate
from racecraft.training.callbacks import IterationReport

HELD_SECONDS = 1.0
"""Where collecting takes longer than so, what writing takes of it is not worth speaking of."""

Columns = dict[str, Array]
"""Ticks, as `formats/episodes.py` holds them."""


@runtime_checkable
class Stateful(Protocol):
    """A part of a training that has a state of its own, kept in every checkpoint."""

    def state(self) -> Any:
        """Return it: arrays, plain values, dictionaries and lists of them (copies)."""
        ...

    def restore(self, state: Any) -> None:
        """Go on from what `state` gave."""
        ...


class TickRecorder(Protocol):
    """Keeps the ticks of an iteration."""

    def pop(self, iteration: int) -> Columns:
        """Return the ticks kept since the last call."""
        ...


class EpisodeFiles(Stateful, Protocol):
    """Writes the ticks in some other program's form beside ours."""

    def pass_through(self, gate: Gate) -> None:
        """Write what is written beside the training when a gate opens."""
        ...

    def begin(self) -> None:
        """Write what is said once."""
        ...

    def keep(self, columns: Columns, report: IterationReport) -> None:
        """Take in an iteration."""
        ...

    def keep_evaluation(self, report: IterationReport) -> None:
        """Take in an evaluation of an iteration that was taken in without one."""
        ...

    def close(self) -> None:
        """Wait until all of it is on the disk."""
        ...


class RunWriter:
    """Writes a training into its run folder: the disk's side of `TrainingLoop`.

    Args:
        run: The folder.
        learner, collector: What checkpoints are made of.
        metadata: What a stranger needs to use the policy; goes into every checkpoint.
        recorder: The ticks of each iteration, where they are kept.
        episode_files: Writes them in another form, too; needs a recorder.
        parts: Further parts of the training whose state is kept, by name.
        checkpoints: Where they are put, and which of them stay; None: on the run's own shelf, all of them.
        by_workers: Whether worlds are carried by workers of their own.
    """

    def __init__(
        self,
        run: RunFolder,
        learner: Learner,
        collector: CollectorProtocol,
        metadata: Mapping[str, Any],
        recorder: TickRecorder | None = None,
        episode_files: EpisodeFiles | None = None,
        parts: Mapping[str, Stateful] | None = None,
        checkpoints: Checkpoints | None = None,
        by_workers: bool = False,
    ) -> None:
        self._run, self._learner, self._collector = run, learner, collector
        self._metadata, self._recorder, self._episode_files = metadata, recorder, episode_files
        self._parts = dict(parts or {})
        self._checkpoints = checkpoints or Checkpoints(run.checkpoints)
        self._background = Background()
        self._gate = Gate(HELD_SECONDS) if by_workers else None
        if self._gate is not None:
            self._background.gate = self._gate
            if episode_files is not None:
                episode_files.pass_through(self._gate)

    def write_start(self) -> None:
        """Write the untrained policy, as checkpoint 0."""
        if self._episode_files is not None:
            self._episode_files.begin()
        self._checkpoints.save(0, 0, to_arrays(self._learner.state_dict())["network"], self._metadata)

    def write(self, report: IterationReport, loop_state: Callable[[], dict[str, Any]]) -> None:
        """Copy an iteration; it is on the disk by the time the next one is written, or at the latest after `close`.

        Raises:
            OutputFileError: The iteration before could not be written.
        """
        self._background.call_done(wait=True)
        if self._gate is not None:
            self._gate.close()
        columns = self._recorder.pop(report.iteration) if self._recorder is not None else None
        if self._episode_files is not None and columns is not None:
            self._episode_files.keep(columns, report)
        learner = to_arrays(self._learner.state_dict())
        weights = take_policy(learner)
        state = {"learner": learner, "collector": self._collector.state(), "loop": loop_state()}
        if self._episode_files is not None:
            state["aws"] = self._episode_files.state()
        if self._parts:
            state["parts"] = self._state_of_parts()
        self._background.give(lambda: self._write(report, columns, weights, state), lambda: None)

    def collected(self) -> None:
        """Hear that the next iteration is collected."""
        if self._gate is not None:
            self._gate.open()

    def write_evaluation(self, report: IterationReport, loop_state: Callable[[], dict[str, Any]]) -> None:
        """Write an evaluation of the iteration that was written last, which then had none.

        Raises:
            OutputFileError: Something could not be written.
        """
        self._background.call_done(wait=True)
        self._write_result(report)
        self._run.cut_metrics(report.iteration - 1)
        self._run.append_metrics(metrics_row(report))
        parts = {"loop": loop_state()}
        if self._episode_files is not None:
            self._episode_files.keep_evaluation(report)
            parts["aws"] = self._episode_files.state()
        if self._parts:
            parts["parts"] = self._state_of_parts()
        score = report.result.score if report.result else None
        self._checkpoints.mark(report.iteration, score, best=report.is_best, state=parts)

    def stop_requested(self) -> bool:
        """Tell whether somebody outside has asked the training to stop."""
        return self._run.stop_requested()

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a checkpoint's state; one that was saved without a part begins that part here."""
        if self._episode_files is not None and "aws" in state:
            self._episode_files.restore(state["aws"])
        elif self._episode_files is not None:
            self._episode_files.begin()
        for name, part in self._parts.items():
            if name in state.get("parts", {}):
                part.restore(state["parts"][name])

    def close(self) -> None:
        """Wait until everything is on the disk. Doing so twice is doing so once.

        Raises:
            OutputFileError: Something could not be written; what stood before still stands.
        """
        try:
            self._background.close()
        finally:
            if self._episode_files is not None:
                self._episode_files.close()

    def _state_of_parts(self) -> dict[str, Any]:
        return {name: part.state() for name, part in self._parts.items()}

    def _write(
        self, report: IterationReport, columns: Columns | None, weights: dict[str, Any], state: dict[str, Any]
    ) -> None:
        """Write an iteration. The checkpoint comes last: once it stands, everything it speaks of stands."""
        if columns is not None:
            write_episodes(self._run.episodes / f"{report.iteration}.parquet", columns)
        self._write_result(report)
        self._run.append_metrics(metrics_row(report))
        score = report.result.score if report.result else None
        self._checkpoints.save(
            report.iteration, report.steps, weights, self._metadata, state, score=score, best=report.is_best
        )

    def _write_result(self, report: IterationReport) -> None:
        if report.result is not None:
            text = json.dumps({"iteration": report.iteration, **report.result.details}, indent=2)
            write_atomic(self._run.evaluations / f"{report.iteration}.json", text + "\n")
            report.result.write_files(self._run, report.iteration)


def metrics_row(report: IterationReport) -> dict[str, Any]:
    """Return one line of metrics.jsonl; docs/reference/metrics.md explains every name."""
    result = report.result
    return {
        "iteration": report.iteration,
        "steps": report.steps,
        "seconds": round(report.seconds, 4),
        "steps_per_second": round(report.steps_per_second, 1),
        "episodes": report.episodes,
        "mean_reward": report.mean_reward,
        "training_score": report.training_score,
        "evaluation_score": result.score if result else None,
        **(result.figures if result else {}),
        **report.losses,
        **{f"seconds_{phase}": round(spent, 4) for phase, spent in report.phase_seconds.items()},
    }
