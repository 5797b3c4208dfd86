"""Simulation traces and logs: real ones come back byte for byte, and AWS's own tools read ours."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tests.reference import HAS_ALL, TRACES

from racecraft.contract.errors import ContractError
from racecraft.formats.episodes import read_episodes, write_episodes
from racecraft.worlds.deepracer.files.hyperparameters import default_hyperparameters
from racecraft.worlds.deepracer.files.model_metadata import default_model_metadata
from racecraft.worlds.deepracer.files.sim_trace import (
    NAMES,
    episodes_from_trace,
    sim_trace_text,
    trace_from_episodes,
    write_sim_trace,
)
from racecraft.worlds.deepracer.files.simulation_log import (
    checkpoint_line,
    episode_line,
    log_head,
    trace_lines,
    update_line,
)
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace


def data(*parts):
    return TRACES.joinpath(*parts)


def small_trace(episodes=2, ticks=3, continuous=False):
    """A trace of `episodes` episodes of `ticks` ticks each."""
    total = episodes * ticks
    last = np.tile(np.arange(ticks) == ticks - 1, episodes)
    status = np.where(last, "off_track", np.where(np.tile(np.arange(ticks), episodes) == 0, "prepare", "in_progress"))
    return {
        "episode": np.repeat(np.arange(episodes), ticks),
        "steps": np.tile(np.arange(1.0, ticks + 1), episodes),
        "X": np.linspace(0, 1, total),
        "Y": np.linspace(-1, 0, total),
        "yaw": np.full(total, -12.5),
        "steer": np.full(total, -30.0),
        "throttle": np.full(total, 0.6),
        "action": np.full(total, -1 if continuous else 0),
        "reward": np.linspace(0, 0.5, total),
        "done": last,
        "all_wheels_on_track": ~last,
        "progress": np.linspace(0, 100, total),
        "closest_waypoint": np.arange(total),
        "track_len": np.full(total, 17.67),
        "tstamp": 20 + np.arange(total) / 15,
        "episode_status": status,
        "pause_duration": np.zeros(total),
        "obstacle_crash_counter": np.zeros(total, int),
        "wall_clock": 1.6e9 + np.arange(total),
    }


def test_every_real_trace_comes_back_byte_for_byte():
    paths = sorted(data().glob("**/*-iteration.csv"))
    assert len(paths) > (60 if HAS_ALL else 40)
    counts = set()
    for path in paths:
        trace = read_sim_trace(path)
        assert trace.damaged == ()
        assert sim_trace_text(trace.columns).encode() == path.read_bytes(), path
        counts.add(len(trace.columns))
    assert counts == {17, 18, 19}


def test_continuous_actions_are_known_for_what_they_are():
    assert read_sim_trace(data("droa-2026-continuous", "0-iteration.csv")).continuous
    assert not read_sim_trace(data("droa-2026-discrete", "0-iteration.csv")).continuous


def test_columns_are_known_by_name_in_any_order_and_number(tmp_path):
    lines = sim_trace_text(small_trace()).splitlines()
    turned = [",".join(["7", *line.split(",")[14::-1]]) for line in lines]
    turned[0] = turned[0].replace("7,", "my_own,").lower()
    (tmp_path / "t.csv").write_bytes(b"\xef\xbb\xbf" + "\r\n".join(turned).encode())
    trace = read_sim_trace(tmp_path / "t.csv").columns
    assert len(trace) == 15
    for name, values in trace.items():
        assert_array_equal(values, small_trace()[name], err_msg=name)


def test_missing_columns_are_named():
    with pytest.raises(ContractError, match="needs the columns episode, steps"):
        sim_trace_text({})


def test_a_trace_becomes_episodes_and_a_trace_again(tmp_path):
    """Degrees become radians and back: equal to 1e-9, commanded values exactly."""
    trace = small_trace()
    write_episodes(tmp_path / "e.parquet", episodes_from_trace(trace, iteration=3))
    frame = read_episodes(tmp_path / "e.parquet")
    assert frame["yaw_rad"][0] == pytest.approx(-0.2181661565)
    assert frame["progress_share"].max() == 1.0
    assert set(frame["iteration"]) == {3}
    again = trace_from_episodes({name: frame[name].to_numpy() for name in frame.columns})
    assert list(again) == list(NAMES)
    for name, values in trace.items():
        if values.dtype.kind == "f":
            assert_allclose(again[name], values, rtol=0, atol=1e-9, err_msg=name)
        else:
            assert_array_equal(again[name], values, err_msg=name)
    assert_array_equal(again["steer"], trace["steer"])
    single = {**episodes_from_trace(trace), "steering_rad": np.radians(trace["steer"]).astype(np.float32)}
    assert_array_equal(trace_from_episodes({**single, "status": trace["episode_status"]})["steer"], trace["steer"])
    assert "0,1.0,0.0,-1.0,-12.5,-30.0,0.6,0,0.0,False,True" in sim_trace_text(again)


def test_a_log_gives_its_ticks_back(tmp_path):
    for continuous in (False, True):
        trace = small_trace(continuous=continuous)
        lines = [*log_head("reinvent_base", default_model_metadata(), default_hyperparameters()), *trace_lines(trace)]
        (tmp_path / "log.txt").write_text("\n".join(f"[node-1] [agent-9] {line}" for line in lines) + "\n")
        got = read_sim_trace(tmp_path / "log.txt")
        assert got.continuous == continuous
        assert_allclose(got.columns["X"], trace["X"], atol=5e-5)
        assert_array_equal(got.columns["episode_status"], trace["episode_status"])


def test_a_real_row_is_logged_as_aws_logged_it():
    trace = read_sim_trace(data("droa-2026-continuous", "0-iteration.csv")).columns
    line = trace_lines(trace)[0]
    assert line == (
        "SIM_TRACE_LOG:0,1,-1.4432,-1.7133,179.0009,-25.00,1.33,[-25.0 1.3310375874989868],0.0000,False,True,0.8435,1,"
        "16.60,36.16,prepare,0.00,0,1773215987.6239"
    )


def test_every_value_is_printed_as_python_prints_it():
    """By twin: very small, very large and plain numbers, with `repr` and the formats of the original's log."""
    rng = np.random.default_rng(3)
    values = np.concatenate([[0.0, -0.0, 1e-5, -3e-7, 1.5e-4, 1e16, 2.5e22, 100.0, 1e-4], rng.normal(0, 5, 40)])
    trace = small_trace(1, len(values))
    trace = {**trace, "X": values, "reward": values[::-1].copy(), "yaw": np.full(len(values), 0.00005)}
    rows = [line.split(",") for line in sim_trace_text(trace).splitlines()[1:]]
    assert [row[2] for row in rows] == [str(value) for value in values.tolist()]
    assert [row[8] for row in rows] == [str(value) for value in values[::-1].tolist()]
    logged = [line.split(",") for line in trace_lines(trace)]
    assert [row[2] for row in logged] == [f"{value:.4f}" for value in values.tolist()]
    assert {row[4] for row in logged} == {f"{0.00005:.4f}"}
    assert [row[5] for row in logged] == [f"{value:.2f}" for value in trace["steer"].tolist()]
    assert trace_lines({name: part[:0] for name, part in trace.items()}) == []


