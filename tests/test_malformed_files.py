"""Malformed files: every reader answers each with an error that names the file, in little time and memory."""

import collections
import json
import random
import resource
import time
import zlib

import numpy as np
import pytest
from tests.malformed import (
    DEEP,
    KINDS,
    LONG_NUMBER,
    LONG_TEXT,
    MANY,
    PLACES,
    SURROGATE,
    clear,
    json_bytes,
    put_place,
    within,
)

from racecraft.contract.errors import RacecraftError

ACTIONS = [{"steering_angle": float(angle), "speed": 1.0, "index": k} for k, angle in enumerate((-30, 0, 30))]
HEADER = "episode,steps,X,Y,yaw,steer,throttle,action,reward,done,all_wheels_on_track,progress,closest_waypoint,"
HEADER += "track_len,tstamp,episode_status"
ROWS = [
    f"0,{k}.0,{0.1 * k},0.5,1.0,0.0,1.0,0,1.0,False,True,{k},{k},17.7,{k / 15:.3f},in_progress" for k in range(1, 40)
]
LOG = "\n".join(["started roslaunch server", *(f"SIM_TRACE_LOG:{row}" for row in ROWS), ""])
METRICS = {
    "version": 2,
    "best_model_metric": "progress",
    "metrics": [
        {"reward_score": 12, "metric_time": 900, "start_time": 800, "elapsed_time_in_milliseconds": 100,
         "episode": 1, "trial": 1, "phase": "training", "completion_percentage": 7, "episode_status": "Off track"}
    ],
}  # fmt: skip
GAME = {
    "id": "g", "ruleset": {"name": "standard", "settings": {}}, "map": "standard", "timeout": 500, "source": "",
}  # fmt: skip
TEMPLATE = """Resources:
  Bucket:
    Type: AWS::S3::Bucket
Outputs:
  Name:
    Value: !Ref Bucket
"""
TRAINER_YAML = """behaviors:
  Ball:
    trainer_type: ppo
    hyperparameters:
      batch_size: 64
      learning_rate: 0.0003
    max_steps: 1000
"""
ENV = "DR_WORLD_NAME=reinvent_base\nDR_RACE_TYPE=TIME_TRIAL\nDR_EVAL_MAX_RESETS=4\n"
REWARD = "def reward_function(params):\n    return float(params['speed'])\n"
TEXTS = {
    "model_metadata.json": json_bytes(
        {
            "action_space": ACTIONS,
            "sensor": ["FRONT_FACING_CAMERA"],
            "version": "5",
            "training_algorithm": "clipped_ppo",
            "action_space_type": "discrete",
        }
    ),
    "hyperparameters.json": json_bytes(
        {
            "batch_size": 64,
            "beta_entropy": 0.01,
            "discount_factor": 0.99,
            "exploration_type": "categorical",
            "loss_type": "huber",
            "lr": 0.0003,
            "num_episodes_between_training": 20,
            "num_epochs": 10,
            "term_cond_max_episodes": 100000,
        }
    ),
    "groups.json": json_bytes([{"track": "Oval_track", "cars": 8}, {"track": "reinvent_base", "race": "TIME_TRIAL"}]),
    "metrics.json": json_bytes(METRICS),
    "trace.csv": "\n".join([HEADER, *ROWS, ""]).encode(),
    "training-robomaker.log": LOG.encode(),
    "run.env": ENV.encode(),
    "training_params.yaml": b"WORLD_NAME: reinvent_base\nRACE_TYPE: TIME_TRIAL\nNUMBER_OF_RESETS: 4\n",
    "reward_function.py": REWARD.encode(),
    "template.yaml": TEMPLATE.encode(),
    "trainer.yaml": TRAINER_YAML.encode(),
    "weights.json": json_bytes({"format": "racecraft snake weights", "version": 1, "weights": {"length": 1.0}}),
    "notebook.ipynb": json_bytes({"cells": [{"cell_type": "code", "source": ["x = 1\n"], "outputs": []}]}),
    "job_spec.json": json_bytes({"format": "racecraft job", "version": 1, "command": ["train"], "name": "a"}),
    "game.jsonl": b"\n".join(json.dumps(one).encode() for one in ({"Game": GAME}, {"Turn": 0, "Snakes": []})),
}  # fmt: skip


