"""PPO by twin: Stable-Baselines3 with the same weights and the same rollout takes the same gradient step."""

import gymnasium
import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import Architecture
from racecraft.algorithms.ppo import LOG_PROB, RAW_ACTION, VALUE, PpoConfig, PpoLearner
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, WorldSpec

stable_baselines3 = pytest.importorskip("stable_baselines3")

T, R = 16, 4
DISCOUNT, LAMBDA, CLIP, ENTROPY_WEIGHT, VALUE_WEIGHT, RATE = 0.9, 0.8, 0.05, 0.02, 0.7, 1e-2
SEEN = gymnasium.spaces.Box(-5, 5, (3,), np.float32)


class Still(gymnasium.Env):
    """Stands there to lend its spaces."""

    observation_space = SEEN

    def __init__(self, action_space):
        self.action_space = action_space

    def reset(self, *, seed=None, options=None):
        return np.zeros(3, np.float32), {}


def its_twin(action_space):
    """Return an SB3 learner with one shared trunk of 8 tanh units, as ours."""

    class Shared(stable_baselines3.common.torch_layers.BaseFeaturesExtractor):
        def __init__(self, space):
            super().__init__(space, 8)
            self.net = torch.nn.Sequential(torch.nn.Linear(3, 8), torch.nn.Tanh())

        def forward(self, seen):
            return self.net(seen)

    from stable_baselines3.common.vec_env import DummyVecEnv

    return stable_baselines3.PPO(
        "MlpPolicy", DummyVecEnv([lambda: Still(action_space)] * R), n_steps=T, batch_size=T * R, n_epochs=1,
        learning_rate=RATE, gamma=DISCOUNT, gae_lambda=LAMBDA, clip_range=CLIP, ent_coef=ENTROPY_WEIGHT,
        vf_coef=VALUE_WEIGHT, max_grad_norm=0.5, device="cpu",
        policy_kwargs={"features_extractor_class": Shared, "net_arch": []},
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["discrete", "continuous"])
def test_the_same_rollout_gives_the_same_losses_and_the_same_step(kind):
    if kind == "discrete":
        actions, space = DiscreteActions(4), gymnasium.spaces.Discrete(4)
    else:
        actions, space = ContinuousActions((-1.0, -1.0), (1.0, 1.0)), gymnasium.spaces.Box(-1, 1, (2,), np.float32)
    torch.manual_seed(0)
    twin = its_twin(space)
    spec = WorldSpec("toy", R, 1, {"state": ArraySpec((3,), np.float32)}, actions)
    config = PpoConfig(
        learning_rate=RATE, discount=DISCOUNT, gae_lambda=LAMBDA, clip=CLIP, entropy_weight=ENTROPY_WEIGHT,
        value_weight=VALUE_WEIGHT, epochs=1, batch_size=T * R,
    )  # fmt: skip
    ours = PpoLearner(spec, Architecture(trunk_units=(8,), activation="tanh"), config, seed=1)
    pairs = {
        "policy_body.trunk.0.weight": twin.policy.features_extractor.net[0].weight,
        "policy_body.trunk.0.bias": twin.policy.features_extractor.net[0].bias,
        "policy_head.weight": twin.policy.action_net.weight,
        "policy_head.bias": twin.policy.action_net.bias,
        "value_head.weight": twin.policy.value_net.weight,
        "value_head.bias": twin.policy.value_net.bias,
    }
    if kind == "continuous":
        pairs["log_std"] = twin.policy.log_std
    mine = dict(ours.network.named_parameters())
    assert set(mine) == set(pairs)
    with torch.no_grad():
        for name, its in pairs.items():
            its.copy_(torch.randn_like(its) * 0.5)
            mine[name].copy_(its)

    # Without a cut by the clock: SB3 folds the bootstrap into the reward, which is another (equal) way to say it.
    rng = np.random.default_rng(0)
    seen = rng.normal(size=(T, R, 3)).astype(np.float32)
    reward = rng.normal(size=(T, R)).astype(np.float32)
    over = rng.random((T, R)) < 0.15
    decided = ours.act({"state": seen.reshape(-1, 3)})
    raw, value = decided.columns[RAW_ACTION].reshape(T, R, *actions.shape), decided.columns[VALUE].reshape(T, R)
    moved = decided.columns[LOG_PROB].reshape(T, R) + rng.normal(size=(T, R)).astype(np.float32) * 0.1
    last = rng.normal(size=(R, 3)).astype(np.float32)
    kept = RolloutBatch(
        {"state": seen}, raw, reward, over, over & False, over | True, {"state": last}, np.ones(R, bool),
        {RAW_ACTION: raw, LOG_PROB: moved, VALUE: value},
    )  # fmt: skip

    buffer = twin.rollout_buffer
    starts = np.concatenate([np.zeros((1, R)), over[:-1]])
    for t in range(T):
        taken = raw[t].reshape(R, -1)
        buffer.add(seen[t], taken, reward[t], starts[t], torch.from_numpy(value[t]), torch.from_numpy(moved[t]))
    buffer.compute_returns_and_advantage(torch.from_numpy(ours.values({"state": last})), over[-1])

    twin._logger = stable_baselines3.common.logger.configure(None, [])
    twin._current_progress_remaining = 1.0
    twin.train()
    losses = ours.update(kept)

    told = twin.logger.name_to_value
    assert losses["policy_loss"] == pytest.approx(told["train/policy_gradient_loss"], rel=1e-4, abs=1e-6)
    assert losses["value_loss"] == pytest.approx(told["train/value_loss"], rel=1e-4)
    assert losses["entropy"] == pytest.approx(-told["train/entropy_loss"], rel=1e-5)
    assert losses["clip_fraction"] == pytest.approx(told["train/clip_fraction"])
    assert losses["approx_kl"] == pytest.approx(told["train/approx_kl"], rel=1e-3)
    assert losses["explained_variance"] == pytest.approx(told["train/explained_variance"], rel=1e-4)
    for name, its in pairs.items():
        torch.testing.assert_close(mine[name].grad, its.grad, rtol=1e-3, atol=1e-6, msg=f"gradient of {name}")
        torch.testing.assert_close(mine[name], its, rtol=1e-3, atol=1e-5, msg=name)
