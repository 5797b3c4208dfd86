"""Which checkpoint the loop calls best, and that all who tell of it tell the same: by hand, with a scripted judge."""

import io
import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from racecraft.algorithms.learner import DivergedError
from racecraft.contract.world import EpisodeRecord
from racecraft.rollout.settings import RolloutConfig
from racecraft.training.callbacks import EndedAlike, EvaluationResult, IterationReport
from racecraft.training.loop import TrainingLoop
from racecraft.training.progress import LineWatcher, LiveWatcher
from racecraft.training.settings import EvaluationConfig
from racecraft.training.stopping import parse_stops
from racecraft.worlds.deepracer.cli.train import what_came_of_it
from racecraft.worlds.deepracer.training.trainer import summary


def lap(progress, seconds):
    """What the car's evaluator says of a mean progress and a best lap: compared by progress, of equals by the lap."""
    return EvaluationResult(
        progress,
        solved=False,
        figures={"best_lap_seconds": seconds},
        headline="" if seconds is None else f"best lap {seconds:.2f} s",
        selection=(progress, -float("inf") if seconds is None else -seconds),
    )


class ScriptedJudge:
    """Says what it was told to say, evaluation after evaluation."""

    score_name, stop_kinds = "progress %", {}

    def __init__(self, results, confirms=()):
        self.results, self.confirms, self.asked = list(results), list(confirms), 0

    def score(self, episode):
        return 10.0

    def goal_reached(self, episode):
        return False

    def watch(self, episodes): ...

    def evaluate(self):
        return self.results.pop(0)

    def confirm(self):
        self.asked += 1
        return self.confirms.pop(0) if self.confirms else True


class Notes:
    """Writer and callback at once: notes every report."""

    def __init__(self):
        self.reports, self.reasons = [], []

    def write_start(self): ...
    def write(self, report, loop_state):
        self.reports.append(report)

    def collected(self): ...
    def write_evaluation(self, report, loop_state):
        self.reports[-1] = report

    def stop_requested(self):
        return False

    def close(self): ...
    def begin(self, title, stops, score_name): ...
    def iteration(self, report): ...
    def end(self, reason):
        self.reasons.append(reason)


class Collector:
    """Collects nothing, and has two episodes of rewards 3 and 6 each time."""

    def __init__(self):
        self.steps_taken = 0

    def set_poll_callback(self, look):
        """Nobody looks: nothing lasts here."""

    def collect(self):
        self.steps_taken += 5

    def pop_episodes(self):
        return [EpisodeRecord(0, 0, 30, 3.0, "fell"), EpisodeRecord(0, 0, 60, 6.0, "fell", {"seconds": 4.0})]


def train(results, every=1, iterations=None, share=None, stops=None):
    """Train for as many iterations as there are results, nothing learned; return outcome, reports and the loop."""
    learner = SimpleNamespace(experience="rollout", update=lambda batch: {})
    feed = SimpleNamespace(add=lambda batch: batch)
    notes = Notes()
    loop = TrainingLoop(
        Collector(), learner, ScriptedJudge(results), notes, notes,
        RolloutConfig(num_worlds=1, horizon=1), EvaluationConfig(every=every, share=share),
        parse_stops(stops or [f"iterations={iterations or len(results)}"]), feed,
    )  # fmt: skip
    return loop.run("scripted"), notes.reports, loop


@pytest.mark.parametrize(
    ("stop", "iterations"),
    [("episodes=7", 4), ("episodes=8", 4), ("reward=4.4", 50), ("reward=-1e6", 50), ("reward=4.5", 60)],
)
def test_episodes_and_the_mean_reward_of_the_latest_end_a_training(stop, iterations):
    """Two episodes of mean reward 4.5 an iteration; the mean counts from the hundredth on, and has to be exceeded."""
    results = [lap(10.0, None)] * 60
    outcome, _, loop = train(results, stops=[stop, "iterations=60"])
    assert (outcome.iterations, outcome.reason) == (
        iterations,
        stop.replace("1e6", "1000000") if iterations < 60 else "iterations=60",
    )
    state = json.loads(json.dumps(loop.state()))
    _, _, other = train([lap(10.0, None)])
    other.restore(state)
    assert other._progress().episodes == 2 * iterations
    assert other._progress().mean_reward == loop._progress().mean_reward


