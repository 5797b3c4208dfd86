"""Whatever a racer has on the disk, `read` finds the rows and says where they come from."""

import json
import re

import polars as pl
import pytest
from tests.worlds.deepracer.logs import makers

from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.logs import LogError, read
from racecraft.worlds.deepracer.logs.log_rows import what_it_says


def origins(logs):
    """Return (round, phase, stream, worker, iteration) → rows."""
    table = logs.ticks.group_by("round", "phase", "stream", "worker", "iteration").agg(pl.len()).collect()
    return {tuple(map(str, row[:5])): row[5] for row in table.rows()}


def test_one_worker_of_deepracer_for_cloud(tmp_path):
    logs = read(makers.drfc(tmp_path))
    assert origins(logs) == {("1", "training", "", "0", "0"): 36, ("1", "training", "", "0", "1"): 36}
    assert logs.damaged == ()


def test_twelve_workers_of_deepracer_for_cloud_are_told_apart(tmp_path):
    logs = read(makers.drfc(tmp_path, workers=12, iterations=1))
    assert sorted({int(key[3]) for key in origins(logs)}) == list(range(12))


def test_an_evaluation_beside_a_training_is_an_evaluation(tmp_path):
    makers.drfc(tmp_path)
    makers.write(tmp_path / "evaluation-20220709200242/evaluation-simtrace/0-iteration.csv", makers.lap_by_lap())
    found = origins(read(tmp_path))
    assert found["1", "evaluation", "20220709200242", "0", "0"] == 30
    assert read(tmp_path).evaluations.collect()["unique_episode"].unique().to_list() == [6, 7, 8]


def test_a_console_folder_and_its_archive_say_the_same(tmp_path):
    home = tmp_path / "console"
    makers.write(home / "sim-trace/training/training-simtrace/0-iteration.csv", makers.iteration(range(2)))
    evaluation = home / "sim-trace/evaluation/20220611205309-abc/evaluation-simtrace/0-iteration.csv"
    makers.write(evaluation, makers.lap_by_lap(2))
    submission = home / "logs/leaderboard/leaderboard-20220612000000-xyz-robomaker.log"
    submission.parent.mkdir(parents=True)
    submission.write_text(makers.log_text(makers.lap_by_lap(3)))
    doubled = home / "logs/training/training-20220611205309-xyz-robomaker.log"
    doubled.parent.mkdir(parents=True)
    doubled.write_text(makers.log_text(makers.iteration(range(2))))
    unpacked = read(home)
    assert origins(unpacked) == {
        ("1", "training", "", "0", "0"): 24,
        ("1", "evaluation", "20220611205309-abc", "0", "0"): 20,
        ("1", "leaderboard", "leaderboard-20220612000000-xyz-robomaker", "0", "0"): 30,
    }
    packed = read(makers.packed(home, tmp_path / "model.tar.gz"))
    assert packed.ticks.collect().drop("file").equals(unpacked.ticks.collect().drop("file"))


def test_an_archive_of_deepracer_on_aws(tmp_path):
    home = tmp_path / "droa"
    stamp = "2026-03-06T18:33:59.511Z-deepracerindy-training-abcdefghijklmno"
    makers.write(home / f"sim-trace/training/{stamp}/training-simtrace/0-iteration.csv", makers.iteration(range(2)))
    judged = "2026-03-07T18:33:59.511Z-deepracerindy-evaluation-abcdefghijklmno"
    makers.write(home / f"sim-trace/evaluation/{judged}/evaluation-simtrace/0-iteration.csv", makers.lap_by_lap())
    log = home / f"logs/training/{stamp}-simulation.log"
    log.parent.mkdir(parents=True)
    log.write_text(makers.log_text(makers.iteration(range(2)), prefix="[node-1] [agent-9] "))
    found = origins(read(makers.packed(home, tmp_path / "logs.tar.gz")))
    assert found == {("1", "training", "", "0", "0"): 24, ("1", "evaluation", judged, "0", "0"): 30}


