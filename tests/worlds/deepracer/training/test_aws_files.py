"""AWS's files of a training: cut by hand, unharmed by a kill, and read by AWS's own tools."""

import errno
import itertools
import json
import logging
import shutil
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from racecraft.algorithms.ppo import PpoLearner
from racecraft.formats.atomic import OutputFileError
from racecraft.formats.checkpoint import Checkpoints, load_state, save_state
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.training.callbacks import EvaluationResult, IterationReport, NullCallback
from racecraft.training.loop import TrainingLoop
from racecraft.training.run_writer import RunWriter
from racecraft.worlds.deepracer.evaluation.drive import DriveKeeper
from racecraft.worlds.deepracer.evaluation.laps import judge_laps
from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder, read_checkpoint_marks
from racecraft.worlds.deepracer.files.training_metrics import read_metrics_file
from racecraft.worlds.deepracer.files.training_params import read_params
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
from racecraft.worlds.deepracer.training.aws.episodes import STATUSES, TICK, EpisodeCutter
from racecraft.worlds.deepracer.training.aws.files import AwsFiles
from racecraft.worlds.deepracer.training.aws.setup import aws_setup
from racecraft.worlds.deepracer.training.evaluator import CarEvaluator
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car
from racecraft.worlds.deepracer.training.recorder import EpisodeRecorder
from racecraft.worlds.deepracer.training.trainer import race_world

TINY = (
    "camera.width=16", "camera.height=12", "race.max_episode_seconds=4",
    "rollout.num_worlds=6", "rollout.horizon=40", "evaluation.episodes=2",
    "ppo.epochs=1", "runtime.threads=1", "network.conv_filters=4", "network.conv_kernels=4", "network.conv_strides=2",
    "network.hidden_units=16",
)  # fmt: skip
EPISODES = 4
"""Of one of AWS's iterations here."""


class TinyTraining:
    """A real training of a tiny car, put together by hand."""

    def __init__(self, folder, iterations, whole_episodes=False, every=1, callback=None, **more):
        sets = (*TINY, f"rollout.episodes_per_iteration={2 * 6}") if whole_episodes else TINY
        sets = (*sets, f"evaluation.every={every}")
        plan = plan_car(RaceRequest(preset="fast", overrides=sets, stops=(f"iterations={iterations}",)))
        self.run = RunFolder.open(folder) if (folder / "job.json").exists() else RunFolder.create(folder)
        world, judged = race_world(plan, 6, lambda params: float(params["speed"])), race_world(plan, 2)
        self.learner = PpoLearner(world.spec, plan.settings.network, plan.settings.ppo, 1)
        recorder = EpisodeRecorder()
        self.collector = Collector(world, self.learner, 40, 1, observers=[recorder])
        given = plan.model.hyperparameters
        given = type(given)(num_episodes_between_training=EPISODES)
        setup = aws_setup(plan.track.name, plan.settings, plan.model.metadata, given, env={"DR_CAR_COLOR": "Blue"})
        self.aws = AwsFiles(folder, setup)
        self.keeper = RunWriter(self.run, self.learner, self.collector, {}, recorder, self.aws, **more)
        judge = CarEvaluator(judged, GreedyPolicy(self.learner))
        settings = plan.settings
        self.loop = TrainingLoop(
            self.collector, self.learner, judge, self.keeper, callback or NullCallback(), settings.rollout,
            settings.evaluation, plan.stops,
        )  # fmt: skip

    def train(self):
        self.loop.run("tiny")
        return self

    def resume(self):
        from racecraft.algorithms.weights import to_tensors

        shelf = Checkpoints(self.run.checkpoints)
        state, (weights, _) = shelf.load_state("last"), shelf.load_policy("last")
        self.learner.load_state_dict(to_tensors({"network": weights, **state["learner"]}))
        self.collector.restore(state["collector"])
        self.loop.restore(state["loop"])
        self.keeper.restore(state)
        return self


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """The run folder of three iterations."""
    folder = tmp_path_factory.mktemp("runs") / "tiny"
    training = TinyTraining(folder, 3).train()
    keeper = DriveKeeper()
    world = race_world(plan_car(RaceRequest(preset="fast", overrides=TINY)), 1)
    judge_laps(GreedyPolicy(training.learner), world, 2, [keeper])
    return SimpleNamespace(path=folder, drive=keeper.drive, place=AwsModelFolder(folder))


