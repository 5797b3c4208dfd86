"""The loop: collect, update, evaluate, write; over and over until a stop condition holds.

One loop serves every world and every algorithm. What differs is given: how episodes are scored and policies evaluated
(`Evaluator`), what a learner consumes (`Learner.experience`) and what is written (`Writer`). Ctrl-C or a stop file in
the run folder ends the loop; what was written stays, and an interrupted iteration leaves no trace.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from racecraft.algorithms.learner import EPISODES, HasSchedules, Learner
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import EpisodeRecord
from racecraft.rollout.collector import CollectorProtocol
from racecraft.rollout.memory import within_memory
from racecraft.rollout.settings import RolloutConfig
from racecraft.training.callbacks import EvaluationResult, IterationReport, TrainingCallback, ended_alike
from racecraft.training.settings import EvaluationConfig
from racecraft.training.stopping import LATEST_EPISODES, Progress, StopCondition, reached, share_done

GRACE_SECONDS, OVERTIME, LAST_EVALUATION_SECONDS = 2.0, 0.1, 60.0
"""An iteration under way when its minutes are over may take so long, and this share of them, to be finished; then it is
broken off: with a slow reward function one may take hours. The last evaluation may take a minute."""
LOOK_SECONDS = 0.5
"""How often, within an iteration, the clock and the stop file are looked at."""


class Evaluator(Protocol):
    """Says how good a policy is."""

    score_name: str
    """What the score is called, such as "progress %"."""

    @property
    def stop_kinds(self) -> Mapping[str, str]:
        """Stop conditions that this world adds, each with what it waits for."""
        ...

    def score(self, episode: EpisodeRecord) -> float | None:
        """Return what one training episode counts; None: one alone counts nothing."""
        ...

    def goal_reached(self, episode: EpisodeRecord) -> bool:
        """Tell whether an episode reached the world's goal: a full lap, the threshold."""
        ...

    def watch(self, episodes: Sequence[EpisodeRecord]) -> None:
        """Hear of an iteration's training episodes."""
        ...

    def evaluate(self) -> EvaluationResult:
        """Judge the greedy policy as it stands."""
        ...

    def confirm(self) -> bool:
        """Look once more, and harder, at a policy that is about to be called stable."""
        ...


class Writer(Protocol):
    """Writes down what is worth keeping: at every moment a whole state stands on the disk."""

    def write_start(self) -> None:
        """Write the untrained policy, as checkpoint 0."""
        ...

    def write(self, report: IterationReport, loop_state: Callable[[], dict[str, Any]]) -> None:
        """Write an iteration: episodes, evaluation, checkpoint with the loop's own state, metrics."""
        ...

    def collected(self) -> None:
        """Hear that the next iteration is collected."""
        ...

    def write_evaluation(self, report: IterationReport, loop_state: Callable[[], dict[str, Any]]) -> None:
        """Write an evaluation of an iteration that was written without one."""
        ...

    def stop_requested(self) -> bool:
        """Tell whether somebody outside has asked the training to stop."""
        ...

    def close(self) -> None:
        """Wait until all that was written is on the disk."""
        ...


@runtime_checkable
class PollsWhileJudging(Protocol):
    """An evaluator that can be broken off."""

    def set_poll_callback(self, poll: Callable[[], None]) -> None:
        """Have something called while it plays; what it raises ends the evaluation."""
        ...


class ExperienceSource(Protocol):
    """What stands between collector and learner: the rollout itself, or a replay that remembers it."""

    def add(self, batch: RolloutBatch) -> Any:
        """Take in what was collected and return what the learner is fed; None: not yet enough to learn from."""
        ...


class LatestRollout:
    """Feeds a learner what was collected, once."""

    def add(self, batch: RolloutBatch) -> RolloutBatch:
        """Return the rollout."""
        return batch


WHEN_ASKED = "Ctrl-C or `racecraft stop`"
"""What ends a training that was given no stop."""


@dataclass(frozen=True)
class Outcome:
    """What a training came to."""

    reason: str
    """Why it ended: the condition that held, or "Ctrl-C"."""
    iterations: int
    steps: int
    seconds: float
    """Spent training, from the first tick on, compilation out; what came before a resume counts."""
    seconds_to_first_goal: float | None
    """First episode that reached the goal, in training or evaluation."""
    seconds_to_stable: float | None
    """End of the evaluation that made it stable."""
    best: EvaluationResult | None
    """Of the best checkpoint; its details are empty where the training was resumed since."""
    last: EvaluationResult | None
    """The latest evaluation."""


