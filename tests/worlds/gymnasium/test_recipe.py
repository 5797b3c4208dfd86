"""Arguments and wrappers of an environment: as typed, in training, judging and when a run goes on."""

import json
import sys

import gymnasium
import pytest
from gymnasium.envs.classic_control import CartPoleEnv

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.evaluation.evaluate_run import evaluate_run
from racecraft.formats.run_folder import RunFolder
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.gymnasium.actions.train import GymTraining
from racecraft.worlds.gymnasium.env.recipe import Recipe
from racecraft.worlds.gymnasium.evaluation import open_world
from racecraft.worlds.gymnasium.training.run_advice import as_typed
from racecraft.worlds.gymnasium.training.trainer import GymRequest

WRAPPER = """
import gymnasium

class Twice(gymnasium.RewardWrapper):
    def reward(self, reward):
        return 2 * reward
"""
SMALL = ("rollout.num_worlds=2", "rollout.horizon=32", "network.hidden_units=8", "evaluation.episodes=2")


def test_a_run_is_trained_judged_and_resumed_with_its_arguments_and_wrappers(tmp_path, monkeypatch):
    """Sutton's and Barto's CartPole pays -1 where it ends and else nothing; the wrapper doubles that."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "doubled_reward.py").write_text(WRAPPER)
    recipe = Recipe.of_options(["sutton_barto_reward=true"], ["FlattenObservation", "doubled_reward:Twice"])
    run = tmp_path / "run"
    train(GymRequest("CartPole-v1", recipe=recipe, run=run, stops=("iterations=1",), overrides=SMALL), NullCallback())
    job = RunFolder.open(run).read_job()
    assert job["asked"]["env_args"] == {"sutton_barto_reward": True}
    assert (run / "code" / "doubled_reward.py").read_text() == WRAPPER
    resume(run, ("iterations=2",), NullCallback())
    assert RunFolder.open(run).read_metrics()[-1]["mean_reward"] == -2.0
    (tmp_path / "doubled_reward.py").unlink()
    monkeypatch.delitem(sys.modules, "doubled_reward")
    assert evaluate_run(run, episodes=4)["mean_return"] == -2.0, "by the run's own copy of the wrapper"
    typed = "racecraft gym train CartPole-v1 --env-args sutton_barto_reward=true --wrapper FlattenObservation "
    assert as_typed("racecraft train --seed 2", job) == f"{typed}--wrapper doubled_reward:Twice --seed 2"


def test_values_are_json_or_text():
    recipe = Recipe.of_options(["size=4", "name=4x4", "places=[1, 2]", "word=a=b"], [])
    assert recipe.arguments == {"size": 4, "name": "4x4", "places": [1, 2], "word": "a=b"}
    assert Recipe.of_data(json.loads(json.dumps(recipe.as_data()))) == recipe


def frozen_lake(size="4x4"):
    return gymnasium.make("FrozenLake-v1", map_name=size)


def test_a_class_a_function_and_a_ready_environment_are_made_again_by_their_names():
    typed = GymTraining(environment=CartPoleEnv)
    assert (typed.environment, typed.env_args) == ("gymnasium.envs.classic_control.cartpole:CartPoleEnv", ())
    typed = GymTraining(environment=frozen_lake, env_args="size=8x8")
    assert (
        open_world(typed.environment, 2, Recipe.of_options(typed.env_args, ["FlattenObservation"])).spec.num_worlds == 2
    )
    typed = GymTraining(environment=gymnasium.wrappers.FlattenObservation(frozen_lake("8x8")))
    recipe = Recipe.of_options(typed.env_args, typed.wrapper)
    assert (typed.environment, recipe.arguments["map_name"]) == ("FrozenLake-v1", "8x8")
    assert open_world(typed.environment, 1, recipe).spec.observations["observation"].shape == (64,)


@pytest.mark.parametrize(
    ("environment", "error"),
    [
        (lambda: frozen_lake(), "has no name in a module; expected"),
        (CartPoleEnv(), "no second one can be made as it was; expected"),
        (gymnasium.wrappers.ClipReward(frozen_lake(), -1, 1), "no second one can be made as it was; expected"),
    ],
)
def test_an_environment_that_cannot_be_made_again_is_refused(environment, error):
    with pytest.raises(SettingError, match=error):
        GymTraining(environment=environment)


@pytest.mark.parametrize(
    ("arguments", "wrappers", "error"),
    [
        (["size=4"], [], "CartPole-v1 cannot be made with size=4: .*unexpected keyword argument 'size'"),
        ([], ["Flatten"], "--wrapper Flatten: found nothing; expected a name of gymnasium.wrappers"),
        ([], ["json:JSONDecoder"], "json:JSONDecoder: found .*; expected a name"),
    ],
)
def test_what_cannot_be_made_is_named(arguments, wrappers, error):
    with pytest.raises((SettingError, UserInputError), match=error):
        open_world("CartPole-v1", 1, Recipe.of_options(arguments, wrappers))
