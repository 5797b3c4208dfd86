"""A script with an environment of several agents, and its networks: what the tests of the Ray launcher run."""

GUESS = """
import numpy as np, gym
from gym.spaces import Box, Dict, Discrete
from ray.rllib.env.multi_agent_env import MultiAgentEnv


class Guess(MultiAgentEnv):
    '''Each agent is shown a sign and earns 1 for naming it; agent_1 leaves after three ticks of eight.'''

    def __init__(self):
        self.observation_space, self.action_space = Box(-1.0, 1.0, (2,), np.float32), Discrete(2)

    def seed(self, seed):
        self.rng = np.random.default_rng(seed)

    def show(self, who):
        self.signs = {i: int(self.rng.integers(2)) for i in who}
        return {f"agent_{i}": np.eye(2, dtype=np.float32)[sign] for i, sign in self.signs.items()}

    def reset(self):
        self.t, self.rng = 0, getattr(self, "rng", np.random.default_rng(0))
        return self.show(range(2))

    def step(self, actions):
        assert set(actions) == {f"agent_{i}" for i in self.signs}, actions
        self.t += 1
        rewards = {name: float(action == self.signs[int(name[-1])]) for name, action in actions.items()}
        seen = self.show([0, 1] if self.t < 3 else [0])
        dones = {"__all__": self.t >= 8, **({"agent_1": True} if self.t == 3 else {})}
        if self.t == 3:
            seen["agent_1"] = np.full(2, 0.5, np.float32)
        return seen, rewards, dones, {}
"""
LAUNCHER = """
from ray.rllib.models import ModelCatalog
from ray.tune.registry import register_env
from sagemaker_rl.ray_launcher import SageMakerRayLauncher

config = {{"gamma": 0.9, "lr": 0.01, "train_batch_size": 128, "sgd_minibatch_size": 64, "num_sgd_iter": 2,
           "num_workers": 4, "model": {{"fcnet_hiddens": [16]}}}}
{more}


class MyLauncher(SageMakerRayLauncher):
    def register_env_creator(self):
        register_env("guess-v1", lambda config: {env}())

    def get_experiment_config(self):
        stop = {{"training_iteration": 2}}
        return {{"training": {{"env": "guess-v1", "run": "PPO", "stop": stop, "config": config}}}}


if __name__ == "__main__":
    MyLauncher.train_main()
"""
TWO_POLICIES = """
policies = {f"policy_{i}": (None, None, None, {"gamma": 0.5} if i else {}) for i in range(2)}
config["multiagent"] = {"policies": policies, "policy_mapping_fn": lambda agent_id: "policy_" + agent_id[-1]}
"""
MASKED = """

class Masked(gym.Env):
    '''Three choices; the mask leaves one, and any other is an error.'''

    def __init__(self):
        self.observation_space = Dict({"action_mask": Box(0.0, 1.0, (3,)), "real_obs": Box(0.0, 9.0, (1,))})
        self.action_space = Discrete(3)

    def show(self):
        return {"action_mask": np.eye(3)[self.t % 3], "real_obs": np.array([self.t])}

    def reset(self):
        self.t = 0
        return self.show()

    def step(self, action):
        assert action == self.t % 3, (action, self.t)
        self.t += 1
        return self.show(), 1.0, self.t == 9, {}
"""
PLAIN = """
import numpy as np, gym
from gym.spaces import Box, Discrete


class Plain(gym.Env):
    '''Six ticks, whatever is done.'''

    def __init__(self):
        self.observation_space, self.action_space = Box(0.0, 9.0, (1,)), Discrete(2)

    def reset(self):
        self.t = 0
        return np.zeros(1)

    def step(self, action):
        self.t += 1
        return np.full(1, self.t), float(action), self.t == 6, {}
"""
TORCH_MODEL = """
import torch
from ray.rllib.models.torch.fcnet import FullyConnectedNetwork
from ray.rllib.models.torch.torch_modelv2 import TorchModelV2


class MaskModel(TorchModelV2, torch.nn.Module):
    def __init__(self, obs_space, action_space, num_outputs, model_config, name, low, **words):
        TorchModelV2.__init__(self, obs_space, action_space, num_outputs, model_config, name)
        torch.nn.Module.__init__(self)
        assert low == 3 and set(obs_space.original_space.spaces) == {"action_mask", "real_obs"}
        self.inner = FullyConnectedNetwork(Box(0.0, 9.0, (1,)), action_space, num_outputs, model_config, name)

    def forward(self, input_dict, state, seq_lens):
        logits, state = self.inner({"obs": input_dict["obs"]["real_obs"]}, state, seq_lens)
        mask = torch.clamp(torch.log(input_dict["obs"]["action_mask"]), min=-1e9)
        return logits + mask, state

    def value_function(self):
        return self.inner.value_function()


ModelCatalog.register_custom_model("mine", MaskModel)
config["model"] = {"custom_model": "mine", "fcnet_hiddens": [8], "custom_model_config": {"low": 3}}
"""
KERAS_MODEL = """
from ray.rllib.models.tf.tf_modelv2 import TFModelV2
from ray.rllib.utils.framework import try_import_tf

tf1, tf, tfv = try_import_tf()


class MaskModel(TFModelV2):
    def forward(self, input_dict, state, seq_lens):
        return tf.math.log(input_dict["obs"]["action_mask"]), state


ModelCatalog.register_custom_model("mine", MaskModel)
config["model"] = {"custom_model": "mine", "fcnet_hiddens": [8], "custom_model_config": {"low": 3}}
"""


def script(env="Guess", more=""):
    """Return a whole script."""
    return GUESS + MASKED + LAUNCHER.format(env=env, more=more)
