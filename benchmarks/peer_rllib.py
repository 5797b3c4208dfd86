"""RLlib on one world until it is solved: `peer_rllib.py WORLD SEED --goal 475 --minutes 10`; for `peers.py`.

It runs in an environment of its own (`pip install "ray[rllib]==2.60.0"`, which pins a Gymnasium of its own) and knows
nothing of racecraft. The settings are those of Ray's own tuned examples, `cartpole_ppo.py` and `pendulum_sac.py`; it
samples and learns in one process, which is the quickest on worlds so small.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import torch
from ray.rllib.algorithms.algorithm import Algorithm
from ray.rllib.algorithms.algorithm_config import AlgorithmConfig
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.algorithms.sac import SACConfig
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

from greedy_returns import CONFIRMED, JUDGED, mean_return


def cartpole() -> AlgorithmConfig:
    """Return the tuned example's settings."""
    network = DefaultModelConfig(fcnet_hiddens=[32], fcnet_activation="linear", vf_share_layers=True)
    config: AlgorithmConfig = PPOConfig().environment("CartPole-v1").rl_module(model_config=network)
    return config.training(gamma=0.99, lr=0.0003, num_epochs=6, vf_loss_coeff=0.01, use_kl_loss=True)


def pendulum() -> AlgorithmConfig:
    """Return the tuned example's settings."""
    network = DefaultModelConfig(
        fcnet_hiddens=[256, 256], fcnet_activation="relu", fcnet_kernel_initializer=torch.nn.init.xavier_uniform_,
        head_fcnet_hiddens=[], head_fcnet_activation=None, head_fcnet_kernel_initializer="orthogonal_",
        head_fcnet_kernel_initializer_kwargs={"gain": 0.01},
    )  # fmt: skip
    memory = {"type": "PrioritizedEpisodeReplayBuffer", "capacity": 100_000, "alpha": 1.0, "beta": 0.0}
    config: AlgorithmConfig = SACConfig().environment("Pendulum-v1").rl_module(model_config=network)
    return config.training(
        initial_alpha=1.001, actor_lr=2e-4, critic_lr=8e-4, alpha_lr=9e-4, lr=None, target_entropy="auto",
        n_step=(2, 5), tau=0.005, train_batch_size_per_learner=256, target_network_update_freq=1,
        replay_buffer_config=memory, num_steps_sampled_before_learning_starts=256,
    )  # fmt: skip


TUNED: dict[str, tuple[Callable[[], AlgorithmConfig], int]] = {
    "CartPole-v1": (cartpole, 2048),
    "Pendulum-v1": (pendulum, 1024),
}
"""By world: its settings, and after how many steps it is judged."""


class Judge:
    """Plays greedy episodes in worlds of its own, all at once."""

    def __init__(self, world: str, seed: int) -> None:
        self.worlds: Any = gymnasium.make_vec(world, JUDGED, vectorization_mode="sync")
        self.seed, self.actions = seed, self.worlds.single_action_space

    def mean(self, learner: Algorithm, episodes: int) -> float:
        """Return the mean return of that many episodes."""
        module = learner.get_module()
        assert module is not None

        def act(seen: Any) -> Any:
            with torch.no_grad():
                told = module.forward_inference({Columns.OBS: torch.from_numpy(seen)})
            inputs = told[Columns.ACTION_DIST_INPUTS]
            greedy = module.get_inference_action_dist_cls().from_logits(inputs).to_deterministic().sample().numpy()
            return self._obeyed(greedy)

        return mean_return(self.worlds, act, episodes, self.seed)

    def _obeyed(self, actions: Any) -> Any:
        """Return actions as the world obeys them: RLlib learns numbers in [-1, 1] units."""
        if isinstance(self.actions, gymnasium.spaces.Discrete):
            return actions
        low, high = self.actions.low, self.actions.high
        return np.clip(low + (actions + 1.0) * (high - low) / 2.0, low, high).astype(np.float32)


def main() -> None:
    """Train once and print what came of it as one JSON object."""
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    options.add_argument("world", choices=TUNED)
    options.add_argument("seed", type=int)
    options.add_argument("--goal", type=float, required=True)
    options.add_argument("--minutes", type=float, default=10.0)
    asked = options.parse_args()
    os.environ["RAY_DEDUP_LOGS"] = "0"
    logging.disable(logging.WARNING)
    torch.set_num_threads(1)
    make, every = TUNED[asked.world]
    until = time.perf_counter() + 60.0 * asked.minutes
    here = make().env_runners(num_env_runners=0).learners(num_learners=0).debugging(seed=asked.seed)
    learner, judge = here.build_algo(), Judge(asked.world, asked.seed + 10_000)
    confirms = gymnasium.spec(asked.world).reward_threshold is not None
    steps, judged_at, solved = 0, 0, False
    while not solved and time.perf_counter() < until:
        steps = int(learner.train()["num_env_steps_sampled_lifetime"])
        if steps - judged_at >= every:
            judged_at = steps
            solved = judge.mean(learner, JUDGED) >= asked.goal
            solved = solved and (not confirms or judge.mean(learner, CONFIRMED) >= asked.goal)
    print(json.dumps({"solved": solved, "steps": steps}), flush=True)
    os._exit(0)  # what Ray began is ended by the system: its own way takes seconds that teach nothing


if __name__ == "__main__":
    main()