def test_where_judging_is_to_be_small_the_first_evaluation_waits_until_it_is():
    """Five episodes of 45 steps, as training's are: 225 steps, which 250 of training pay for at a share of 0.9."""
    _, reports, _ = train([lap(10.0, None)] * 2, iterations=60, share=0.9)
    assert [report.iteration for report in reports if report.result is not None] == [50, 60]


def test_a_report_tells_how_episodes_went_that_ended_alike():
    _, reports, _ = train([lap(40, None)])
    assert reports[0].by_status == {"fell": EndedAlike(2, 4.5, 10.0, 4.0)}, "one of them did not say how long it took"


def best_iteration(reports):
    """What checkpoints.json calls best at the end: the last that was the best when it was judged."""
    return [report.iteration for report in reports if report.is_best][-1]


@pytest.mark.parametrize(
    ("laps", "best"),
    [
        ([(100, 20.0), (100, 19.0), (100, 21.0)], 2),  # of equal progress the quicker
        ([(50, None), (100, 20.0), (90, 9.0)], 2),  # a quick lap among bad ones does not count
        ([(100, 20.0), (100, 20.0), (40, None)], 2),  # of equals the newer
        ([(40, None), (40, None), (30, None)], 2),
        ([(40, None), (40, 30.0), (40, None)], 2),  # of equal progress whoever laps
    ],
)
def test_the_best_is_the_newest_of_those_that_nobody_beats(laps, best):
    outcome, reports, _ = train([lap(*each) for each in laps])
    assert best_iteration(reports) == best
    assert outcome.best == lap(*laps[best - 1])
    assert outcome.last == lap(*laps[-1])


def test_an_evaluation_at_the_very_end_takes_the_crown_of_an_equal_too():
    outcome, reports, _ = train([lap(60, None), lap(60, None)], every=2, iterations=3)
    assert [report.is_best for report in reports] == [False, True, True]
    assert [report.result is not None for report in reports] == [False, True, True]


@pytest.mark.parametrize(("confirms", "ends", "asked"), [((), 3, 1), ((False,), 5, 2), ((False, False), 7, 3)])
def test_laps_from_every_start_twice_in_a_row_are_stable_only_when_they_are_confirmed(confirms, ends, asked):
    """By hand: the second evaluation is the first solved; two in a row are asked about; a no begins the count anew."""
    judge = ScriptedJudge([lap(50, None), *[replace(lap(100, 20.0), solved=True)] * 9], confirms)
    notes = Notes()
    TrainingLoop(
        Collector(), SimpleNamespace(experience="rollout", update=lambda batch: {}), judge, notes, notes,
        RolloutConfig(num_worlds=1, horizon=1), EvaluationConfig(stable_after=2),
        parse_stops(["laps", "iterations=9"]), SimpleNamespace(add=lambda batch: batch),
    ).run("scripted")  # fmt: skip
    assert (len(notes.reports), notes.reasons, judge.asked) == (ends, ["laps"], asked)


def test_a_long_evaluation_is_made_up_for_before_the_next():
    """Five steps an iteration: one that takes twelve is paid for by the third behind it."""
    long = [replace(lap(60, None), steps=12)] * 9
    always = [1, 2, 3, 4, 5, 6, 7]
    for share, judged, last in ((None, always, 7), (1.0, [1, 4, 7], 7), (100.0, always, 7)):
        _, reports, loop = train(long, iterations=7, share=share)
        assert [one.iteration for one in reports if one.result is not None] == judged, share
        kept = loop.state()
        told = (kept["evaluated_at"], kept["evaluation_steps"])
        assert told == (5 * last, 12), "the one at the very end counts for nothing"


def test_the_summary_and_the_last_line_tell_the_best_checkpoints_lap(tmp_path):
    outcome, _, _ = train([lap(100, 20.0), lap(70, 9.0), lap(90, None)])
    planned = SimpleNamespace(track=SimpleNamespace(name="oval"), seed=1)
    told = summary(planned, SimpleNamespace(path=tmp_path), outcome)
    assert told["best_lap_seconds"] == 20.0
    assert what_came_of_it(None, told["best_lap_seconds"]).endswith("best lap of the best checkpoint 20.00 s.")


def test_what_is_best_outlives_a_resume():
    _, _, loop = train([lap(100, 20.0), lap(70, 9.0)])
    state = json.loads(json.dumps(loop.state()))
    _, _, other = train([lap(0, None)])
    other.restore(state)
    assert other._best == lap(100, 20.0)


