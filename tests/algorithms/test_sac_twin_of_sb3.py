"""SAC by twin: Stable-Baselines3 with the same weights, data and chance takes the same gradient steps."""

import gymnasium
import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import Architecture
from racecraft.algorithms.replay_sampler import Transitions
from racecraft.algorithms.sac import SacConfig, SacLearner
from racecraft.contract.world import ArraySpec, ContinuousActions, WorldSpec

stable_baselines3 = pytest.importorskip("stable_baselines3")

B, SEEN, ACTIONS, UNITS = 32, 3, 2, (8, 8)
RATE, DISCOUNT, TARGET_RATE = 1e-2, 0.9, 0.05
LOW, HIGH = (-1.0, 0.5), (1.0, 4.0)


class Still(gymnasium.Env):
    """Stands there to lend its spaces."""

    observation_space = gymnasium.spaces.Box(-5, 5, (SEEN,), np.float32)
    action_space = gymnasium.spaces.Box(np.array(LOW, np.float32), np.array(HIGH, np.float32))

    def reset(self, *, seed=None, options=None):
        return np.zeros(SEEN, np.float32), {}


def its_twin(temperature, target_interval):
    return stable_baselines3.SAC(
        "MlpPolicy", Still(), batch_size=B, learning_rate=RATE, gamma=DISCOUNT, tau=TARGET_RATE, device="cpu",
        ent_coef=temperature if temperature == "auto" else float(temperature),
        target_update_interval=target_interval, policy_kwargs={"net_arch": list(UNITS)},
    )  # fmt: skip


def same_weights(twin, ours):
    """Draw weights anew for SB3's networks and give them to ours; return pairs of (name, ours of it, its)."""

    def pairs():
        for layer, name in (("latent_pi.0", "0"), ("latent_pi.2", "2")):
            its = dict(twin.actor.named_parameters())
            for part in ("weight", "bias"):
                yield f"{layer}.{part}", ours.network.actor.get_parameter(f"{name}.{part}"), its[f"{layer}.{part}"]
        head = ours.network.actor.get_submodule("4")
        for k, its_head in enumerate((twin.actor.mu, twin.actor.log_std)):
            rows = slice(k * ACTIONS, (k + 1) * ACTIONS)
            for part in ("weight", "bias"):
                yield f"head {k}.{part}", (getattr(head, part), rows), getattr(its_head, part)
        for kind, net, critics in (
            ("critic", twin.critic, ours.network.critics),
            ("slow", twin.critic_target, ours.slow),
        ):
            for k, one in enumerate((net.qf0, net.qf1)):
                for layer in range(3):
                    its = one[2 * layer]
                    yield f"{kind} {k}.{layer}.weight", (critics.weights[layer], k, "t"), its.weight
                    yield f"{kind} {k}.{layer}.bias", (critics.biases[layer], k, 0), its.bias

    return list(pairs())


def part_of(place, of=lambda tensor: tensor):
    """Return what a pair points at: a whole tensor, or some of it."""
    if not isinstance(place, tuple):
        return of(place)
    found = of(place[0])[place[1]]
    return found if len(place) == 2 else found.t() if place[2] == "t" else found[place[2]]


@pytest.mark.parametrize(("temperature", "target_interval"), [("auto", 1), ("0.3", 2)])
def test_the_same_transitions_give_the_same_losses_and_the_same_steps(temperature, target_interval, monkeypatch):
    torch.manual_seed(0)
    twin = its_twin(temperature, target_interval)
    spec = WorldSpec("toy", 1, 1, {"state": ArraySpec((SEEN,), np.float32)}, ContinuousActions(LOW, HIGH))
    config = SacConfig(
        learning_rate=RATE, discount=DISCOUNT, temperature=temperature, target_rate=TARGET_RATE,
        target_interval=target_interval,
    )  # fmt: skip
    ours = SacLearner(spec, Architecture(trunk_units=UNITS), config, seed=1)
    pairs = same_weights(twin, ours)
    with torch.no_grad():
        for _, place, its in pairs:
            its.copy_(torch.randn_like(its) * 0.3)
            part_of(place).copy_(its)

    rng = np.random.default_rng(0)

    def numbers(*shape):
        return rng.normal(size=shape).astype(np.float32)

    grads = {}

    def noting(optimiser, name):
        step = optimiser.step

        def noted(*args, **named):
            grads[name] = {id(one): one.grad.clone() for group in optimiser.param_groups for one in group["params"]}
            return step(*args, **named)

        optimiser.step = noted

    noting(twin.critic.optimizer, "critic")
    noting(twin.actor.optimizer, "actor")
    twin.actor.action_dist.epsilon = 0.0  # what SB3 adds inside the logarithm of the tanh's slope; ours is exact
    twin._logger = stable_baselines3.common.logger.configure(None, [])
    twin._current_progress_remaining = 1.0

    batches, noises = [], []
    for _ in range(3):
        over = rng.random(B) < 0.2
        batches.append(
            Transitions(
                {"state": numbers(B, SEEN)},
                rng.uniform(LOW, HIGH, (B, ACTIONS)).astype(np.float32),
                numbers(B),
                np.where(over, 0.0, DISCOUNT).astype(np.float32),
                {"state": numbers(B, SEEN)},
                None,
                None,
                np.ones(B, np.float32),
                np.arange(B),
            )
        )
        noises.append(torch.from_numpy(numbers(2, B, ACTIONS)))

    # SB3 draws the noise of now, then of next, and takes all its steps in one call; its actions are in [-1, 1] units.
    drawn = iter([noise for pair in noises for noise in pair])
    monkeypatch.setattr("torch.distributions.normal._standard_normal", lambda *_, **__: next(drawn))
    given = iter(batches)

    def sample(size, env):
        one = next(given)
        scaled = twin.policy.scale_action(one.actions)
        done = (one.discount == 0).astype(np.float32)
        parts = (one.observations["state"], scaled, one.next_observations["state"], done[:, None], one.reward[:, None])
        return stable_baselines3.common.type_aliases.ReplayBufferSamples(*map(torch.from_numpy, parts))

    twin.replay_buffer.sample = sample
    twin.train(gradient_steps=3, batch_size=B)
    ours.steps = (
        target_interval - 1
    )  # SB3's slow critics follow after the first step of an interval, ours after the last
    losses = [ours.step(batch, noise)[0] for batch, noise in zip(batches, noises, strict=True)]

    told = twin.logger.name_to_value
    assert np.mean([one.critic for one in losses]) == pytest.approx(told["train/critic_loss"], rel=1e-4)
    assert np.mean([one.actor for one in losses]) == pytest.approx(told["train/actor_loss"], rel=1e-4)
    if temperature == "auto":
        assert np.mean([one.temperature for one in losses]) == pytest.approx(told["train/ent_coef_loss"], rel=1e-4)
        assert ours.temperature == pytest.approx(float(twin.log_ent_coef.detach().exp()), rel=1e-5)
    else:
        assert ours.temperature == pytest.approx(told["train/ent_coef"])
    for name, place, its in pairs:
        torch.testing.assert_close(
            part_of(place), its, rtol=1e-3, atol=2e-5, msg=lambda said, name=name: f"{name}: {said}"
        )
        its_grad = grads["critic" if name.startswith("critic") else "actor"].get(id(its))
        if not name.startswith("slow"):
            grad = part_of(place, lambda tensor: tensor.grad)
            torch.testing.assert_close(
                grad, its_grad, rtol=1e-3, atol=1e-5, msg=lambda said, name=name: f"{name}: {said}"
            )
