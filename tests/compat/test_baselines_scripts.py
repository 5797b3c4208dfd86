"""Scripts of the Stable-Baselines launcher run unchanged: one of ours by hand, and AWS's own where somebody has them.

RACECRAFT_SAGEMAKER_EXAMPLES   the folder reinforcement_learning of aws/amazon-sagemaker-examples before June 2024
"""

import os
import re
import shutil
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from tests.compat.test_coach_scripts import CART

from racecraft.compat import baselines_training
from racecraft.compat.shims import run_script
from racecraft.contract.errors import InputFileError, SettingError
from racecraft.evaluation.evaluate_run import evaluate_run
from racecraft.formats.atomic import OutputFileError
from racecraft.formats.run_folder import RunFolder

EXAMPLES = os.environ.get("RACECRAFT_SAGEMAKER_EXAMPLES")
METRIC = r"\[.*,.*\]\<stdout\>\:\| *{} *\| *([-+]?[0-9]*\.?[0-9]*) *\|"
"""The notebook's own metric definitions (facts C.6, rl_roboschool_stable_baselines)."""
PRESET = """
import argparse
from sagemaker_rl.stable_baselines_launcher import RewScale, SagemakerStableBaselinesPPO1Launcher, create_env

parser = argparse.ArgumentParser()
parser.add_argument("--output_path", default="/opt/ml/output/intermediate/")
parser.add_argument("--schedule", default="linear")
parser.add_argument("--num_timesteps", default=1024, type=float)
args, unknown = parser.parse_known_args()
env = create_env(env_id="{env}", output_path=args.output_path)
SagemakerStableBaselinesPPO1Launcher(
    env={wrapped}, output_path=args.output_path, timesteps_per_actorbatch=512, clip_param=0.3, entcoeff=0.01,
    optim_epochs=2, optim_stepsize=1e-3, optim_batchsize=64, gamma=0.9, lam=0.8, schedule=args.schedule, verbose=1,
    num_timesteps=args.num_timesteps,
).run()
"""
SCRIPT = """
import sys
from sagemaker_rl.mpi_launcher import MPILauncher

MPILauncher(train_script=sys.argv[1], train_script_args=sys.argv[2:], instance_type="local").mpi_run()
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("SM_MODEL_DIR", "SM_OUTPUT_INTERMEDIATE_DIR"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "train.py").write_text(SCRIPT)
    (tmp_path / "preset-cart.py").write_text(PRESET.format(env="CartPole-v1", wrapped="env"))
    return tmp_path


def test_a_preset_is_trained_and_its_metrics_are_found(folder, monkeypatch, capsys):
    monkeypatch.setenv("SM_MODEL_DIR", str(folder / "model"))
    monkeypatch.setenv("SM_OUTPUT_INTERMEDIATE_DIR", str(folder / "intermediate"))
    (folder / "intermediate").mkdir()
    run_script(folder / "train.py", ["preset-cart.py", "--num_timesteps", "1e3"])
    said = capsys.readouterr().out
    rewards, lengths, counts = (
        [float(one) for one in re.findall(METRIC.format(name), said)]
        for name in ("EpRewMean", "EpLenMean", "EpisodesSoFar")
    )
    assert len(rewards) == len(counts) == 2
    assert rewards == lengths, "a cart's pole earns one a step"
    job = RunFolder.open(folder / "model" / "run").read_job()
    ppo = job["settings"]["ppo"]
    assert (ppo["clip"], ppo["epochs"], ppo["learning_rate"], ppo["discount"]) == (0.3, 2, 1e-3, 0.9)
    assert job["settings"]["rollout"]["horizon"] * job["settings"]["rollout"]["num_worlds"] == 512
    comment, heads, *rows = (folder / "intermediate" / "0.monitor.csv").read_text().splitlines()
    assert comment.startswith("#{")
    assert heads == "r,l,t"
    assert len(rows) == counts[-1], "training's episodes and no judged one"


def test_without_a_job_files_lie_in_the_run_or_where_the_script_says(folder, capsys):
    run_script(folder / "preset-cart.py", ["--num_timesteps", "512"])
    (run,) = (folder / "runs").iterdir()
    assert (run / "0.monitor.csv").exists()
    assert "[1,0]" not in capsys.readouterr().out, "no mpirun, no tags"
    run_script(folder / "preset-cart.py", ["--num_timesteps", "512", "--output_path", "kept/here"])
    assert (folder / "kept" / "here" / "0.monitor.csv").exists()


@pytest.mark.parametrize("wrapped", ["Cart()", "RewScale(env, 0.5)"])
def test_its_environment_travels_with_its_run(folder, wrapped):
    (folder / "cart.py").write_text(CART)
    (folder / "preset-cart.py").write_text(
        "from cart import Cart\n" + PRESET.format(env="CartPole-v1", wrapped=wrapped)
    )
    run_script(folder / "train.py", ["preset-cart.py"])
    (run,) = (folder / "runs").iterdir()
    run.rename(folder / "away")
    for name in ("train.py", "preset-cart.py", "cart.py"):
        (folder / name).unlink()
    sys.modules.pop("cart")
    gymnasium.registry.pop("from_script/environment-v0")
    told = evaluate_run(folder / "away", episodes=4)
    assert told["episodes"] == 4
    assert told["mean_return"] == told["mean_steps"] * (0.5 if "RewScale" in wrapped else 1)


def test_what_was_trained_is_filmed_where_it_can_be_shown(folder, monkeypatch):
    made = baselines_training.gymnasium.make

    class Shown(baselines_training.gymnasium.Wrapper):
        def render(self):
            return np.zeros((31, 41, 3), np.uint8)

    monkeypatch.setattr(baselines_training, "FILM_STEPS", 12)
    monkeypatch.setattr(
        baselines_training.gymnasium, "make",
        lambda name, render_mode=None, **words: Shown(made(name, **words)) if render_mode else made(name, **words),
    )  # fmt: skip
    run_script(folder / "preset-cart.py", ["--num_timesteps", "512", "--output_path", "kept"])
    from racecraft.analysis.video import read_film

    pictures = list(read_film(folder / "kept" / "rl_out.mp4"))
    assert len(pictures) == 12
    assert pictures[0].shape == (30, 40, 3)


@pytest.mark.parametrize(
    ("env", "words", "error", "letter"),
    [
        ("RoboschoolHalfCheetah-v1", [], SettingError, "given up in 2019.*HalfCheetah-v5"),
        ("CartPole-v1", ["--schedule", "middle_drop"], SettingError, "expected linear or constant"),
        ("CartPole-v1", ["--output_path", "train.py/here"], OutputFileError, "train.py/here"),
    ],
)
def test_what_cannot_be_trained_is_named_before_anything_is_made(folder, env, words, error, letter):
    (folder / "preset-cart.py").write_text(PRESET.format(env=env, wrapped="env"))
    with pytest.raises(error, match=letter):
        run_script(folder / "preset-cart.py", words)
    assert not (folder / "runs").exists()


def test_a_preset_that_is_not_there_is_named_with_those_that_are(folder):
    with pytest.raises(InputFileError, match=r"preset-cart\.py"):
        run_script(folder / "train.py", ["preset-nowhere.py"])


def test_an_environment_that_cannot_be_copied_is_named(folder):
    env = "type('Stuck', (), {'__reduce_ex__': lambda self, _: open('/nowhere')})()"
    (folder / "preset-cart.py").write_text(PRESET.format(env="CartPole-v1", wrapped=env))
    with pytest.raises(SettingError, match="Stuck, which cannot be copied"):
        run_script(folder / "preset-cart.py")


@pytest.mark.long
@pytest.mark.skipif(not EXAMPLES, reason="RACECRAFT_SAGEMAKER_EXAMPLES names no copy of the examples")
def test_awss_own_preset_runs_on_another_robot(folder, capsys):
    """Roboschool is no more; every other letter of the two scripts is AWS's."""
    source = Path(EXAMPLES) / "rl_roboschool_stable_baselines" / "src"
    shutil.copy(source / "train_stable_baselines.py", folder)
    text = (source / "preset-half-cheetah.py").read_text()
    (folder / "preset-half-cheetah.py").write_text(text.replace("RoboschoolHalfCheetah-v1", "Pendulum-v1"))
    words = ["--RLSTABLEBASELINES_PRESET", "preset-half-cheetah.py", "--num_timesteps", "4096"]
    run_script(folder / "train_stable_baselines.py", words)
    assert len(re.findall(METRIC.format("EpRewMean"), capsys.readouterr().out)) == 2
