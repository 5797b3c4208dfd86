"""Evolution strategies: try neighbours of the weights, walk towards the better ones. Begin with `EsLearner`.

Source: Salimans et al., "Evolution strategies as a scalable alternative to reinforcement learning", 2017.

No gradient is ever taken through the network. Each of the collector's rows is a member of a population and plays whole
episodes with weights of its own, theta + sigma * e and theta - sigma * e for each pair (mirrored sampling). What a
member earned becomes its rank among all, from -1/2 to 1/2 (so no reward is too large, and no unit matters), and

    gradient of the expected rank  ~  mean over members of  rank * (their noise) / sigma

which Adam, or a plain step, follows uphill. Noise is never kept: it is a pure function of seed, generation and pair.
The greedy policy is theta, the mean of the population. With an odd number of rows the last one plays theta itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.utils import parameters_to_vector

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.distributions import distribution_for
from racecraft.algorithms.learner import EPISODES, Decision, DivergedError, StateDict
from racecraft.algorithms.network_learner import ActorCriticLearner
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.population import PolicyAlone, Population
from racecraft.algorithms.returns import episode_returns
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.algorithms.saved_state import restore_state, saved_state
from racecraft.contract.errors import SettingError
from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array, WorldSpec
from racecraft.settings.table import check_group, setting

FIGURES = {
    "mean_return": "Mean return over the members of the population, each the mean of its episodes.",
    "best_return": "Return of the best member.",
    "return_spread": "Standard deviation of the members' returns; 0: all alike, and nothing to learn from.",
    "grad_norm": "Euclidean norm of the estimated gradient, without the weights' decay.",
    "weight_norm": "Euclidean norm of the mean weights.",
    "pairs": "Mirrored pairs learned from; one of which a half ended no episode is left out.",
    "whole_episodes": "Whole episodes learned from.",
}
"""What an update tells."""


@dataclass(frozen=True)
class EsConfig:
    """Evolution strategies: a population of perturbed policies; `rollout.num_worlds` is its size."""

    learning_rate: float = setting(0.02, "Step size on the estimated gradient.", low=1e-8, high=10.0)
    noise: float = setting(0.1, "Standard deviation of the perturbation of every weight (sigma).", low=1e-6, high=10.0)
    optimiser: str = setting("adam", "How the estimated gradient is followed.", choices=("adam", "sgd"))
    weight_decay: float = setting(
        0.0, "How strongly the weights are drawn to 0: added to the gradient, times the weight.", low=0.0, high=1.0
    )

    def __post_init__(self) -> None:
        check_group(self)


class EsLearner(ActorCriticLearner[EsConfig]):
    """A population round one policy.

    Args:
        spec: The world's promise; its rows (worlds times agents) are the population.
        network: The network's settings, or a whole `Architecture`.
        config: The algorithm's settings.
        seed: Of the first weights and of all noise.
        device: "cpu" or "cuda".

    Raises:
        SettingError: Fewer than two rows.
    """

    name = "es"
    experience = EPISODES
    figures = FIGURES
    supported_network_settings = ("encoder",)
    """Settings of `network` that are followed beside its layers."""

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: EsConfig,
        seed: int,
        device: str = "cpu",
    ) -> None:
        self.members = spec.num_worlds * spec.num_agents
        if self.members < 2:
            raise SettingError(
                "es compares the members of a population, one a row, and there is one row; expected two or more: "
                "--set rollout.num_worlds=32 --set rollout.episodes_per_iteration=32."
            )
        super().__init__(spec, network, config, seed, device, distribution_for(spec.actions))
        self._seed = seed
        self.parameters = list(PolicyAlone(self.network).parameters())
        """What is perturbed and stepped: the policy's way, without critic and standard deviations."""
        self.optimiser = Adam(self.parameters, config.learning_rate, 1e-8)
        self.generation = 0
        """How many steps were taken; noise hangs on it."""
        self._population = Population(self.network, self.members)
        self._perturbed = False

    @torch.inference_mode()
    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide for R rows, each by its own member's likeliest action; see `Actor.act`."""
        self._perturb()
        params = self._population.params(self._tensors(observations), rows)
        raw, _ = self.distribution.mode(params, self.network.log_std, self._mask(action_mask))
        return Decision(self.distribution.to_actions(raw).cpu().numpy(), {})

    def noise(self, pair: int) -> Tensor:
        """Return a pair's noise of this generation, standard normal, float32 (D,): the same at every call."""
        key = stream_keys(self._seed, f"es generation {self.generation}", self.members // 2)[pair]
        chance = torch.Generator().manual_seed(int(key >> np.uint64(1)))
        return torch.randn(sum(one.numel() for one in self.parameters), generator=chance).to(self.device)

    def update(self, experience: RolloutBatch) -> dict[str, float]:
        """Take one step towards the members that earned more; return `FIGURES`.

        Raises:
            DivergedError: A return is not a number.
        """
        batch = experience
        count, returns = episode_returns(batch.reward, batch.terminated | batch.truncated, batch.active)
        if not np.isfinite(batch.reward[batch.active]).all():
            raise DivergedError(
                "In generation {generation} the members' returns are {returns}; expected numbers. The "
                "world paid what is none.",
                generation=self.generation,
                returns=returns.tolist(),
            )
        pairs = np.flatnonzero(count[: self.members // 2 * 2].reshape(-1, 2).min(axis=1))
        of_pairs = returns[: self.members // 2 * 2].reshape(-1, 2)[pairs]
        ranks = centred_ranks(of_pairs.ravel()).reshape(-1, 2)
        gradient = torch.zeros_like(self.noise(0))
        for pair, (plus, minus) in zip(pairs, ranks, strict=True):
            gradient += float(plus - minus) * self.noise(int(pair))
        gradient /= max(of_pairs.size, 1) * self.config.noise
        self._step(gradient)
        known = returns[count > 0] if count.any() else np.zeros(1)
        figures = [known.mean(), known.max(), known.std(), gradient.norm(), self._mean_weights().norm()]
        return dict(zip(FIGURES, [*map(float, figures), len(pairs), int(count.sum())], strict=True))

    def state_dict(self) -> StateDict:
        """Return everything an exact continuation needs, as named tensors in groups (copies)."""
        return {
            **saved_state(self.network, self.optimiser),
            "evolution": {"generation": torch.tensor(self.generation)},
        }

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        restore_state(state, self.network, self.optimiser)
        self._perturbed = False
        if "evolution" in state:
            self.generation = int(state["evolution"]["generation"])

    def _perturb(self) -> None:
        """Give every member its weights, once a generation."""
        if self._perturbed:
            return
        mean = self._mean_weights()
        for pair in range(self.members // 2):
            away = self.config.noise * self.noise(pair)
            self._population.put(2 * pair, mean + away)
            self._population.put(2 * pair + 1, mean - away)
        if self.members % 2:
            self._population.put(self.members - 1, mean)
        self._perturbed = True

    @torch.no_grad()
    def _step(self, gradient: Tensor) -> None:
        """Follow the gradient uphill, and let the weights decay."""
        downhill = self.config.weight_decay * self._mean_weights() - gradient
        parts = downhill.split([one.numel() for one in self.parameters])
        for one, part in zip(self.parameters, parts, strict=True):
            one.grad = part.view_as(one).clone()
            if self.config.optimiser == "sgd":
                one.sub_(self.config.learning_rate * one.grad)
        if self.config.optimiser == "adam":
            self.optimiser.step()
        self.generation += 1
        self._perturbed = False

    def _mean_weights(self) -> Tensor:
        return parameters_to_vector([one.detach() for one in self.parameters])


def centred_ranks(returns: Array) -> Array:
    """Return each one's rank, float64 (P,), from -1/2 for the least to 1/2 for the greatest; equals share the middle.

    >>> centred_ranks(np.array([3.0, 10.0, -50.0])).tolist(), centred_ranks(np.array([7.0, 7.0])).tolist()
    ([0.0, 0.5, -0.5], [0.0, 0.0])
    """
    _, place, counts = np.unique(returns, return_inverse=True, return_counts=True)
    middle = np.cumsum(counts) - (counts + 1) / 2
    ranks: Array = middle[place] / max(len(returns) - 1, 1) - 0.5
    return ranks if len(returns) > 1 else np.zeros(len(returns))
