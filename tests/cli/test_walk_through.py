"""The walk-through racers know, pasted into a real shell: train, look, stop, clone with curly quotes, judge, upload."""

import json
import os
import shlex
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from tests.cli.conftest import TINY

import racecraft

SETTINGS = " ".join(TINY[1::2])

WALK = """
cd {folder}
source ./bin/activate.sh
dr-update-env
dr-upload-custom-files
dr-start-training -q
dr-start-training -q; echo "again $?"
for _ in $(seq 100); do [ -f bucket/rl-deepracer-sagemaker/metrics.jsonl ] && break; sleep 0.3; done
dr-start-evaluation -q -c; echo "beside $?"
dr-logs-robomaker -n 2; echo "worker $?"
dr-start-viewer
for _ in $(seq 200); do (exec 3<>/dev/tcp/127.0.0.1/$DR_WEBVIEWER_PORT) 2> /dev/null && break; sleep 0.3; done
dr-stop-viewer
dr-stop-viewer; echo "closed $?"
dr-stop-all
dr-stop-all
dr-stop-training
dr-logs-sagemaker
dr-upload-car-zip -L -f
dr-start-training -q; echo "taken $?"
cat second.env > run.env
dr-update-env
dr-upload-custom-files
dr-start-training -q
racecraft jobs wait training-fast-car-2-1
dr-start-evaluation -c
dr-upload-model -fbL
dr-increment-training -f
dr-reload; echo "reload $?"
dr-summary
"""

SECOND = """
DR_RUN_ID=7
DR_WORLD_NAME=reinvent_base
DR_LOCAL_S3_MODEL_PREFIX=\u201dfast-car-2\u201d
DR_LOCAL_S3_CUSTOM_FILES_PREFIX=\u201dcustom-2\u201d
DR_LOCAL_S3_PRETRAINED=True
DR_LOCAL_S3_PRETRAINED_PREFIX=\u201ds3://bucket/rl-deepracer-sagemaker\u201d
DR_LOCAL_S3_PRETRAINED_CHECKPOINT=\u201dbest\u201d
DR_EVAL_NUMBER_OF_TRIALS=1
DR_UPLOAD_S3_PREFIX=up
RACECRAFT_STOP=iterations=2
RACECRAFT_SET="{settings}"
"""


@pytest.fixture
def shell(tmp_path):
    """Run a script in a shell that finds these sources as `racecraft`; its jobs are at home in tmp_path."""
    command = tmp_path / "path" / "racecraft"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m racecraft "$@"\n')
    command.chmod(0o755)
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("DR_", "RACECRAFT_"))}
    there = {
        **kept,
        "PATH": f"{command.parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(Path(racecraft.__file__).parents[1]),
        "RACECRAFT_JOBS": str(tmp_path / "jobs"),
        "OMP_NUM_THREADS": "1",
    }

    def run(name, script):
        words = [name, "-c", script] if name == "zsh" else [name, "--norc", "-c", script]
        return subprocess.run(words, env=there, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)

    return run


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as free:
        return free.getsockname()[1]