@pytest.fixture
def deepracer_log():
    """The community's own reader of logs."""
    return pytest.importorskip("deepracer.logs", reason="deepracer-utils is not installed")


def model_files(folder):
    from racecraft.worlds.deepracer.files.hyperparameters import write_hyperparameters
    from racecraft.worlds.deepracer.files.model_metadata import write_model_metadata

    (folder / "model").mkdir(parents=True)
    (folder / "ip").mkdir()
    write_model_metadata(default_model_metadata(), folder / "model" / "model_metadata.json")
    write_hyperparameters(default_hyperparameters(), folder / "ip" / "hyperparameters.json")


def shifted(trace, by):
    return {**trace, "episode": trace["episode"] + by}


@pytest.mark.parametrize("workers", [1, 3])
def test_deepracer_utils_reads_a_training_of_ours(tmp_path, deepracer_log, workers):
    model_files(tmp_path)
    for worker, iteration in itertools.product(range(workers), range(2)):
        folder = tmp_path / ("" if workers == 1 else str(worker)) / "training-simtrace"
        folder.mkdir(parents=True, exist_ok=True)
        write_sim_trace(folder / f"{iteration}-iteration.csv", shifted(small_trace(), 2 * iteration))
    log = deepracer_log.DeepRacerLog(model_folder=str(tmp_path))
    log.load()
    frame = log.dataframe()
    assert len(frame) == workers * 2 * 6
    assert sorted(set(frame["unique_episode"])) == list(range(workers * 4))
    assert set(frame["steering_angle"]) == {-30.0}
    assert len(log.action_space()) == 10
    assert log.hyperparameters()["batch_size"] == 64


def test_deepracer_utils_reads_an_evaluation_of_ours(tmp_path, deepracer_log):
    model_files(tmp_path)
    for part in ("training-simtrace", "evaluation-20260102030405/evaluation-simtrace"):
        (tmp_path / part).mkdir(parents=True)
        write_sim_trace(tmp_path / part / "0-iteration.csv", small_trace(3, continuous=True))
    log = deepracer_log.DeepRacerLog(model_folder=str(tmp_path))
    log.load_evaluation_trace()
    frame = log.dataframe()
    assert len(frame) == 9
    assert set(frame["stream"]) == {"20260102030405"}
    assert set(frame["action"]) == {-1}