def report(**changed):
    told = {
        "iteration": 1, "steps": 5, "seconds": 1.0, "steps_per_second": 5.0, "episodes": 2, "mean_reward": 4.5,
        "training_score": 10.0, "losses": {}, "result": None, "is_best": False,
    }  # fmt: skip
    return IterationReport(**{**told, **changed})


@pytest.mark.parametrize("kind", ["lines", "live"])
def test_displays_tell_the_mean_reward_beside_a_score_that_is_none(kind):
    assert "4.50" in shown(kind, "progress %", report())
    assert "mean reward" in shown(kind, "rating", report(training_score=None))
    assert "mean reward" not in shown(kind, "return", report(training_score=4.5)), "the score says it already"


@pytest.mark.parametrize("kind", ["lines", "live"])
def test_an_iteration_that_is_judged_when_the_training_ends_is_told_once(kind):
    """By what it took, once, and by what its evaluation came to."""
    told = shown(kind, "progress %", report(training_score=12.5), report(training_score=12.5, result=lap(100, 20.0)))
    assert told.count("12.5") == 1
    assert "evaluation progress % 100.0" in told if kind == "lines" else "100.0" in told


def shown(kind, score_name, *reports):
    from rich.console import Console

    stream = io.StringIO()
    console = Console(file=stream, width=160, force_terminal=False)
    watcher = LineWatcher(stream) if kind == "lines" else LiveWatcher(console)
    watcher.begin("title", "laps", score_name)
    for one in reports:
        watcher.iteration(one)
    watcher.end("laps")
    return stream.getvalue()


class Clock:
    """A clock that only moves when it is told to, s."""

    now = 100.0

    def perf_counter(self):
        return self.now


class LongCollector(Collector):
    """Collects for so many ticks of a second, and lets who wants to look after each."""

    def __init__(self, clock, ticks):
        super().__init__()
        self.clock, self.ticks = clock, ticks

    def set_poll_callback(self, look):
        self.look = look

    def collect(self):
        for _ in range(self.ticks):
            self.clock.now += 1.0
            self.look()
        return super().collect()


@pytest.mark.parametrize(
    ("ticks", "iterations", "seconds"),
    [
        (10_000, 0, 69.0),  # a minute, a tenth of it and two seconds; then it is broken off
        (68, 1, 68.0),  # within that it is finished
        (34, 2, 68.0),
        (59, 1, 69.0),  # the second one is broken off where the first would have been
    ],
)
def test_minutes_end_within_an_iteration(monkeypatch, ticks, iterations, seconds):
    clock = Clock()
    monkeypatch.setattr("racecraft.training.loop.time", clock)
    outcome = looked_at(LongCollector(clock, ticks), "minutes=1", clock)
    assert (outcome.reason, outcome.iterations, clock.now - 100.0) == ("minutes=1", iterations, seconds)


def test_who_asks_it_to_stop_is_heard_within_an_iteration(monkeypatch):
    clock = Clock()
    monkeypatch.setattr("racecraft.training.loop.time", clock)
    collector = LongCollector(clock, 10_000)
    outcome = looked_at(collector, "iterations=9", clock, asked_at=105.0)
    assert (outcome.reason, outcome.iterations, clock.now) == ("stop requested", 0, 105.0)


def looked_at(collector, stop, clock, asked_at=float("inf")):
    """Train with a collector that lets the loop look meanwhile; somebody asks it to stop at some second."""
    notes = Notes()
    notes.stop_requested = lambda: clock.now >= asked_at
    loop = TrainingLoop(
        collector, SimpleNamespace(experience="rollout", update=lambda batch: {}), ScriptedJudge([lap(1, None)] * 3),
        notes, notes, RolloutConfig(num_worlds=1, horizon=1), EvaluationConfig(every=100), parse_stops([stop]),
        SimpleNamespace(add=lambda batch: batch),
    )  # fmt: skip
    return loop.run("scripted")


def test_a_training_that_fails_says_so_where_it_would_say_why_it_stopped():
    def fails(batch):
        raise DivergedError("the losses are no numbers")

    learner = SimpleNamespace(experience="rollout", update=fails)
    notes = Notes()
    loop = TrainingLoop(
        Collector(), learner, ScriptedJudge([]), notes, notes, RolloutConfig(num_worlds=1, horizon=1),
        EvaluationConfig(), parse_stops(["iterations=3"]), SimpleNamespace(add=lambda batch: "what was collected"),
    )  # fmt: skip
    with pytest.raises(DivergedError):
        loop.run("scripted")
    assert notes.reasons == ["an error"]