def readers():
    """Return readers by name: how a file is called, and what reads it."""
    from racecraft.compat.notebooks import cells_of
    from racecraft.formats.checkpoint import Checkpoints
    from racecraft.formats.checkpoint_ranking import ranked
    from racecraft.formats.demonstrations import read_demonstrations
    from racecraft.formats.episodes import read_episodes
    from racecraft.formats.job_spec import read_job_spec
    from racecraft.formats.population import read_population
    from racecraft.formats.run_folder import RunFolder
    from racecraft.sagemaker.cloudformation.template import read_template
    from racecraft.worlds.battlesnake.env.records import read_games
    from racecraft.worlds.battlesnake.evaluation.imported import import_game
    from racecraft.worlds.battlesnake.evaluation.record import read_record
    from racecraft.worlds.battlesnake.players.weights import read_weights
    from racecraft.worlds.deepracer.driving.known_laps import read_laps
    from racecraft.worlds.deepracer.files.hyperparameters import read_hyperparameters
    from racecraft.worlds.deepracer.files.leaderboards import read_leaderboards
    from racecraft.worlds.deepracer.files.model_metadata import read_model_metadata
    from racecraft.worlds.deepracer.files.policy_graph import read_policy_graph
    from racecraft.worlds.deepracer.files.reward_file import load_reward_function
    from racecraft.worlds.deepracer.files.run_env import read_run_env
    from racecraft.worlds.deepracer.files.training_metrics import read_metrics_file
    from racecraft.worlds.deepracer.files.training_params import read_params
    from racecraft.worlds.deepracer.logs import read
    from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
    from racecraft.worlds.deepracer.players.aws_model import import_model
    from racecraft.worlds.deepracer.tracks.importer import import_track
    from racecraft.worlds.deepracer.training.groups import read_groups, requested_groups
    from racecraft.worlds.unity.files.demonstrations import read_demonstrations as read_unity
    from racecraft.worlds.unity.files.trainer_yaml import read_trainer_yaml

    def logs(path):
        found = read(path)
        return found.ticks.collect(), found.metrics.collect(), found.damaged, found.about

    def of_run(ask):
        return lambda path: ask(RunFolder.open(path.parent if path.parent.name != "checkpoints" else path.parents[1]))

    return {
        "model_metadata.json": read_model_metadata,
        "hyperparameters.json": read_hyperparameters,
        "groups.json": lambda path: requested_groups((), read_groups(path)),
        "metrics.json": lambda path: (read_metrics_file(path), logs(path)),
        "trace.csv": lambda path: (read_sim_trace(path), logs(path)),
        "training-robomaker.log": logs,
        "run.env": lambda path: read_run_env(path),
        "training_params.yaml": read_params,
        "reward_function.py": load_reward_function,
        "template.yaml": read_template,
        "trainer.yaml": read_trainer_yaml,
        "weights.json": read_weights,
        "notebook.ipynb": lambda path: list(cells_of(path)),
        "job_spec.json": read_job_spec,
        "game.jsonl": lambda path: (list(read_games(path)), read_record(path), import_game([path])),
        "laps.csv": read_laps,
        "leaderboards/leaderboards.csv": lambda path: read_leaderboards(path.parent),
        "track.npy": import_track,
        "demonstrations.safetensors": read_demonstrations,
        "demo.demo": read_unity,
        "model.pb": read_policy_graph,
        "model.tar.gz": lambda path: (logs(path), import_model(path, path.parent / "imported")),
        "logs/metrics/TrainingMetrics.json": lambda path: logs(path.parents[1]),
        "population/population.json": lambda path: read_population(path.parent),
        "run/job.json": of_run(lambda run: run.read_job()),
        "run/metrics.jsonl": of_run(lambda run: run.read_metrics()),
        "run/checkpoints/checkpoints.json": of_run(
            lambda run: (Checkpoints(run.checkpoints).find("best"), ranked(run))
        ),
        "run/episodes/1.parquet": lambda path: (read_episodes(path), logs(path)),
    }


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """Return a folder of sound files, each under the name of its reader."""
    import tarfile

    from racecraft.formats.checkpoint import Checkpoints
    from racecraft.formats.demonstrations import Demonstrations, write_demonstrations
    from racecraft.formats.episodes import write_episodes
    from racecraft.formats.population import PopulationRecord, write_population
    from racecraft.formats.run_folder import RunFolder
    from racecraft.worlds.deepracer.driving.known_laps import KnownLap, write_laps
    from racecraft.worlds.deepracer.files.sim_trace import episodes_from_trace
    from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    home = tmp_path_factory.mktemp("sound")
    for name, data in TEXTS.items():
        (home / name).write_bytes(data)
    job = {"kind": "deepracer", "algorithm": "ppo", "asked": {"track": "reinvent_base", "stops": []}, "seed": 1}
    run = RunFolder.create(home / "run", job)
    run.append_metrics({"iteration": 1, "steps": 39, "seconds": 1.0, "mean_reward": 1.0})
    episodes = episodes_from_trace(read_sim_trace(home / "trace.csv").columns, iteration=1)
    write_episodes(run.episodes / "1.parquet", episodes)
    Checkpoints(run.checkpoints).save(1, 8, {"w": np.zeros(3, np.float32)}, {"spec": {}}, {"a": 1}, 1.0, True)
    track = load_track("Oval_track")
    np.save(home / "track.npy", np.column_stack([track.centre, track.inner, track.outer]))
    (home / "leaderboards").mkdir()
    head = "Arn,Name,LaunchTime,TrackArn,RaceType,TimingMethod"
    row = "a:leaderboard/b,Spring,1556553600000,a:track/Oval_track,TIME_TRIAL,TOTAL_TIME"
    (home / "leaderboards" / "leaderboards.csv").write_text(f"{head}\n{row}\n")
    write_laps([KnownLap("Oval_track", "forward", "v6", 2.5, "7x1.5,2.5", 9.5, "plan", "0.1.0")], home / "laps.csv")
    ticks = np.zeros(4, np.int32)
    shown = Demonstrations({"seen": np.zeros((4, 2), np.float32)}, ticks, ticks.astype(np.float32), ticks, {"a": 1})
    write_demonstrations(home / "demonstrations.safetensors", shown)
    (home / "population").mkdir()
    write_population(home / "population", PopulationRecord(("train",), "score", True, {"seed": "1,2"}, 2, 1, 0))
    (home / "logs" / "metrics").mkdir(parents=True)
    (home / "logs" / "metrics" / "TrainingMetrics.json").write_bytes(TEXTS["metrics.json"])
    (home / "logs" / "0-iteration.csv").write_bytes(TEXTS["trace.csv"])
    (home / "demo.demo").write_bytes(bytes(range(200)))
    (home / "model.pb").write_bytes(b"\x0a\x10" + bytes(range(100)))
    with tarfile.open(home / "model.tar.gz", "w:gz") as archive:
        archive.add(home / "model_metadata.json", "model/model_metadata.json")
        archive.add(home / "trace.csv", "model/training-simtrace/0-iteration.csv")
    return home