def test_a_zip_that_is_called_tar_gz_is_read(tmp_path):
    import zipfile

    makers.drfc(tmp_path / "model")
    with zipfile.ZipFile(tmp_path / "model.tar.gz", "w") as archive:
        for path in (tmp_path / "model").rglob("*.csv"):
            archive.write(path, path.relative_to(tmp_path))
    assert read(tmp_path / "model.tar.gz").ticks.collect().height == 72


def test_several_folders_are_rounds_of_one_training(tmp_path):
    paths = [makers.drfc(tmp_path / name) for name in ("first", "second")]
    frame = read(paths).ticks.collect()
    assert frame["round"].unique().to_list() == [1, 2]
    assert frame["unique_episode"].n_unique() == 12
    assert origins(read(tmp_path)) == origins(read(paths)), "a folder of models is as many rounds"


def test_our_own_run_folder(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "deepracer", "track": {"name": "reinvent_base"}})
    columns = {
        "episode": [0, 0, 0, 1], "world": [0, 0, 1, 0], "iteration": [1, 1, 1, 1], "tick": [1, 2, 1, 1],
        "time_s": [0.0, 0.1, 0.0, 0.2],
    }  # fmt: skip
    write_episodes(run.episodes / "1.parquet", columns)
    logs = read(run.path)
    frame = logs.ticks.collect()
    assert frame["iteration"].to_list() == [0] * 4, "counted from 0, as everybody else does"
    assert frame.select("worker", "episode", "unique_episode").rows() == [(0, 0, 0), (0, 0, 0), (0, 1, 1), (1, 0, 2)]
    assert logs.about["world"] == "reinvent_base"


def test_a_lap_of_ours_that_goes_on_over_iterations_is_one(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "deepracer", "track": {"name": "reinvent_base"}})
    for k, first in enumerate((1, 4, 7), 1):  # two worlds drive on; after the second, world 1 begins anew
        again = k == 3
        columns = {
            "episode": [0, 0, 0, *[int(again)] * 3], "world": [0, 0, 0, 1, 1, 1], "iteration": [k] * 6,
            "tick": [first, first + 1, first + 2, *(t if again else t + first - 1 for t in (1, 2, 3))],
            "time_s": [first / 15.0] * 6,
        }  # fmt: skip
        write_episodes(run.episodes / f"{k}.parquet", columns)
    frame = read(run.path).ticks.collect()
    told = frame.group_by("unique_episode", "worker", "episode", maintain_order=True).agg("tick", "iteration")
    assert told.rows() == [
        (0, 0, 0, list(range(1, 10)), [0, 0, 0, 1, 1, 1, 2, 2, 2]),
        (1, 1, 0, list(range(1, 7)), [0, 0, 0, 1, 1, 1]),
        (2, 1, 1, [1, 2, 3], [2, 2, 2]),
    ]


def test_the_text_of_a_simulation_log(tmp_path):
    path = tmp_path / "sim-abc.log"
    path.write_text(makers.log_text(makers.iteration(range(6)), episodes_per_iteration=2))
    logs = read(path)
    frame = logs.ticks.collect()
    assert frame.group_by("iteration", maintain_order=True).agg(pl.col("episode").unique()).rows() == [
        (0, [0, 1]), (1, [2, 3]), (2, [4, 5]),
    ]  # fmt: skip
    assert logs.about["world"] == "reinvent_base"
    assert path.read_text().splitlines()[frame["line"][0] - 1].startswith("SIM_TRACE_LOG:0,1,")
    text = makers.log_text(makers.iteration(range(6), continuous=True))
    path.write_text(re.sub(r"\[(\S+) (\S+)\]", r"[\1, \2]", text))  # as the console wrote continuous actions in 2023
    continuous = read(path).ticks.collect()
    assert (continuous.height, continuous["action"].unique().to_list()) == (frame.height, [-1])


