"""RLlib's callbacks are called: functions of the starter pack's kind, a class's methods, and what they may ask."""

import re
from pathlib import Path

import pytest
from tests.compat.guessing import GUESS, LAUNCHER, PLAIN, TWO_POLICIES

from racecraft.compat.shims import run_script
from racecraft.contract.errors import UserInputError

FUNCTIONS = """
def on_episode_start(info):
    info["episode"].custom_metrics["met"] = 0
    info["episode"].user_data["seen"] = []

def on_episode_step(info):
    episode = info["episode"]
    episode.user_data["seen"].append(episode.last_info_for("agent_1").get("t"))
    episode.custom_metrics["met"] += 1

def on_episode_end(info):
    episode = info["episode"]
    assert episode.length == episode.custom_metrics["met"] == 8
    assert episode.user_data["seen"] == [1, 2, 3, 3, 3, 3, 3, 3], "agent_1 leaves after three"
    assert sum(episode.agent_rewards.values()) == episode.total_reward
    episode.custom_metrics["world"] = episode.env_id

def on_train_result(info):
    result = info["result"]
    result["longest"] = max(result["hist_stats"]["episode_lengths"])
    result["mean_met"] = result["custom_metrics"]["met_mean"]
    grown = info["trainer"].workers.foreach_worker(lambda worker: worker.foreach_env(lambda env: env.grow()))
    result["grown"] = sum(map(sum, grown))

config["callbacks"] = {"on_episode_start": on_episode_start, "on_episode_step": on_episode_step,
                       "on_episode_end": on_episode_end, "on_train_result": on_train_result,
                       "on_sample_end": lambda info: 1 / 0}
"""
TELLING = GUESS.replace(
    "return seen, rewards, dones, {}", "return seen, rewards, dones, {k: {'t': self.t} for k in seen}"
)
TELLING += """
    def grow(self):
        self.size = getattr(self, "size", 7) + 4
        return self.size
"""
METHODS = """
from ray.rllib.agents.callbacks import DefaultCallbacks
from ray.rllib.env import BaseEnv
from ray.rllib.evaluation import MultiAgentEpisode, RolloutWorker
from ray.rllib.policy import Policy

class MyCallbacks(DefaultCallbacks):
    def on_episode_start(self, *, episode, **kwargs):
        assert episode.last_observation_for()[0] == 0.0 and episode.last_action_for() is None and episode.length == 0

    def on_episode_step(self, *, worker, base_env: BaseEnv, episode: MultiAgentEpisode, env_index, **kwargs):
        assert base_env.get_sub_environments()[env_index] is worker.envs[env_index]
        episode.user_data.setdefault("moves", []).append(float(episode.last_action_for()))
        assert episode.last_observation_for()[0] == base_env.get_sub_environments()[env_index].t

    def on_episode_end(self, *, worker: RolloutWorker, base_env, policies, episode, env_index=None):
        assert list(policies) == ["default_policy"]
        episode.custom_metrics["moved"] = sum(episode.user_data["moves"])
        assert episode.total_reward == episode.custom_metrics["moved"]

    def on_train_result(self, *, trainer, result, **kwargs):
        print("told of", trainer.iteration, sorted(result["custom_metrics"]))

config["callbacks"] = MyCallbacks
"""
UNFIT = [
    (
        "config['callbacks'] = {'on_episode_ends': print}",
        "config.callbacks has no 'on_episode_ends'. Did you mean 'on_ep",
    ),
    ("config['callbacks'] = {'on_episode_end': 3}", "'on_episode_end' is 3; expected a function"),
    (
        "class C:\n    def on_episode_end(self, *, episode, metrics_logger): pass\nconfig['callbacks'] = C",
        "on_episode_end asks for 'metrics_logger', which nothing here knows; it may ask for worker, base_env",
    ),
    ("config['callbacks'] = {'on_episode_end': lambda info: 1 / 0}", "callbacks.on_episode_end raised ZeroDivisionErr"),
    (
        "config['callbacks'] = {'on_episode_end': lambda info: info['episode'].custom_metrics.update(x='much')}",
        "custom_metrics['x'] is 'much'; expected a number for each episode",
    ),
]


@pytest.fixture
def ran(tmp_path, monkeypatch, capsys):
    """Runs a script in a job's folder; returns what it said."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SM_MODEL_DIR", str(tmp_path / "model"))

    def run(text, *words):
        Path("train.py").write_text(text)
        run_script("train.py", words)
        return capsys.readouterr().out

    return run


def figures(said, name):
    return [float(value) for value in re.findall(rf"^ +{name}: (\S+)", said, re.MULTILINE)]


@pytest.mark.parametrize("policies", ["", TWO_POLICIES])
def test_functions_by_name_measure_what_they_like_and_lay_it_into_the_result(ran, policies):
    said = ran(TELLING + LAUNCHER.format(env="Guess", more=policies + FUNCTIONS))
    assert figures(said, "met_mean") == figures(said, "mean_met") == [8, 8]
    assert figures(said, "world_max") == [3, 3], "four worlds are learned in, those that judge are not told of"
    assert figures(said, "longest") == [8, 8]
    assert figures(said, "grown") == [4 * 11, 4 * 15]
    assert "- callbacks.on_sample_end: not called here; on_episode_start, " in said
    assert "hist_stats" not in said


def test_a_class_s_methods_are_told_what_they_ask_for(ran):
    said = ran(PLAIN + LAUNCHER.format(env="Plain", more=METHODS))
    assert "told of 1 ['moved_max', 'moved_mean', 'moved_min']" in said
    assert figures(said, "moved_mean") == figures(said, "episode_reward_mean")


def test_a_training_that_goes_on_measures_the_episodes_it_was_in_whole(ran):
    """An iteration of 13 ticks ends within episodes of 8."""
    config = FUNCTIONS.replace("config[", "config['train_batch_size'] = 52\nconfig[", 1)
    stop = "--rl.training.stop.training_iteration"
    text = TELLING + LAUNCHER.format(env="Guess", more=config)
    ran(text, stop, "1")
    said = ran(text, stop, "3")
    assert "goes on after iteration 1" in said
    assert figures(said, "met_mean") == [8, 8]
    assert figures(said, "episodes_total")[0] > figures(said, "episodes_this_iter")[0]


@pytest.mark.parametrize(("more", "letter"), UNFIT)
def test_a_callback_that_cannot_be_called_is_told_with_its_line(ran, more, letter):
    with pytest.raises(UserInputError) as told:
        ran(TELLING + LAUNCHER.format(env="Guess", more=more))
    assert letter in str(told.value)
    assert re.match(r"train\.py:\d+: ", str(told.value))


def test_callbacks_are_called_in_an_environment_of_gymnasium_s_too(ran):
    said = ran(
        "from ray import tune\n"
        "def ended(info):\n    info['episode'].custom_metrics['angle'] = info['episode'].last_observation_for()[2]\n"
        "config = dict(env='CartPole-v1', num_workers=2, train_batch_size=128,\n"
        "              callbacks={'on_episode_end': tune.function(ended)})\n"
        "tune.run('PPO', stop={'training_iteration': 1}, config=config)\n"
    )
    assert max(map(abs, figures(said, "angle_(?:min|max)"))) > 0.2, "an episode ends where the pole leans by 0.209"