def rows_of(place, phase):
    return [row for row in read_metrics_file(place.training_metrics).rows if row.phase == phase]


def test_traces_hold_whole_episodes_numbered_without_gaps_on_one_clock(trained):
    """By law, over all traces: blocks of E, first rows prepare, last rows done, a tick of 1/15 s between rows."""
    traces = [read_sim_trace(path).columns for path in trained.place.training_traces().values()]
    assert list(trained.place.training_traces()) == list(range(len(traces)))
    assert len(traces) > 2
    whole = {name: np.concatenate([trace[name] for trace in traces]) for name in traces[0]}
    starts = np.flatnonzero(whole["steps"] == 1)
    for number, trace in enumerate(traces[:-1]):
        assert set(trace["episode"]) == set(range(EPISODES * number, EPISODES * (number + 1)))
    assert_array_equal(whole["episode"][starts], np.arange(len(starts)))
    assert set(whole["episode_status"][starts]) == {"prepare"}
    assert_array_equal(np.flatnonzero(whole["done"]), np.append(starts[1:], len(whole["steps"])) - 1)
    deltas = np.round(np.diff(whole["tstamp"]) * 15, 3)
    inside = np.diff(whole["episode"]) == 0
    assert set(deltas[inside]) == {1.0}
    between = deltas[~inside]
    assert (between >= 1).all()
    assert_array_equal(between, between.round())


def test_traces_and_episode_files_tell_of_the_same_ticks(trained):
    """By twin: every episode that ended stands in the traces, as driven; none stands there twice."""
    import polars as pl

    from racecraft.formats.episodes import read_episodes

    tables = [read_episodes(trained.path / "episodes" / f"{number}.parquet") for number in (1, 2, 3)]
    table = pl.concat(tables).with_columns(pl.col("done").cast(int).sum().over("world", "episode").alias("ended"))
    ours = {
        tuple(part["x_m"].to_list())
        for _, part in table.filter(pl.col("ended") == 1).group_by("world", "episode", maintain_order=True)
    }
    theirs = []
    for path in trained.place.training_traces().values():
        trace = read_sim_trace(path).columns
        theirs += [tuple(trace["X"][trace["episode"] == number]) for number in sorted(set(trace["episode"]))]
    assert len(theirs) == len(set(theirs))
    assert set(theirs) == ours


def test_metrics_tell_of_each_episode_and_of_evaluations_where_they_took_place(trained):
    rows = read_metrics_file(trained.place.training_metrics).rows
    training = rows_of(trained.place, "training")
    assert [row.episode for row in training] == list(range(1, len(training) + 1))
    assert [row.trial for row in training] == [(row.episode - 1) % EPISODES + 1 for row in training]
    assert len(rows_of(trained.place, "evaluation")) == 3 * 2
    for before, row in itertools.pairwise(rows):
        assert row.start_time == before.metric_time
        if row.phase == "evaluation":
            assert (row.episode, row.trial, row.reward_score) == (before.episode, before.trial, 0)
    trace = read_sim_trace(trained.place.training_trace(0)).columns
    first = trace["episode"] == 0
    assert training[0].reward_score == round(trace["reward"][first].sum())
    assert training[0].metric_time == round(trace["tstamp"][first][-1] * 1000)
    assert training[0].completion_percentage == int(trace["progress"][first][-1])