@pytest.mark.parametrize("has_traces", [False, True])
def test_what_a_reward_printed_belongs_to_the_row_behind_it(tmp_path, has_traces):
    columns = makers.iteration(range(2))
    lines = makers.log_text(columns).splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("SIM_TRACE_LOG:"))
    for row, text in ((17, "too slow"), (5, "too slow, again"), (0, "too slow: a line of the head")):
        lines.insert(first + row, f"[node-1] {text}")
    log = tmp_path / "logs/training/training-20220611205309-xyz-robomaker.log"
    log.parent.mkdir(parents=True)
    log.write_text("\n".join(lines))
    if has_traces:
        makers.write(tmp_path / "sim-trace/training/training-simtrace/0-iteration.csv", columns)
    found = read(tmp_path)
    assert [found.printed(text).tolist() for text in ("too slow", "again", "fast")] == [[5, 17], [5], []]


def test_a_log_that_rolled_over_is_read_in_the_order_it_was_written(tmp_path):
    whole = makers.log_text(makers.iteration(range(4)), episodes_per_iteration=2).splitlines(keepends=True)
    third = len(whole) // 3
    parts = {"a.log.1": whole[:third], "a.log.2": whole[third : 2 * third], "a.log": whole[2 * third :]}
    for name, lines in parts.items():
        (tmp_path / name).write_text("".join(lines))
    frame = read(tmp_path / "a.log").ticks.collect()
    assert (frame.height, frame["file"].n_unique()) == (48, 3)
    assert frame["unique_episode"].to_list() == frame["episode"].to_list(), "an episode goes on in the next piece"
    assert frame["iteration"].to_list() == (frame["episode"] // 2).to_list()


def test_a_bare_trace_and_a_bare_folder_of_traces(tmp_path):
    makers.write(tmp_path / "3-iteration.csv", makers.iteration(range(9, 12)))
    assert (
        origins(read(tmp_path / "3-iteration.csv")) == origins(read(tmp_path)) == {("1", "training", "", "0", "3"): 36}
    )


def test_metrics_alone(tmp_path):
    row = {"reward_score": 3, "metric_time": 2500, "start_time": 500, "elapsed_time_in_milliseconds": 2000,
           "completion_percentage": 40, "episode_status": "Off track"}  # fmt: skip
    rows = [row | {"episode": k + 1, "trial": k % 2 + 1, "phase": "training"} for k in range(4)]
    rows.insert(2, row | {"episode": 2, "trial": 2, "phase": "evaluation"})
    path = tmp_path / "TrainingMetrics.json"
    path.write_text(json.dumps({"metrics": rows, "version": 2.0, "best_model_metric": "progress"}))
    table = read(path).metrics.collect()
    assert table["iteration"].to_list() == [0, 0, 0, 1, 1]
    assert table["phase"].to_list() == ["training", "training", "evaluation", "training", "training"]
    assert table.row(0, named=True) | {"file": 0} == {
        "round": 1, "phase": "training", "stream": "", "worker": 0, "iteration": 0, "episode": 0, "trial": 1,
        "reward": 3.0, "start_s": 0.5, "seconds": 2.0, "progress_share": 0.4, "status": "off_track", "resets": None,
        "steps": None,
        "file": 0,
    }  # fmt: skip


def test_nothing_there_is_said_with_what_is_expected(tmp_path):
    with pytest.raises(LogError, match="no such file or folder"):
        read(tmp_path / "nowhere")
    with pytest.raises(LogError, match="no log was found there; expected a run folder"):
        read(tmp_path)
    with pytest.raises(LogError, match="Did you mean 'training'"):
        read(tmp_path, phase="trainin")


def test_a_half_downloaded_archive_is_a_letter(tmp_path):
    makers.drfc(tmp_path / "model")
    path = makers.packed(tmp_path / "model", tmp_path / "model.tar.gz")
    path.write_bytes(path.read_bytes()[:-400])
    with pytest.raises(LogError, match="damaged .* download it again"):
        read(path)


def test_a_track_name_that_roslaunch_cut_off_is_not_taken_for_the_track():
    cut = b" * /WORLD_NAME: 2022_reinvent_cha...\n"
    assert "world" not in what_it_says(cut)
    assert what_it_says(cut + b"{'JOB_TYPE': 'TRAINING', 'WORLD_NAME': '2022_reinvent_champ_ccw'}")["world"] == (
        "2022_reinvent_champ_ccw"
    )
    assert what_it_says(b"WORLD_NAME: reinvent_base\n")["world"] == "reinvent_base"
