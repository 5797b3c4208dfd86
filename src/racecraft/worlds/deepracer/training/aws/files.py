"""What a training leaves for AWS's own tools, in the layout of DeepRacer for Cloud. Begin with `AwsFiles`.

AWS counts in iterations of E finished episodes (`num_episodes_between_training`, else 20), driven by one worker. Our
cars drive side by side and our iterations end in the middle of episodes, so the episodes are put in the order in which
they ended, numbered from 0 without gaps, and laid end to end on a virtual clock of 15 ticks a second. An evaluation
takes its own time on that clock, and its rows stand between the training rows where it took place, repeating episode
and trial of the row before; their reward is 0, for no reward function is asked there, unless checkpoints are compared
by it.

Traces are written when their iteration is full, `TrainingMetrics.json` at most once an iteration of ours, all of it by
a thread in the background. What is not on the disk yet is part of `state`, so that a training that was killed goes on
with files just like those of one that was not.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from racecraft.contract.world import Array
from racecraft.formats.atomic import append_atomic, make_folder, write_atomic
from racecraft.training.background import Background, Gate
from racecraft.training.callbacks import EvaluationResult, IterationReport
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.files.hyperparameters import write_hyperparameters
from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder, CheckpointMark, checkpoint_marks_text
from racecraft.worlds.deepracer.files.model_metadata import write_model_metadata
from racecraft.worlds.deepracer.files.sim_trace import sim_trace_text
from racecraft.worlds.deepracer.files.simulation_log import checkpoint_line, log_head, update_line
from racecraft.worlds.deepracer.files.training_metrics import (
    STATUS_LABELS,
    TrainingRow,
    read_metrics_file,
    row_text,
    training_metrics_text,
    training_row,
)
from racecraft.worlds.deepracer.files.training_params import write_params
from racecraft.worlds.deepracer.training.aws.block import Block
from racecraft.worlds.deepracer.training.aws.episodes import STATUSES, EpisodeCutter
from racecraft.worlds.deepracer.training.aws.setup import AwsSetup

NEW_ROWS_SHARE = 50
"""The metrics are printed anew when a fiftieth of their rows is new: always at first, seldom in a long training."""


class AwsFiles:
    """Writes AWS's files of one training into a run folder.

    Args:
        folder: The run folder.
        setup: What is said of the training once.
        with_log: Whether to write the simulation log, which says every tick again.
    """

    def __init__(self, folder: str | Path, setup: AwsSetup, *, with_log: bool = True) -> None:
        self._place, self._setup, self._with_log = AwsModelFolder(Path(folder)), setup, with_log
        self._background = Background()
        self._cutter = EpisodeCutter()
        self._blocks = [Block(0, 0)]
        """Not on the disk yet; the last one is filling."""
        self._clock = 0
        self._rows: list[str] = []
        self._rows_written = self._log_written = 0
        self._log_end = 0
        """Where the background goes on in the log."""
        self._held: list[list[dict[str, Any]]] = []
        """Laps of evaluations before the first training row."""
        self._marks: dict[str, CheckpointMark] = {}
        self._busy: set[str] = set()
        self._track_length_m = 0.0

    def pass_through(self, gate: Gate) -> None:
        """Write what is written beside the training when a gate opens."""
        self._background.gate = gate

    def begin(self) -> None:
        """Write what is said once; files of a training that stood here and was begun anew are taken away.

        Raises:
            OutputFileError: The folder cannot be written.
        """
        place, setup = self._place, self._setup
        self._make_folders()
        self._clear(from_block=0)
        write_model_metadata(setup.metadata, place.model_metadata)
        write_hyperparameters(setup.hyperparameters, place.hyperparameters)
        write_params(place.training_params, setup.params)
        if self._with_log:
            self._log_written = self._log_end = append_atomic(place.simulation_log, 0, self._log_head())

    def keep(self, columns: Mapping[str, Array], report: IterationReport) -> None:
        """Take in one of our iterations.

        Args:
            columns: Its ticks: what `EpisodeRecorder.take` gives.
            report: What came of it.

        Raises:
            OutputFileError: A file could not be written.
        """
        self._background.call_done()
        if len(columns["track_length_m"]):
            self._track_length_m = float(columns["track_length_m"][0])
        filling = self._blocks[-1]
        for episode in self._cutter.cut(columns):
            self._take_episode(episode)
        self._take_evaluation(report)
        self._note_update(report, filling if filling is self._blocks[-1] else self._blocks[-2])
        self._hand_over()

    def keep_evaluation(self, report: IterationReport) -> None:
        """Take in an evaluation of the iteration that was taken in last, which then had none.

        Raises:
            OutputFileError: A file could not be written.
        """
        self._background.call_done()
        self._take_evaluation(report)
        self._mark(report)
        self._hand_over()

    def state(self) -> dict[str, Any]:
        """Return what is not on the disk yet and what is needed to go on: arrays and plain values."""
        self._background.call_done()
        return {
            "clock": self._clock,
            "cutter": self._cutter.state(),
            "blocks": [block.state() for block in self._blocks],
            "rows": self._rows[self._rows_written :],
            "rows_written": self._rows_written,
            "log_written": self._log_written,
            "held": self._held,
            "marks": {name: asdict(mark) for name, mark in self._marks.items()},
            "track_length_m": self._track_length_m,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from what `state` gave; what was written after it is taken away.

        Raises:
            MetricsFileError: TrainingMetrics.json is damaged.
            OutputFileError: The folder cannot be written.
        """
        self._clock, self._track_length_m = state["clock"], state["track_length_m"]
        self._cutter.restore(state["cutter"])
        self._blocks = [Block.from_state(block) for block in state["blocks"]]
        self._rows_written, self._log_written = state["rows_written"], state["log_written"]
        self._rows = [*self._rows_of_file()[: self._rows_written], *state["rows"]]
        self._held = [list(laps) for laps in state["held"]]
        self._marks = {name: CheckpointMark(**mark) for name, mark in state["marks"].items()}
        self._make_folders()
        self._clear(from_block=self._blocks[0].number)
        if self._with_log:
            head = b"" if self._place.simulation_log.exists() else self._log_head()
            self._log_written = self._log_end = append_atomic(self._place.simulation_log, self._log_written, head)
        for block in self._blocks[:-1]:
            self._write_block(block)

    def close(self) -> None:
        """Write what is left, an iteration that is not full among it, and wait until it is on the disk.

        Raises:
            OutputFileError: A file could not be written.
        """
        try:
            self._background.call_done(wait=True)
            if self._blocks[-1].episodes:
                trace = self._blocks[-1].trace(self._track_length_m)
                write_atomic(self._place.training_trace(self._blocks[-1].number), sim_trace_text(trace))
            if len(self._rows) > self._rows_written:
                write_atomic(self._place.training_metrics, self._metrics_text(self._rows))
                self._rows_written = len(self._rows)
            if self._marks:  # the last ones were passed over where the file was being written
                write_atomic(
                    self._place.checkpoint_marks, checkpoint_marks_text(self._marks["best"], self._marks["last"])
                )
        finally:
            self._background.close()

    def _take_episode(self, episode: Array) -> None:
        """Lay an episode behind those before it."""
        block, last = self._blocks[-1], episode[-1]
        block.episodes.append(episode)
        block.starts.append(self._clock)
        row = training_row(
            reward=float(episode["reward"].sum()),
            start_s=self._clock / TICKS_PER_SECOND,
            end_s=(self._clock + len(episode)) / TICKS_PER_SECOND,
            episode=block.first_episode + len(block.episodes),
            trial=len(block.episodes),
            progress_share=float(last["progress_share"]),
            status=STATUSES[last["status"]],
        )
        self._clock += len(episode)
        self._rows.append(row_text(row))
        if len(block.episodes) == self._setup.episodes_per_iteration:
            self._blocks.append(Block(block.number + 1, block.first_episode + len(block.episodes)))

    def _take_evaluation(self, report: IterationReport) -> None:
        """Put the laps of an evaluation behind the latest training row; before the first they wait for it."""
        laps = report.result.details.get("laps") if report.result else None
        self._held += [laps] if laps else []
        if not self._rows:
            return
        last = json.loads(self._rows[-1])
        for lap in (lap for laps in self._held for lap in laps):
            row = training_row(
                reward=lap.get("reward") or 0.0,
                start_s=self._clock / TICKS_PER_SECOND,
                end_s=(self._clock + lap["steps"]) / TICKS_PER_SECOND,
                episode=last["episode"],
                trial=last["trial"],
                progress_share=lap["progress_percent"] / 100,
                status=lap["status"] if lap["status"] in STATUS_LABELS else "time_up",
                phase="evaluation",
            )
            self._clock += lap["steps"]
            self._rows.append(row_text(row))
        self._held = []

    def _note_update(self, report: IterationReport, block: Block) -> None:
        """Let the log tell of the update and its checkpoint, behind the episodes of a block."""
        losses, values = report.losses, self._setup.hyperparameters
        surrogate, divergence, entropy = (
            losses.get(name, math.nan) for name in ("policy_loss", "approx_kl", "entropy")
        )
        line = update_line(surrogate, divergence, entropy, (values.num_epochs or 1) - 1, values.lr or 0.0)
        block.lines += [line, checkpoint_line(report.iteration, report.steps)]
        self._mark(report)

    def _mark(self, report: IterationReport) -> None:
        """Note which checkpoint is the last, and which the best: the loop's own choice."""
        metric = _metric_of(report.result, self._setup.best_model_metric) if report.result else None
        self._marks["last"] = CheckpointMark(report.iteration, report.steps, metric, round(time.time(), 3))
        if report.is_best or "best" not in self._marks:
            self._marks["best"] = self._marks["last"]

    def _hand_over(self) -> None:
        """Hand full blocks, new rows and marks to the background."""
        for block in self._blocks[:-1]:
            if f"block {block.number}" not in self._busy:
                self._write_block(block)
        new = len(self._rows) - self._rows_written
        if new > len(self._rows) // NEW_ROWS_SHARE and "metrics" not in self._busy:
            self._write_metrics()
        if "marks" not in self._busy:
            text = checkpoint_marks_text(self._marks["best"], self._marks["last"])
            self._give("marks", lambda: write_atomic(self._place.checkpoint_marks, text), lambda: None)

    def _write_block(self, block: Block) -> None:
        """Have a full block written, trace and log."""
        place, length = self._place, self._track_length_m

        def job() -> None:
            trace = block.trace(length)
            write_atomic(place.training_trace(block.number), sim_trace_text(trace))
            if self._with_log:
                self._log_end = append_atomic(place.simulation_log, self._log_end, block.log_text(trace).encode())
            ends.append(self._log_end)

        def done() -> None:
            self._blocks = [other for other in self._blocks if other is not block]
            self._log_written = ends[0]

        ends: list[int] = []
        self._give(f"block {block.number}", job, done)

    def _write_metrics(self) -> None:
        rows = list(self._rows)

        def done() -> None:
            self._rows_written = len(rows)

        self._give("metrics", lambda: write_atomic(self._place.training_metrics, self._metrics_text(rows)), done)

    def _give(self, name: str, job: Callable[[], None], done: Callable[[], None]) -> None:
        """Give a job to the background; until it is done, its name is busy."""

        def settled() -> None:
            self._busy.discard(name)
            done()

        self._busy.add(name)
        self._background.give(job, settled)

    def _metrics_text(self, rows: Sequence[str]) -> str:
        return training_metrics_text(rows, self._setup.best_model_metric)

    def _rows_of_file(self) -> list[str]:
        """Return the rows of TrainingMetrics.json as they are printed; none where somebody took the file away."""
        path = self._place.training_metrics
        rows = read_metrics_file(path).rows if self._rows_written and path.exists() else ()
        return [row_text(row) for row in rows if isinstance(row, TrainingRow)]

    def _log_head(self) -> bytes:
        setup = self._setup
        head = [*log_head(setup.world_name, setup.metadata, setup.hyperparameters), checkpoint_line(0, 0)]
        return ("\n".join(head) + "\n").encode()

    def _make_folders(self) -> None:
        place = self._place
        for path in (
            place.model_metadata,
            place.hyperparameters,
            place.training_trace(0),
            place.training_metrics,
            place.simulation_log,
        ):
            make_folder(path.parent)

    def _clear(self, from_block: int) -> None:
        """Take away traces from a block on."""
        for number, path in self._place.training_traces().items():
            if number >= from_block:
                path.unlink(missing_ok=True)


def _metric_of(result: EvaluationResult, best_by: str) -> float:
    """Return what AWS calls `avg_eval_metric`: mean progress, mean reward, or mean milliseconds of a lap."""
    merit = result.selection_metric[0]
    return -merit if best_by == "laptime" else merit