def test_the_walk_through_works_word_for_word(shell, tmp_path, racecraft):
    folder = tmp_path / "deepracer-for-cloud"
    assert racecraft("init", folder).code == 0
    with open(folder / "run.env", "a") as file:
        file.write(f'RACECRAFT_SET="{SETTINGS}"\nDR_WEBVIEWER_PORT={free_port()}\n')
    (folder / "second.env").write_text(SECOND.replace("{settings}", SETTINGS), encoding="utf-8")
    done = shell("bash", WALK.replace("{folder}", str(folder)))
    said = done.stdout
    assert done.returncode == 0, done.stderr
    assert [f"{word} 2" in said for word in ("again", "worker", "taken")] == [True] * 3, done.stderr
    assert "run id 0: a training is under way" in done.stderr
    assert "holds files already; expected a prefix that is free. Give another one, or start with -w" in done.stderr
    assert "iteration 1 | " in said  # dr-logs-sagemaker
    assert "the viewer is closed\nno viewer is open, so nothing was closed\nclosed 0\n" in said, done.stderr
    assert (folder / "bucket/rl-deepracer-sagemaker/carfile.tar.gz").stat().st_size > 1000
    assert "beside 0" in said, "a copy is judged while the model trains on"
    assert list((folder / "bucket/rl-deepracer-sagemaker-E/checkpoints").glob("*.safetensors"))
    assert "training-rl-deepracer-sagemaker-1: Stopped\n" in said
    assert "run id 0: nothing is at work, so nothing was stopped\n" in said
    assert "training-rl-deepracer-sagemaker-1: had ended already (Stopped)" in said
    assert "training-fast-car-2-1: Completed" in said
    second = json.loads((folder / "bucket/fast-car-2/job.json").read_text())
    assert second["asked"]["from"] == "rl-deepracer-sagemaker:best"
    assert (folder / "bucket/custom-2/reward_function.py").is_file()
    assert list((folder / "bucket/fast-car-2-E").glob("evaluation-*/evaluation-simtrace/0-iteration.csv"))
    assert len(list((folder / "bucket/up/checkpoints").glob("*.safetensors"))) == 1
    assert "DR_LOCAL_S3_MODEL_PREFIX=fast-car-3" in (folder / "run.env").read_text()
    assert (folder / "run.env.bak").read_text(encoding="utf-8") == (folder / "second.env").read_text(encoding="utf-8")
    assert "reload 0" in said
    assert "run id        7" in said
    assert "evaluation-fast-car-2-E-1: Completed" in said


@pytest.mark.parametrize("name", ["bash", "zsh"])
def test_the_shell_s_file_defines_every_command_and_takes_over_the_variables(shell, tmp_path, racecraft, name):
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not installed")
    folder = tmp_path / "my car's folder"  # blanks and quotes, too
    assert racecraft("init", folder).code == 0
    with open(folder / "run.env", "a") as file:
        file.write('DR_CAR_NAME="it\'s $(touch hacked)"\n')
    (folder / "experiments/oval").mkdir(parents=True)
    (folder / "experiments/oval/run.env").write_text("DR_WORLD_NAME=Oval_track\nDR_RUN_ID=4\n")
    script = f"""
        source "{folder}/bin/activate.sh" && echo "name: $DR_CAR_NAME" && echo "world: $DR_WORLD_NAME"
        for verb in update-env start-training logs-robomaker local-aws upload-car-zip start-metrics; do
            command -v dr-$verb > /dev/null && echo "has $verb"
        done
        source "{folder}/bin/activate.sh" -e oval && echo "world: $DR_WORLD_NAME" && echo "name: <${{DR_CAR_NAME:-}}>"
        dr-summary
    """
    done = shell(name, script)
    assert done.returncode == 0, done.stderr
    assert "name: it's $(touch hacked)\n" in done.stdout
    assert done.stdout.count("has ") == 6
    assert "world: reinvent_base\n" in done.stdout
    assert "world: Oval_track\n" in done.stdout
    assert "name: <>\n" in done.stdout, "what the experiment does not say is gone from the shell"
    assert "run id        4" in done.stdout
    assert not list(tmp_path.rglob("hacked"))


def test_what_is_printed_to_be_typed_can_be_pasted_where_folders_have_spaces(racecraft, tmp_path):
    assert "\ncd 'my cars'\nsource ./bin/activate.sh\n" in racecraft("init", "my cars").out
    assert "racecraft train 'my car'\n" in racecraft("new", "my car").out
    said = racecraft("train", "my car", "--run", "my runs/a", "--stop", "iterations=1", "--no-pictures", *TINY)
    assert said.code == 0, said.err
    assert "racecraft evaluate 'my runs/a' --laps 3" in said.out
    assert "racecraft train --run 'my runs/a' --resume" in said.out
    typed = [line for line in said.out.splitlines() if line.startswith("    racecraft ")]
    assert len(typed) == 5
    assert not [line for line in typed if "#" in line or shlex.split(line)[0] != "racecraft"], "zsh knows no comments"