def test_the_log_tells_the_ticks_of_the_traces(trained):
    log = read_sim_trace(trained.place.simulation_log).columns
    full = [read_sim_trace(path).columns for path in trained.place.training_traces().values()][:-1]
    ticks = sum(len(trace["steps"]) for trace in full)
    assert len(log["steps"]) in (
        ticks,
        ticks + len(read_sim_trace(trained.place.training_trace(len(full))).columns["X"]),
    )
    np.testing.assert_allclose(log["X"][: len(full[0]["X"])], full[0]["X"], atol=5e-5)
    text = trained.place.simulation_log.read_text()
    assert text.count("Training> Name") == len(set(log["episode"]))
    assert "Training iteration=1" in text
    assert text.count("Policy training>") <= 3


def test_files_said_once_tell_what_is_used(trained):
    params = read_params(trained.place.training_params)
    assert params["WORLD_NAME"] == "reinvent_base"
    assert (params["CAR_COLOR"], params["CAR_NAME"], params["DISPLAY_NAME"]) == ("Blue", "FastCar", "FastCar")
    assert (params["MIN_EVAL_TRIALS"], params["ROUND_ROBIN_ADVANCE_DIST"]) == ("2", "0.05")
    learned = json.loads(trained.place.hyperparameters.read_text())
    assert (learned["num_epochs"], learned["num_episodes_between_training"]) == (1, EPISODES)
    best, last = read_checkpoint_marks(trained.place.checkpoint_marks)
    assert (last.iteration, last.steps) == (3, 720)
    assert best.score == max(entry.score for entry in Checkpoints(trained.path / "checkpoints").entries()[1:])
    assert (trained.path / "checkpoints" / f"{best.iteration}.policy.safetensors").exists()


def test_what_ran_stands_in_the_files_and_not_what_a_run_env_asked_for_in_vain(tmp_path):
    sets = (*TINY, "race.start_offset=0.25", "race.reverse=true", "race.change_start=false", "ppo.exploration=e-greedy",
            "ppo.epsilon_last=0.2", "ppo.epsilon_steps=77")  # fmt: skip
    plan = plan_car(RaceRequest(overrides=sets))
    asked_in_vain = {"DR_TRAIN_ALTERNATE_DRIVING_DIRECTION": "True", "DR_TRAIN_START_POSITION_OFFSET": "0.5",
                     "DR_ENABLE_DOMAIN_RANDOMIZATION": "True"}  # fmt: skip
    setup = aws_setup("oval", plan.settings, plan.model.metadata, plan.model.hyperparameters, env=asked_in_vain)
    AwsFiles(tmp_path, setup).begin()
    place = AwsModelFolder(tmp_path)
    params, learned = read_params(place.training_params), json.loads(place.hyperparameters.read_text())
    assert {name: params[name] for name in WHAT_RAN} == WHAT_RAN
    explored = ("exploration_type", "e_greedy_value", "epsilon_steps")
    assert [learned[name] for name in explored] == ["e-greedy", 0.2, 77]


WHAT_RAN = {
    "START_POSITION_OFFSET": "0.25", "REVERSE_DIR": "True", "CHANGE_START_POSITION": "False",
    "ALTERNATE_DRIVING_DIRECTION": "False", "ENABLE_DOMAIN_RANDOMIZATION": "False",
}  # fmt: skip


def test_an_evaluation_at_the_very_end_is_told_to_strangers_too(tmp_path):
    """By twin: AWS's marks name the checkpoints that ours do, and a resume keeps the late evaluation's rows."""
    training = TinyTraining(tmp_path / "run", 3, every=2).train()
    place, ours = AwsModelFolder(training.run.path), Checkpoints(training.run.checkpoints)
    best, last = read_checkpoint_marks(place.checkpoint_marks)
    assert (best.iteration, last.iteration) == (ours.find("best").iteration, 3)
    assert [last.score, best.score] == [ours.find("last").score, ours.find("best").score]
    assert last.score is not None
    assert len(rows_of(place, "evaluation")) == 2 * 2
    before = rows_of(place, "evaluation")
    TinyTraining(tmp_path / "run", 4, every=2).resume().train()
    assert rows_of(place, "evaluation")[:4] == before
    best, last = read_checkpoint_marks(place.checkpoint_marks)
    assert (best.iteration, last.iteration) == (Checkpoints(training.run.checkpoints).find("best").iteration, 4)