def answer(reader, path):
    """Return what is wrong with a reader's answer to a file; nothing where it read it or raised an error of ours."""
    try:
        with within(20):
            reader(path)
    except RacecraftError as error:
        text = str(error)
        return f"an error of {len(text):,} characters" if len(text) > 10_000 else ""
    except BaseException as error:  # noqa: BLE001  (what a user would see as a traceback)
        return f"{type(error).__name__}: {str(error)[:100]}"
    return ""


def damaged_files(sound, names, each):
    """Yield reader, kind of damage, and bytes or a place, so many of each kind."""
    for kind, damage in KINDS.items():
        for number in range(each):
            name = names[(number + zlib.crc32(kind.encode())) % len(names)]
            rng = random.Random(f"{kind} {number}")
            yield name, f"{kind} {number}", damage((sound / name).read_bytes(), rng)
    for place in PLACES:
        for number in range(each):
            yield names[(number + len(place)) % len(names)], place, place


def faults(sound, each):
    """Return what readers answered wrongly to so many malformed files of each kind, and how many there were."""
    known, found, count = readers(), collections.Counter(), 0
    for name, kind, content in damaged_files(sound, list(known), each):
        path = sound / name
        kept, count = path.read_bytes(), count + 1
        begun = time.process_time()
        try:
            if isinstance(content, bytes):
                path.write_bytes(content)
            else:
                put_place(path, content)
            if wrong := answer(known[name], path):
                found[f"{name}, {kind}: {wrong}"] += 1
            elif time.process_time() - begun > 15:
                found[f"{name}, {kind}: {time.process_time() - begun:.1f} s of the processor"] += 1
        finally:
            clear(path)
            path.write_bytes(kept)
    return found, count


def test_every_reader_reads_a_sound_file_or_refuses_it_by_name(sound):
    for name, reader in readers().items():
        assert answer(reader, sound / name) == "", name


JOB_6000 = b'{"format": "racecraft run", "version": ' + b"9" * LONG_NUMBER + b"}"
THREE_ACTIONS = json.dumps(ACTIONS)[1:-1].encode()
MANY_ACTIONS = b'{"action_space": [' + b", ".join([THREE_ACTIONS] * (MANY // 3)) + b'], "version": "5"}'
NAMED = {
    "a run's job nests 100,000 lists": ("run/job.json", b"[" * DEEP),
    "a version has 6,000 digits": ("run/job.json", JOB_6000),
    "a key is half a character": ("groups.json", f'[{{"{SURROGATE}": 1}}]'.encode()),
    "a pipe stands in a job's place": ("run/metrics.jsonl", "a pipe"),
    "an endless device does": ("run/checkpoints/checkpoints.json", "a device"),
    "a car has 100,000 actions": ("model_metadata.json", MANY_ACTIONS),
    "a value is 100 KB long": ("groups.json", json_bytes([{"track": "x" * LONG_TEXT, "cars": "y" * LONG_TEXT}])),
}


@pytest.mark.parametrize("name", NAMED)
def test_what_once_hung_or_failed_is_answered_at_once(sound, name):
    reader, content = NAMED[name]
    path = sound / reader
    kept = path.read_bytes()
    try:
        path.write_bytes(content) if isinstance(content, bytes) else put_place(path, content)
        assert answer(readers()[reader], path) == ""
    finally:
        clear(path)
        path.write_bytes(kept)


@pytest.mark.long
def test_no_reader_fails_on_a_thousand_malformed_files(sound):
    most_before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found, count = faults(sound, each=54)
    assert not found, "\n".join(found)
    assert count >= 1000
    grown_mib = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - most_before) / 1024
    assert grown_mib < 700, f"{grown_mib:.0f} MiB more than before"