def test_deepracer_utils_reads_a_log_of_ours(tmp_path, deepracer_log):
    text = [*log_head("reinvent_base", default_model_metadata(), default_hyperparameters())]
    text += [episode_line(0, 1, 31.2, 57, 0), update_line(0.1, 0.01, 2.3, 1, 3e-4), checkpoint_line(0, 0)]
    text += trace_lines(small_trace())
    name = "2026-03-06T18:33:59.511Z-deepracerindy-training-abcdefghijklmno"
    (tmp_path / "logs/training").mkdir(parents=True)
    (tmp_path / "sim-trace/training" / name / "training-simtrace").mkdir(parents=True)
    (tmp_path / f"logs/training/{name}-simulation.log").write_text("\n".join(text) + "\n")
    log = deepracer_log.DeepRacerLog(model_folder=str(tmp_path))
    log.load_robomaker_logs()
    assert len(log.dataframe()) == 6
    assert log.hyperparameters()["lr"] == 0.0003
    assert log.action_space()[0] == {"steering_angle": -30.0, "speed": 0.5, "index": 0}
    assert log.agent_and_network()["world"] == "reinvent_base"


def test_episodes_that_lack_what_few_have_become_a_trace_with_noughts():
    episodes = episodes_from_trace(small_trace())
    del episodes["pause_s"], episodes["obstacle_crashes"], episodes["wall_clock_s"]
    trace = trace_from_episodes(episodes)
    for name in ("pause_duration", "obstacle_crash_counter", "wall_clock"):
        assert trace[name].tolist() == [0] * 6
    assert trace["obstacle_crash_counter"].dtype == np.int64


HAIRS = [  # degrees, printed
    (15.000003, "15.0"),
    (15.000005, "15.000005"),
    (12.3456, "12.3456"),
    (12.34563, "12.34563"),
    (12.345633, "12.345633"),
    (-0.0, "0.0"),
    (-0.000001, "0.0"),
]


def test_a_command_a_hair_beside_a_round_number_is_printed_round():
    episodes = episodes_from_trace(small_trace(1, len(HAIRS)))
    speeds = np.array([degrees for degrees, _ in HAIRS])
    rows = sim_trace_text(trace_from_episodes({**episodes, "speed_mps": speeds})).splitlines()[1:]
    assert [row.split(",")[NAMES.index("throttle")] for row in rows] == [printed for _, printed in HAIRS]


def test_only_a_finished_lap_is_printed_without_a_point():
    trace = {**small_trace(1, 4), "progress": np.array([99.99, 100.0, 0.0, 100.5])}
    rows = sim_trace_text(trace).splitlines()[1:]
    assert [row.split(",")[NAMES.index("progress")] for row in rows] == ["99.99", "100", "0.0", "100.5"]


def test_a_log_tells_noughts_of_what_an_old_trace_lacks():
    trace = {name: small_trace(1, 1)[name] for name in NAMES[:15]}
    assert trace_lines(trace) == [
        "SIM_TRACE_LOG:0,1,0.0000,-1.0000,-12.5000,-30.00,0.60,0,0.0000,True,False,0.0000,0,17.67,20.0,in_progress,"
        "0.00,0,0.0000"
    ]


def test_a_log_begins_with_how_it_learns_and_what_drives():
    """The phrases that readers search for: deepracer-utils and log-guru."""
    lines = log_head("Monaco", default_model_metadata(), default_hyperparameters())
    assert lines[:3] == ["Using the following hyper-parameters", "{", '  "batch_size": 64,']
    assert lines[10:12] == ["}", "Action space from file: " + str(
        [{"steering_angle": float(angle), "speed": speed, "index": number} for number, (angle, speed) in
         enumerate(itertools.product((-30, -15, 0, 15, 30), (0.5, 1.0)))]
    )]  # fmt: skip
    assert lines[12:] == [
        " * /WORLD_NAME: Monaco",
        "Sensor list ['FRONT_FACING_CAMERA'], network DEEP_CONVOLUTIONAL_NETWORK_SHALLOW, simapp_version 6, "
        "training_algorithm clipped_ppo, action_space_type discrete",
    ]


def test_lines_of_a_training_are_worded_as_aws_worded_them():
    assert episode_line(1, 2, 31.256, 57, 3) == (
        "Training> Name=main_level/agent, Worker=1, Episode=2, Total reward=31.26, Steps=57, Training iteration=3"
    )
    assert update_line(0.5, 0.25, 1.5, 2, 0.0003) == (
        "Policy training> Surrogate loss=0.5, KL divergence=0.25, Entropy=1.5, training epoch=2, learning_rate=0.0003"
    )
    assert checkpoint_line(3, 40) == "Checkpoint> Saving in path=['./checkpoint_sagemaker/agent/3_Step-40.ckpt']"