@pytest.fixture
def deepracer(monkeypatch, caplog):
    """The community's own tools; whatever they warn of becomes an error."""
    warnings.simplefilter("error")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the packages they import, on import
        logs = pytest.importorskip("deepracer.logs", reason="deepracer-utils is not installed")
    for name in ("AWS_DEFAULT_REGION", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.setenv(name, "us-east-1")
    yield logs
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING] == []


def test_deepracer_utils_reads_the_training(trained, deepracer):
    log = deepracer.DeepRacerLog(model_folder=str(trained.path))
    log.load()
    frame = log.dataframe()
    assert log.fh.type.name == "DRFC_MODEL_SINGLE_WORKERS"
    training = rows_of(trained.place, "training")
    assert sorted(set(frame["unique_episode"])) == list(range(len(training)))
    assert len(log.action_space()) == 10
    assert log.agent_and_network()["sensor_list"] == ["FRONT_FACING_CAMERA"]
    assert log.hyperparameters()["num_episodes_between_training"] == EPISODES
    table = deepracer.AnalysisUtils.simulation_agg(frame, add_tstamp=True)
    assert len(table) == len(training)
    for (_, row), known in zip(table.iterrows(), training, strict=True):
        assert row["steps"] == round(known.elapsed_time_in_milliseconds * 15 / 1000)
        assert int(row["progress"]) == known.completion_percentage
        assert round(row["reward"]) == known.reward_score
    assert 66 < log.stability.analyze()["avg_ms"].max() < 67


