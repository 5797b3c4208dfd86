"""The loop: collect, learn, judge, keep; over and over until a stop holds.

One page serves every world. What differs stands outside: how episodes are scored and judged (`Judge`) and what is
written down (`Keeper`). Ctrl-C ends the loop; whatever was kept stays, and a broken-off iteration leaves no trace.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

from racecraft.algorithms.multi_policy import Learner
from racecraft.algorithms.ppo import PpoLosses
from racecraft.algorithms.rollout_batch import Experience
from racecraft.contract.world import EpisodeRecord
from racecraft.rollout.collector import Collector
from racecraft.rollout.memory import within_memory
from racecraft.settings.groups import EvaluationConfig, RolloutConfig
from racecraft.training.callbacks import IterationReport, Listener, Verdict
from racecraft.training.stopping import Standing, Stop, reached

OVERTIME = 0.1
"""Share of the minutes asked for within which an iteration under way may still be finished."""


class _OutOfTimeError(Exception):
    """Ends an iteration; says which stop."""


class Judge(Protocol):
    """Says how good a policy is."""

    score_name: str
    """What the score is called, such as "progress %"."""

    def score(self, episode: EpisodeRecord) -> float | None:
        """Return what one training episode counts; None: one alone counts nothing."""
        ...

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether an episode reached the world's goal: a full lap."""
        ...

    def judge(self) -> Verdict:
        """Judge the greedy policy as it stands."""
        ...


class Keeper(Protocol):
    """Writes down what is worth keeping: at every moment a whole state stands on the disk."""

    def keep_start(self) -> None:
        """Keep the untrained policy, as checkpoint 0."""
        ...

    def keep(self, report: IterationReport, loop_state: Callable[[], dict[str, Any]]) -> None:
        """Keep an iteration: episodes, evaluation, checkpoint with the loop's own state, metrics."""
        ...

    def close(self) -> None:
        """Wait until all that was kept is on the disk."""
        ...


@dataclass(frozen=True)
class Outcome:
    """What a training came to."""

    reason: str
    """Why it ended: the stop that held, or "Ctrl-C"."""
    iterations: int
    steps: int
    seconds: float
    """Spent training, from the first tick on, compilation out; what came before a resume counts."""
    seconds_to_first_full_lap: float | None
    """First episode that reached the goal, in training or evaluation."""
    seconds_to_stable_laps: float | None
    """End of the evaluation that made it stable."""
    best_lap_seconds: float | None
    last: Verdict | None
    """The latest verdict."""


