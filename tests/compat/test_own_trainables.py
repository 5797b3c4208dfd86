"""Algorithms of a script's own, registered as Ray's Tune has it, train until a stop is met."""

import pytest

from racecraft.compat.shims import run_script
from racecraft.contract.errors import SettingError

CLIMBER = """
from pathlib import Path
from ray import tune
from ray.tune.registry import register_trainable
from sagemaker_rl.ray_launcher import SageMakerRayLauncher

class Climber(tune.Trainable):
    def {setup}(self, config):
        self.height, self.stride = 0.0, config["stride"]

    def {step}(self):
        self.height += self.stride
        return {{"episode_reward_mean": self.height, "timesteps_this_iter": 10}}

    def save_checkpoint(self, folder):
        Path(folder, "height").write_text(str(self.height))

register_trainable("Climb", Climber)

class MyLauncher(SageMakerRayLauncher):
    def register_env_creator(self):
        pass

    def get_experiment_config(self):
        return {{"training": {{"run": "Climb", "stop": {{"episode_reward_mean": 6}}, "config": {{"stride": 1.5}}}}}}

MyLauncher.train_main()
"""
BY_ITSELF = """
from ray import tune

def climb(config, reporter):
    for height in range(100):
        reporter(episode_reward_mean=height * config["stride"])

print(tune.run(climb, stop={"training_iteration": 4}, config={"stride": 3})["episode_reward_mean"])

def quietly(config):
    tune.report(episode_reward_mean=1)

print(tune.run(quietly)["training_iteration"])
"""


@pytest.mark.parametrize(("setup", "step"), [("setup", "step"), ("_setup", "_train")])
def test_a_registered_class_trains_until_a_stop_is_met_and_keeps_what_it_learned(
    tmp_path, monkeypatch, capsys, setup, step
):
    (tmp_path / "train.py").write_text(CLIMBER.format(setup=setup, step=step))
    monkeypatch.setenv("SM_MODEL_DIR", str(tmp_path / "model"))
    run_script(tmp_path / "train.py")
    told = capsys.readouterr().out
    assert [line.split()[1] for line in told.splitlines() if "episode_reward_mean" in line] == ["1.5", "3", "4.5", "6"]
    assert "  timesteps_total: 40\n" in told
    assert (tmp_path / "model" / "checkpoint_4" / "height").read_text() == "6.0"


def test_a_function_reports_its_iterations_and_is_stopped(tmp_path, capsys):
    (tmp_path / "train.py").write_text(BY_ITSELF)
    run_script(tmp_path / "train.py")
    printed = [line for line in capsys.readouterr().out.splitlines() if not line.startswith("  ")]
    assert printed == ["9", "1"]


def test_what_cannot_learn_is_refused(tmp_path):
    script = "from ray.tune.registry import register_trainable\nregister_trainable('a', {})\n"
    for wrong in ("3", "type('A', (), {})"):
        (tmp_path / "train.py").write_text(script.format(wrong))
        with pytest.raises(SettingError, match="'a' is .*; expected a class derived from ray.tune.Trainable"):
            run_script(tmp_path / "train.py")