class _BrokenOff(BaseException):
    """An iteration was broken off from within; nobody but the loop catches it."""


class TrainingLoop:
    """Train until a stop condition holds.

    Args:
        collector: Worlds and the learner that acts in them.
        learner: The same learner.
        evaluator: Says how good it is.
        writer: Writes down.
        callback: Watches.
        rollout: How much is collected before an update.
        evaluation: How often it is evaluated, and what is stable.
        stops: The first that holds ends the training.
        feed: What the learner is fed.
        after_update: Called after each update, for opponents that follow the learner.
    """

    def __init__(
        self,
        collector: CollectorProtocol,
        learner: Learner,
        evaluator: Evaluator,
        writer: Writer,
        callback: TrainingCallback,
        rollout: RolloutConfig,
        evaluation: EvaluationConfig,
        stops: Sequence[StopCondition],
        feed: ExperienceSource | None = None,
        after_update: Callable[[], None] = lambda: None,
    ) -> None:
        self._collector, self._learner = collector, learner
        self._evaluator, self._writer, self._callback = evaluator, writer, callback
        self._rollout, self._evaluation, self._stops = rollout, evaluation, tuple(stops)
        self._feed, self._after_update = LatestRollout() if feed is None else feed, after_update
        self._iteration = self._solved_in_a_row = 0
        self._evaluated_at = self._evaluation_steps = 0
        """Steps of training at the latest evaluation in its turn, and what it took itself."""
        self._is_stable = False
        self._episodes, self._latest_rewards = 0, deque[float](maxlen=LATEST_EPISODES)
        self._mean_steps: float | None = None
        """Of an episode, in the latest iteration in which some ended."""
        self._best: EvaluationResult | None = None
        self._last: EvaluationResult | None = None
        self._report: IterationReport | None = None
        self._first_goal: float | None = None
        self._stable: float | None = None
        self._began = self._seconds_before = self._seconds_writing = self._looked = 0.0
        self._is_judging_over = False
        """An evaluation was broken off: no time is left for another."""
        self._is_last_evaluation = False
        collector.set_poll_callback(self._look_at_clock)
        if isinstance(evaluator, PollsWhileJudging):
            evaluator.set_poll_callback(self._look_at_clock)

    def run(self, title: str) -> Outcome:
        """Train until a stop condition holds or Ctrl-C; tell what came of it.

        Raises:
            RewardError: The user's reward function failed; everything written so far stays.
            DivergedError: The losses are no longer numbers; likewise.
            OutputFileError: Something could not be written; what stood before still stands.
        """
        if self._iteration == 0:
            self._writer.write_start()
        self._callback.begin(title, " or ".join(map(str, self._stops)) or WHEN_ASKED, self._evaluator.score_name)
        self._began = self._looked = time.perf_counter()
        reason = ""
        try:
            # A run that is resumed may have reached its stop before it was broken off.
            reason = self._stop() if self._iteration else ""
            while not reason:
                self._callback.iteration(self._iterate())
                reason = self._stop()
            self._evaluate_at_last()
        except _BrokenOff as broken:
            reason = str(broken)
            self._evaluate_at_last()
        except KeyboardInterrupt as interrupt:
            reason = str(interrupt) or "Ctrl-C"
        finally:
            self._end(reason or "an error")
        return Outcome(
            reason=reason,
            iterations=self._iteration,
            steps=self._collector.steps_taken,
            seconds=self._seconds(),
            seconds_to_first_goal=self._first_goal,
            seconds_to_stable=self._stable,
            best=self._best,
            last=self._last,
        )

    def state(self) -> dict[str, Any]:
        """Return what the loop itself must know to go on: counts, the best so far, seconds."""
        best = self._best
        return {
            "iteration": self._iteration,
            "solved_in_a_row": self._solved_in_a_row,
            "is_stable": self._is_stable,
            "episodes": self._episodes,
            "mean_steps": self._mean_steps,
            "latest_rewards": [float(reward) for reward in self._latest_rewards],
            "evaluated_at": self._evaluated_at,
            "evaluation_steps": self._evaluation_steps,
            "best": None
            if best is None
            else {
                "score": best.score,
                "solved": best.solved,
                "selection": [float(part) for part in best.selection_metric],
                "figures": dict(best.figures),
                "headline": best.headline,
            },
            "seconds": self._seconds(),
            "seconds_to_first_goal": self._first_goal,
            "seconds_to_stable": self._stable,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from what `state` gave."""
        self._iteration, self._solved_in_a_row = state["iteration"], state["solved_in_a_row"]
        self._is_stable = state["is_stable"]
        self._episodes, self._mean_steps = state.get("episodes", 0), state.get("mean_steps")
        self._latest_rewards.extend(state.get("latest_rewards", ()))
        self._evaluated_at, self._evaluation_steps = state.get("evaluated_at", 0), state.get("evaluation_steps", 0)
        if (best := state["best"]) is not None:
            self._best = EvaluationResult(
                best["score"],
                best["solved"],
                figures=best["figures"],
                headline=best["headline"],
                selection=tuple(best["selection"]),
            )
        self._seconds_before = state["seconds"]
        self._first_goal, self._stable = state["seconds_to_first_goal"], state["seconds_to_stable"]

    def _iterate(self) -> IterationReport:
        """Take one turn."""
        steps_before, marks = self._collector.steps_taken, [time.perf_counter()]
        batch = self._collect()
        self._writer.collected()
        episodes = self._collector.pop_episodes()
        self._evaluator.watch(episodes)
        self._episodes += len(episodes)
        self._latest_rewards.extend(one.reward for one in episodes)
        if episodes:
            self._mean_steps = sum(one.steps for one in episodes) / len(episodes)
        self._note_first_goal(any(map(self._evaluator.goal_reached, episodes)))
        marks.append(time.perf_counter())
        losses = self._update(batch)
        marks.append(time.perf_counter())
        self._iteration += 1
        result, is_best = None, False
        if self._is_due():
            try:
                result, is_best = self._evaluate()
                self._evaluated_at, self._evaluation_steps = self._collector.steps_taken, result.steps
                self._note_stability(result)
            except _BrokenOff:
                self._is_judging_over = True
        marks.append(time.perf_counter())
        steps = self._collector.steps_taken
        ended = [(one.status, one.reward, self._evaluator.score(one), one.facts.get("seconds")) for one in episodes]
        scores = [score for _, _, score, _ in ended if score is not None]
        report = IterationReport(
            iteration=self._iteration,
            steps=steps,
            seconds=self._seconds(),
            steps_per_second=(steps - steps_before) / (marks[3] - marks[0] + self._seconds_writing),
            episodes=len(episodes),
            mean_reward=sum(one.reward for one in episodes) / len(episodes) if episodes else None,
            training_score=sum(scores) / len(scores) if scores else None,
            losses={name: float(value) for name, value in losses.items()},
            result=result,
            is_best=is_best,
            by_status=ended_alike(ended),
            phase_seconds={
                "collect": marks[1] - marks[0],
                "learn": marks[2] - marks[1],
                "judge": marks[3] - marks[2],
                "keep_before": self._seconds_writing,
            },
        )
        self._writer.write(report, self.state)
        self._seconds_writing = time.perf_counter() - marks[3]
        self._report = report
        return report

    def _collect(self) -> RolloutBatch:
        episodes = self._rollout.episodes_per_iteration
        if episodes is None and self._learner.experience == EPISODES:
            raise SettingError(
                "rollout.episodes_per_iteration is none, and this algorithm learns from whole episodes; expected a "
                "number, such as --set rollout.episodes_per_iteration=16."
            )
        if episodes is None:
            return self._collector.collect()
        quota, cap = episodes // self._rollout.num_worlds, self._rollout.memory_steps
        batch = self._collector.collect_episodes(quota)
        return batch if cap is None else within_memory(batch, quota, cap)

    def _update(self, batch: RolloutBatch) -> Mapping[str, float]:
        done = share_done(self._stops, self._progress())
        if done is not None and isinstance(self._learner, HasSchedules):
            self._learner.anneal(done)
        experience = self._feed.add(batch)
        if experience is None:
            return {}
        figures = self._learner.update(experience)
        self._after_update()
        return figures

    def _is_due(self) -> bool:
        """Tell whether this iteration is evaluated: its turn has come, and the evaluation before is made up for."""
        if self._iteration % self._evaluation.every:
            return False
        trained, share = self._collector.steps_taken - self._evaluated_at, self._evaluation.share
        if share is None:
            return True
        return trained * share >= (self._evaluation_steps or self._steps_of_first_evaluation(share))

    def _steps_of_first_evaluation(self, share: float) -> float:
        """Return what the first evaluation will take, by the length of training's episodes, where it has to be small.

        Before any has ended nobody knows, and nothing is judged.
        """
        if share >= 1.0:
            return 0.0
        return self._evaluation.episodes * self._mean_steps if self._mean_steps is not None else math.inf

    def _evaluate(self) -> tuple[EvaluationResult, bool]:
        """Evaluate the policy; tell whether it is the best so far (of equals the newer, as at AWS)."""
        result = self._evaluator.evaluate()
        self._last = result
        self._note_first_goal(result.goal_reached)
        is_best = self._best is None or result.takes_the_place_of(self._best)
        if is_best:
            self._best = result
        return result, is_best

    def _note_stability(self, result: EvaluationResult) -> None:
        """Count how many evaluations in a row were solved; what is stable for the first time is confirmed."""
        self._solved_in_a_row = self._solved_in_a_row + 1 if result.solved else 0
        self._is_stable = self._solved_in_a_row >= self._evaluation.stable_after
        if self._is_stable and self._stable is None:
            self._is_stable = self._evaluator.confirm()
            self._solved_in_a_row *= self._is_stable
            self._stable = self._seconds() if self._is_stable else None

    def _evaluate_at_last(self) -> None:
        """Evaluate what was trained, where the last iteration was not evaluated: no training ends unjudged.

        It counts for nothing in a row, so that a run that goes on from here takes the way of an unbroken one.
        """
        report = self._report
        if self._is_judging_over or report is None or report.result is not None or report.iteration != self._iteration:
            return
        self._is_last_evaluation = True
        try:
            result, is_best = self._evaluate()
        except _BrokenOff:
            return
        judged = IterationReport(**{**vars(report), "result": result, "is_best": is_best})
        self._writer.write_evaluation(judged, self.state)
        self._callback.iteration(judged)

    def _note_first_goal(self, happened: bool) -> None:
        if happened and self._first_goal is None:
            self._first_goal = self._seconds()

    def _stop(self) -> str:
        """Return why the training ends now; "" where it goes on."""
        if self._writer.stop_requested():
            return "stop requested"
        condition = reached(self._stops, self._progress())
        return "" if condition is None else str(condition)

    def _progress(self) -> Progress:
        evaluated = self._report is not None and self._report.result is not None
        figures = self._last.figures if self._last is not None and evaluated else {}
        return Progress(
            seconds=self._seconds(),
            iterations=self._iteration,
            steps=self._collector.steps_taken,
            is_stable=self._is_stable,
            score=self._last.score if self._last is not None and evaluated else None,
            lap_seconds=figures.get("flying_lap_seconds"),
            gap_percent=figures.get("gap_percent"),
            episodes=self._episodes,
            mean_reward=self._latest_mean_reward(),
        )

    def _latest_mean_reward(self) -> float | None:
        rewards = self._latest_rewards
        return sum(rewards) / len(rewards) if len(rewards) == LATEST_EPISODES else None

    def _look_at_clock(self) -> None:
        """Break a long iteration off when its minutes are over or somebody asks; called while it collects."""
        now = time.perf_counter()
        if now - self._looked < LOOK_SECONDS:
            return
        self._looked = now
        minutes = [stop for stop in self._stops if stop.kind == "minutes"]
        grace = LAST_EVALUATION_SECONDS if self._is_last_evaluation else GRACE_SECONDS
        over = [one for one in minutes if self._seconds() > 60.0 * one.amount * (1.0 + OVERTIME) + grace]
        if over:
            raise _BrokenOff(str(over[0]))
        if self._writer.stop_requested() and not self._is_last_evaluation:
            raise _BrokenOff("stop requested")

    def _end(self, reason: str) -> None:
        """Have everything on the disk, then tell the callback."""
        try:
            self._writer.close()
        finally:
            self._callback.end(reason)

    def _seconds(self) -> float:
        return self._seconds_before + time.perf_counter() - self._began