class TrainingLoop:
    """Train until a stop holds.

    Args:
        collector: Worlds and the learner that drives them.
        learner: The same learner.
        judge: Says how good it is.
        keeper: Writes down.
        listener: Watches.
        rollout: How much is collected before an update.
        evaluation: How often it is judged, and what is stable.
        stops: The first that holds ends the training.
        after_update: Called with the number of steps so far after each update, for schedules.
    """

    def __init__(
        self,
        collector: Collector,
        learner: Learner,
        judge: Judge,
        keeper: Keeper,
        listener: Listener,
        rollout: RolloutConfig,
        evaluation: EvaluationConfig,
        stops: Sequence[Stop],
        after_update: Callable[[int], None] | None = None,
    ) -> None:
        self._collector, self._learner = collector, learner
        self._judge, self._keeper, self._listener = judge, keeper, listener
        self._rollout, self._evaluation, self._stops = rollout, evaluation, tuple(stops)
        self._after_update = after_update
        collector.observers.append(self._look_at_clock)
        self._iteration = 0
        self._perfect_in_a_row = 0
        self._best_score: float | None = None
        self._last: Verdict | None = None
        self._best_lap: float | None = None
        self._first_full: float | None = None
        self._stable: float | None = None
        self._began = self._seconds_before = self._seconds_keeping = 0.0

    def run(self, title: str) -> Outcome:
        """Train until a stop holds or Ctrl-C; tell what came of it.

        Raises:
            RewardError: The user's reward function failed; everything kept so far stays.
            DivergedError: The losses are no longer numbers; likewise.
            OutputFileError: Something could not be written; what stood before still stands.
        """
        if self._iteration == 0:
            self._keeper.keep_start()
        self._listener.begin(title, " or ".join(map(str, self._stops)), self._judge.score_name)
        self._began = time.perf_counter()
        reason = "an error"
        try:
            # A run that is resumed may have reached its stop before it was broken off.
            stop = reached(self._stops, self._standing()) if self._iteration else None
            while stop is None:
                self._listener.iteration(self._iterate())
                stop = reached(self._stops, self._standing())
            reason = str(stop)
        except KeyboardInterrupt:
            reason = "Ctrl-C"
        except _OutOfTimeError as over:
            reason = str(over)
        finally:
            self._end(reason)
        return Outcome(
            reason=reason,
            iterations=self._iteration,
            steps=self._collector.steps_taken,
            seconds=self._seconds(),
            seconds_to_first_full_lap=self._first_full,
            seconds_to_stable_laps=self._stable,
            best_lap_seconds=self._best_lap,
            last=self._last,
        )

    def _end(self, reason: str) -> None:
        """Have everything on the disk, then tell the listener."""
        try:
            self._keeper.close()
        finally:
            self._listener.end(reason)

    def state(self) -> dict[str, Any]:
        """Return what the loop itself must know to go on: counts, the best so far, seconds."""
        return {
            "iteration": self._iteration,
            "perfect_in_a_row": self._perfect_in_a_row,
            "best_score": self._best_score,
            "best_lap_seconds": self._best_lap,
            "seconds": self._seconds(),
            "seconds_to_first_full_lap": self._first_full,
            "seconds_to_stable_laps": self._stable,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from what `state` gave."""
        self._iteration = state["iteration"]
        self._perfect_in_a_row = state["perfect_in_a_row"]
        self._best_score = state["best_score"]
        self._best_lap = state["best_lap_seconds"]
        self._seconds_before = state["seconds"]
        self._first_full = state["seconds_to_first_full_lap"]
        self._stable = state["seconds_to_stable_laps"]

    def _iterate(self) -> IterationReport:
        """Take one turn."""
        steps_before, marks = self._collector.steps_taken, [time.perf_counter()]
        experience = self._collect()
        episodes = self._collector.take_episodes()
        self._note_first_full(any(map(self._judge.is_full, episodes)))
        marks.append(time.perf_counter())
        losses = self._learn(experience)
        marks.append(time.perf_counter())
        verdict, is_best = self._look_at_policy()
        marks.append(time.perf_counter())
        self._iteration += 1
        steps = self._collector.steps_taken
        scores = [score for score in map(self._judge.score, episodes) if score is not None]
        report = IterationReport(
            iteration=self._iteration,
            steps=steps,
            seconds=self._seconds(),
            steps_per_second=(steps - steps_before) / (marks[3] - marks[0] + self._seconds_keeping),
            episodes=len(episodes),
            training_score=sum(scores) / len(scores) if scores else None,
            losses={name: float(value) for name, value in asdict(losses).items()},
            verdict=verdict,
            is_best=is_best,
            phase_seconds={
                "collect": marks[1] - marks[0],
                "learn": marks[2] - marks[1],
                "judge": marks[3] - marks[2],
                "keep_before": self._seconds_keeping,
            },
        )
        self._keeper.keep(report, self.state)
        self._seconds_keeping = time.perf_counter() - marks[3]
        return report

    def _look_at_clock(self, *_: object) -> None:
        """Break an iteration off that outlasts the minutes asked for: with a slow reward one may take hours."""
        seconds = self._seconds()
        for stop in self._stops:
            if stop.kind == "minutes" and seconds > 60 * stop.amount * (1 + OVERTIME):
                raise _OutOfTimeError(str(stop))

    def _collect(self) -> Experience:
        episodes = self._rollout.episodes_per_iteration
        if episodes is None:
            return self._collector.collect()
        quota, cap = episodes // self._rollout.num_worlds, self._rollout.memory_steps
        kept = self._collector.collect_episodes(quota)
        return kept if cap is None else within_memory(kept, quota, cap)

    def _learn(self, experience: Experience) -> PpoLosses:
        losses = self._learner.update(experience)
        if self._after_update is not None:
            self._after_update(self._collector.steps_taken)
        return losses

    def _look_at_policy(self) -> tuple[Verdict | None, bool]:
        """Judge, when it is time to; tell whether it is the best so far (of equals the newer, as at AWS)."""
        if (self._iteration + 1) % self._evaluation.every:
            return None, False
        verdict = self._judge.judge()
        self._last = verdict
        self._note_first_full(verdict.best_lap_seconds is not None)
        self._perfect_in_a_row = self._perfect_in_a_row + 1 if verdict.is_perfect else 0
        if self._perfect_in_a_row >= self._evaluation.stable_after and self._stable is None:
            self._stable = self._seconds()
        if verdict.best_lap_seconds is not None:
            self._best_lap = min(verdict.best_lap_seconds, self._best_lap or verdict.best_lap_seconds)
        merit = verdict.score if verdict.merit is None else verdict.merit
        is_best = self._best_score is None or merit >= self._best_score
        if is_best:
            self._best_score = merit
        return verdict, is_best

    def _note_first_full(self, happened: bool) -> None:
        if happened and self._first_full is None:
            self._first_full = self._seconds()

    def _standing(self) -> Standing:
        judged_now = self._last is not None and self._iteration % self._evaluation.every == 0
        return Standing(
            seconds=self._seconds(),
            iterations=self._iteration,
            steps=self._collector.steps_taken,
            is_stable=self._perfect_in_a_row >= self._evaluation.stable_after,
            score=self._last.score if self._last is not None and judged_now else None,
        )

    def _seconds(self) -> float:
        return self._seconds_before + time.perf_counter() - self._began