def test_deepracer_utils_reads_the_metrics(trained, deepracer):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it makes a client of AWS that nobody asks for
        metrics = deepracer.metrics.TrainingMetrics("bucket", fname=str(trained.place.training_metrics))
    training = metrics.getTraining()
    assert len(training) == len(rows_of(trained.place, "training"))
    assert_array_equal(training["iteration"], (training["episode"] - 1) // EPISODES)
    summary = metrics.getSummary()
    assert summary["eval_episodes"].sum() == 6
    assert summary["train_episodes"].iloc[0] == EPISODES


def test_deepracer_utils_reads_an_evaluation(trained, deepracer):
    from racecraft.worlds.deepracer.training.aws.evaluation import write_aws_evaluation

    plan = plan_car(RaceRequest(preset="fast", overrides=TINY))
    stamps = {write_aws_evaluation(trained.path, trained.drive, 2, plan.track.length) for _ in range(2)}
    assert len(stamps) == 2
    log = deepracer.DeepRacerLog(model_folder=str(trained.path))
    log.load_evaluation_trace()
    frame = log.dataframe()
    assert set(frame["stream"]) == stamps
    table = deepracer.AnalysisUtils.simulation_agg(frame, firstgroup="stream", is_eval=True)
    assert len(table) == 4
    rows = read_metrics_file(trained.place.evaluation_metrics(min(stamps))).rows
    assert [row.trial for row in rows] == [1, 2]
    assert rows[1].start_time == rows[0].metric_time
    assert list(table["progress"][:2].astype(int)) == [row.completion_percentage for row in rows]
    trace = read_sim_trace(trained.place.evaluation_trace(min(stamps))).columns
    assert trace["episode_status"][0] == "prepare"
    assert trace["done"][-1]
    for name, radians in (("steer", np.degrees(plan.actions.steering)), ("throttle", plan.actions.speed)):
        np.testing.assert_allclose(np.array(radians)[trace["action"]], trace[name], atol=1e-6)


@pytest.mark.parametrize("whole_episodes", [False, True])
def test_a_training_that_was_broken_off_leaves_the_same_files(tmp_path, whole_episodes):
    """By twin: three iterations at one go, and one, a kill that lost all that came later, and two."""
    at_once, killed = tmp_path / "at_once", tmp_path / "killed"
    TinyTraining(at_once, 3, whole_episodes).train()
    TinyTraining(killed, 1, whole_episodes).loop.run("killed, nothing is closed")
    shutil.copytree(killed / "checkpoints", tmp_path / "kept")
    late = TinyTraining(killed, 2, whole_episodes).resume()
    late.train()  # and as if its checkpoint had not been reached: all of AWS's files are ahead of it
    shutil.rmtree(killed / "checkpoints")
    shutil.copytree(tmp_path / "kept", killed / "checkpoints")
    (killed / "training-simtrace" / "77-iteration.csv").write_text("of the future")
    TinyTraining(killed, 3, whole_episodes).resume().train()
    one, two = files_for_strangers(at_once), files_for_strangers(killed)
    assert one.keys() == two.keys()
    for name, text in one.items():
        assert two[name] == text, name


def files_for_strangers(folder):
    """Return what AWS's files hold, by name; moments of the day left out."""
    place = AwsModelFolder(folder)
    paths = [place.training_metrics, place.simulation_log, place.training_params, *place.training_traces().values()]
    marks = [(mark.name, mark.score) for mark in read_checkpoint_marks(place.checkpoint_marks)]
    return {**{str(path.relative_to(folder)): path.read_bytes() for path in paths}, "marks": marks}


def test_cars_parked_after_their_quota_add_no_episodes(tmp_path):
    """With a quota of 2 for 6 cars: twelve episodes in each of our iterations."""
    training = TinyTraining(tmp_path / "run", 2, whole_episodes=True).train()
    assert len(rows_of(AwsModelFolder(training.run.path), "training")) == 2 * 12


def table(*cars, status="in_progress"):
    """Return columns of N cars; a car is a list of (tick, done)."""
    ticks = np.array([tick for car in cars for tick, _ in car])
    columns = {name: np.zeros(len(ticks)) for name in TICK.names}
    world = np.repeat(np.arange(len(cars)), [len(car) for car in cars])
    done = np.array([done for car in cars for _, done in car])
    x = world * 100.0 + ticks
    return {**columns, "tick": ticks, "done": done, "world": world, "x_m": x, "status": np.full(len(ticks), status)}


def test_episodes_come_in_the_order_in_which_they_end():
    """By hand: car 1 ends first, car 0 and car 2 end together, car 1 goes on into the next call."""
    cutter = EpisodeCutter()
    first = cutter.cut(
        table(
            [(1, False), (2, False), (3, True)],
            [(1, False), (2, True), (1, False)],
            [(1, False), (2, False), (3, True)],
        )
    )
    assert [episode["x_m"].tolist() for episode in first] == [[101, 102], [1, 2, 3], [201, 202, 203]]
    assert {STATUSES[episode["status"][-1]] for episode in first} == {"time_up"}
    state = load_back(cutter.state())
    later = EpisodeCutter()
    later.restore(state)
    for one in (cutter, later):
        second = one.cut(table([(1, False)], [(2, True)], [(1, True)]))
        assert [episode["x_m"].tolist() for episode in second] == [[101, 102], [201]]
    assert [len(cutter.cut(table([(2, True)], [(1, False)], [(1, False)])))] == [1]


def test_cars_of_one_world_have_episodes_of_their_own():
    cutter = EpisodeCutter()
    columns = table([(1, False), (2, True)], [(1, False), (2, False)], [(1, True), (1, False)])
    columns["world"], columns["agent"] = np.array([0, 0, 0, 0, 1, 1]), np.array([0, 0, 1, 1, 0, 0])
    assert [episode["x_m"].tolist() for episode in cutter.cut(columns)] == [[201], [1, 2]]


def test_episodes_broken_off_or_joined_late_are_left_out():
    cutter = EpisodeCutter()
    assert cutter.cut(table([(1, False), (2, False)], [(5, False), (6, True)])) == []  # car 1 began before we came
    episodes = cutter.cut(table([(1, False), (2, True)], [(1, False), (1, False), (2, True)]))
    assert [len(episode) for episode in episodes] == [2, 2]
    assert cutter.cut({name: part[:0] for name, part in table([(1, True)]).items()}) == []


def load_back(state):
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        save_state(f"{folder}/s", state)
        return load_state(f"{folder}/s")


def report(iteration, laps=()):
    result = EvaluationResult(50.0, False, details={"laps": list(laps)}) if laps else None
    losses = {"policy_loss": 0.1, "approx_kl": 0.01, "entropy": 2.0}
    return IterationReport(iteration, 10 * iteration, 0.0, 0.0, 0, None, None, losses, result, False)


def small_files(folder):
    plan = plan_car(RaceRequest())
    files = AwsFiles(folder, aws_setup("oval", plan.settings, plan.model.metadata, plan.model.hyperparameters))
    files.begin()
    return files


def with_length(columns):
    return {**columns, "track_length_m": np.full(len(columns["tick"]), 17.7)}


def test_laps_judged_before_the_first_episode_ends_wait_for_it(tmp_path):
    lap = {"steps": 30, "progress_percent": 99.99, "status": "truncated"}
    files = small_files(tmp_path)
    files.keep(with_length(table([(1, False)])), report(1, [lap]))
    assert not (tmp_path / "metrics" / "TrainingMetrics.json").exists()
    state = load_back(files.state())
    files.close()
    files = AwsFiles(tmp_path, files._setup)
    files.restore(state)
    files.keep(with_length(table([(2, True)])), report(2, [lap]))
    files.close()
    rows = read_metrics_file(tmp_path / "metrics" / "TrainingMetrics.json").rows
    assert [(row.phase, row.episode, row.trial, row.metric_time) for row in rows] == [
        ("training", 1, 1, 133),
        ("evaluation", 1, 1, 2133),
        ("evaluation", 1, 1, 4133),
    ]
    assert rows[1].completion_percentage == 99
    assert rows[1].episode_status == "Time Up"
    assert len(read_sim_trace(tmp_path / "training-simtrace" / "0-iteration.csv")) == 2  # closed before it was full


def test_a_full_disk_is_told_at_the_next_iteration_and_costs_nothing_that_stood(tmp_path, monkeypatch):
    from racecraft.formats import atomic

    files = small_files(tmp_path)
    files.keep(with_length(table([(1, False), (2, True)])), report(1))
    files._background.call_done(wait=True)
    before = (tmp_path / "metrics" / "TrainingMetrics.json").read_bytes()

    def full(path):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(atomic, "_to_disk", full)
    files.keep(with_length(table([(1, False), (2, True)])), report(2))
    with pytest.raises(OutputFileError, match="the disk is full"):
        files._background.call_done(wait=True)
    assert (tmp_path / "metrics" / "TrainingMetrics.json").read_bytes() == before
    with pytest.raises(OutputFileError):
        files.close()
    assert read_metrics_file(tmp_path / "metrics" / "TrainingMetrics.json").rows


def test_a_training_begun_anew_takes_away_the_traces_of_the_one_before(tmp_path):
    (tmp_path / "training-simtrace").mkdir()
    (tmp_path / "training-simtrace" / "3-iteration.csv").write_text("old")
    (tmp_path / "training-simtrace" / "mine.csv").write_text("kept")
    small_files(tmp_path).close()
    assert [path.name for path in (tmp_path / "training-simtrace").iterdir()] == ["mine.csv"]
