"""Scripts of the Coach launcher run unchanged: a preset of ours by hand, and AWS's own where somebody has them.

RACECRAFT_SAGEMAKER_EXAMPLES   the folder reinforcement_learning of aws/amazon-sagemaker-examples before June 2024
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from racecraft.compat.coach_config import Amount, Head, Layer, Line, Part, translated
from racecraft.compat.shims import run_script
from racecraft.contract.errors import InputFileError, SettingError
from racecraft.evaluation.evaluate_run import evaluate_run
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.gymnasium.training.trainer import GymRequest, plan

EXAMPLES = os.environ.get("RACECRAFT_SAGEMAKER_EXAMPLES")
REWARD = re.compile(r"^Training>.*Total reward=(.*?),", re.MULTILINE)
"""SageMaker's own definition of `reward-training` (facts C.1)."""
PRESET = """
from rl_coach.agents.{module} import {agent}AgentParameters
from rl_coach.architectures.layers import Dense
from rl_coach.core_types import EnvironmentEpisodes, EnvironmentSteps, TrainingSteps
from rl_coach.environments.gym_environment import GymVectorEnvironment
from rl_coach.graph_managers.basic_rl_graph_manager import BasicRLGraphManager
from rl_coach.graph_managers.graph_manager import ScheduleParameters

schedule = ScheduleParameters()
schedule.improve_steps = EnvironmentEpisodes(30)
schedule.evaluation_steps = EnvironmentEpisodes(2)
agent = {agent}AgentParameters()
agent.network_wrappers["main"].learning_rate = 0.01
agent.network_wrappers["main"].input_embedders_parameters["observation"].scheme = [Dense(16)]
agent.network_wrappers["main"].middleware_parameters.scheme = [Dense(8)]
agent.algorithm.num_steps_between_copying_online_weights_to_target = EnvironmentSteps(160)
graph_manager = BasicRLGraphManager(
    agent_params=agent, env_params=GymVectorEnvironment(level="cart:Cart"), schedule_params=schedule
)
"""
CART = """
import gym
import gymnasium

class Cart(gym.Env):
    def __init__(self):
        self.cart = gymnasium.make("CartPole-v1")
        self.action_space, self.observation_space = self.cart.action_space, self.cart.observation_space

    def reset(self):
        return self.cart.reset()[0]

    def step(self, action):
        seen, reward, terminated, truncated, info = self.cart.step(action)
        return seen, reward, terminated or truncated, info
"""
SCRIPT = """
from sagemaker_rl.coach_launcher import SageMakerCoachPresetLauncher

class MyLauncher(SageMakerCoachPresetLauncher):
    def default_preset_name(self):
        return "preset-cart"

    def map_hyperparameter(self, name, value):
        if name == "discount":
            self.apply_hyperparameter("rl.agent_params.algorithm.discount", value)
        else:
            super().map_hyperparameter(name, value)

if __name__ == "__main__":
    MyLauncher.train_main()
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart.py").write_text(CART)
    (tmp_path / "train.py").write_text(SCRIPT)
    return tmp_path


@pytest.mark.parametrize(
    ("agent", "module", "algorithm"), [("ClippedPPO", "clipped_ppo_agent", "ppo"), ("DDQN", "ddqn_agent", "dqn")]
)
def test_a_preset_beside_the_script_is_trained(folder, monkeypatch, capsys, agent, module, algorithm):
    (folder / "preset-cart.py").write_text(PRESET.format(agent=agent, module=module))
    monkeypatch.setenv("SM_MODEL_DIR", str(folder / "model"))
    run_script(folder / "train.py", ["--discount", "0.9", "--save_model", "1"])
    said = capsys.readouterr().out
    assert all(float(one) > 0 for one in REWARD.findall(said))
    assert REWARD.findall(said)
    assert "Testing> " in said
    job = RunFolder.open(folder / "model" / "run").read_job()
    settings = job["settings"]
    assert job["algorithm"] == algorithm
    assert settings[algorithm]["discount"] == 0.9
    assert settings[algorithm]["learning_rate"] == 0.01
    assert settings["network"]["hidden_units"] == [16, 8]
    if algorithm == "ppo":
        assert settings["rollout"]["horizon"] * settings["rollout"]["num_worlds"] == 160
    else:
        assert settings["dqn"]["target_every"] == 160 / settings["dqn"]["train_every"]
        assert settings["dqn"]["double"]
    episodes = [int(one) for one in re.findall(r"Training> .*Episode=(\d+)", said)]
    assert episodes[-1] >= 30, "it trains as many episodes as were asked"
    assert len(episodes) < 2 or episodes[-2] < 30, "and stops then"


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        (["--discnt", "0.9"], "hyperparameter 'discnt'"),
        (["--rl.improve_steps:TrainSteps", "9"], "expected one of EnvironmentSteps"),
        (["--rl.agent_params.algorithm.gae_lambda"], "a name without a value"),
    ],
)
def test_words_that_mean_nothing_are_refused(folder, words, letter):
    (folder / "preset-cart.py").write_text(PRESET.format(agent="ClippedPPO", module="clipped_ppo_agent"))
    with pytest.raises(SettingError, match=letter):
        run_script(folder / "train.py", words)


def test_a_presets_own_environment_travels_with_its_run(folder):
    (folder / "preset-cart.py").write_text(PRESET.format(agent="ClippedPPO", module="clipped_ppo_agent"))
    run_script(folder / "train.py", ["--rl.improve_steps:TrainingSteps", "2"])
    (run,) = (folder / "runs").iterdir()
    run.rename(folder / "away")
    for name in ("train.py", "preset-cart.py", "cart.py"):
        (folder / name).unlink()
    sys.modules.pop("cart")
    gymnasium.registry.pop("from_script/Cart-v0")
    told = evaluate_run(folder / "away", episodes=4)
    assert told["episodes"] == 4
    assert told["mean_return"] == told["mean_steps"] > 5, "a cart's pole earns one a step"


def test_a_preset_that_is_not_there_is_named_with_those_that_are(folder):
    (folder / "preset-other.py").write_text("")
    with pytest.raises(InputFileError, match="preset-other"):
        run_script(folder / "train.py")


def graph(kind="ClippedPPOAgentParameters", **words):
    agent = Part(kind)
    for path, value in words.items():
        *before, last = path.replace("__", ".").split(".")
        place = agent
        for step in before:
            place = place[step]
        place[last] = value
    schedule = Part("ScheduleParameters", improve_steps=Amount("TrainingSteps", 5))
    environment = Part("GymVectorEnvironment", level="CartPole-v1")
    return Part("BasicRLGraphManager", agent_params=agent, env_params=environment, schedule_params=schedule)


def test_an_agent_of_coachs_that_is_not_here_is_named():
    with pytest.raises(SettingError, match="ActorCriticAgentParameters; expected one of ClippedPPOAgentParameters"):
        translated(graph("ActorCriticAgentParameters"))
    with pytest.raises(SettingError, match="algorithm.gae_lambda is a word of ClippedPPO"):
        translated(graph("DQNAgentParameters", algorithm__gae_lambda=0.9))
    behind = {"network_wrappers__main__middleware_parameters__activation_function": "relu"}
    seen = {"network_wrappers__main__input_embedders_parameters__observation__activation_function": "tanh"}
    two = graph(**seen, **behind)
    with pytest.raises(SettingError, match="expected one for all layers"):
        translated(two)


@pytest.mark.parametrize("kind", ["ClippedPPOAgentParameters", "DQNAgentParameters"])
def test_coachs_defaults_are_legal_trainings(kind):
    told = translated(graph(kind))
    settings = plan(GymRequest("CartPole-v1", algorithm=told.algorithm, overrides=tuple(told.settings))).settings
    assert settings.network.hidden_units == (256, 512)
    assert told.stop == ("iterations=5" if told.algorithm == "ppo" else "steps=20")


def test_schedules_and_sizes_of_dqn_are_taken_over():
    told = translated(
        graph(
            "DQNAgentParameters",
            algorithm__num_consecutive_playing_steps=Amount("EnvironmentSteps", 1),
            exploration__epsilon_schedule=Line(1.0, 0.01, 10_000),
            memory__max_size=("Transitions", 40_000),
            network_wrappers__main__middleware_parameters__scheme=[Layer(32), Layer(16)],
        )
    )
    settings = plan(GymRequest("CartPole-v1", algorithm="dqn", overrides=tuple(told.settings))).settings
    assert (settings.dqn.epsilon_last, settings.dqn.epsilon_steps, settings.dqn.train_every) == (0.01, 10_000, 1)
    assert settings.replay.capacity == 40_000
    assert settings.network.hidden_units == (256, 32, 16)


def test_a_dueling_head_is_dqns_and_no_other_head_is_taken():
    place = "network_wrappers__main__heads_parameters"
    told = translated(graph("DDQNAgentParameters", **{place: [Head(is_dueling=True)]}))
    settings = plan(GymRequest("CartPole-v1", algorithm="dqn", overrides=tuple(told.settings))).settings
    assert (settings.dqn.dueling, settings.dqn.double) == (True, True)
    for kind, heads in (("DQNAgentParameters", [Part("VHeadParameters")]), ("ClippedPPOAgentParameters", [Head(True)])):
        with pytest.raises(SettingError, match="expected, of DQN"):
            translated(graph(kind, **{place: heads}))


OLD = """
import numpy as np
from gym.envs.classic_control.mountain_car import MountainCarEnv
from gym.wrappers.time_limit import TimeLimit
env = TimeLimit(MountainCarEnv(), max_episode_steps=3)
first = env.reset()
told = [env.step(0) for _ in range(3)]
print([done for _, _, done, _ in told], told[2][3], env.action_space.n, np.zeros(2, np.int).dtype.kind, np.float_(1.5))
"""


def test_classic_environments_and_numpys_old_names_are_lent(tmp_path, capsys):
    (tmp_path / "old.py").write_text(OLD)
    run_script(tmp_path / "old.py")
    assert capsys.readouterr().out == "[False, False, True] {'TimeLimit.truncated': True} 3 i 1.5\n"
    assert "int" not in vars(np)


@pytest.mark.long
@pytest.mark.skipif(not EXAMPLES, reason="RACECRAFT_SAGEMAKER_EXAMPLES names no copy of the examples")
@pytest.mark.parametrize(("preset", "improve"), [("preset-cartpole-clippedppo", "2"), ("preset-cartpole-dqn", "1500")])
def test_awss_own_cartpole_runs_unmodified(tmp_path, preset, improve):
    script = Path(EXAMPLES) / "rl_cartpole_coach" / "src" / "train-coach.py"
    asked = {
        "RLCOACH_PRESET": preset, "rl.agent_params.algorithm.discount": "0.9",
        "rl.evaluation_steps:EnvironmentEpisodes": "8", "improve_steps": improve, "save_model": "1",
    }  # fmt: skip
    words = [word for name, value in asked.items() for word in (f"--{name}", value)]
    done = subprocess.run(
        [sys.executable, "-m", "racecraft", "run", str(script), *words], cwd=tmp_path, capture_output=True, text=True,
        timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert REWARD.findall(done.stdout)
