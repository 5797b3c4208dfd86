"""What learners of one network share: how they are made, named, asked and saved. Begin with `NetworkLearner`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic, Self, TypeVar

import torch
from torch import Tensor, nn

from racecraft.algorithms.actor_policy import ActorPolicy, actor_critic_class, load_actor_policy
from racecraft.algorithms.distributions import Distribution
from racecraft.algorithms.learner import StateDict
from racecraft.algorithms.networks import ActorCritic, Architecture, NetworkConfig, architecture_of
from racecraft.algorithms.policy_spec import PolicySpec, architecture_values, spec_of_policy
from racecraft.algorithms.saved_state import restore_state, saved_state
from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, ArraySpec, WorldSpec
from racecraft.settings.composition import Settings

Config = TypeVar("Config")


class NetworkLearner(Generic[Config]):
    """A learner with one network; a subclass makes `network`, `policy` and `optimiser`, and says how it learns.

    Args:
        spec: The world's promise; only its observations and actions are read.
        network: The network's settings, or a whole `Architecture`.
        config: The algorithm's settings.
        seed: Of the first weights, of what is drawn while learning and (unless `act` is given another) of exploration.
        device: "cpu" or "cuda".
    """

    name: str
    """Of the algorithm and of its group of settings."""
    network: nn.Module
    """Its weights are the group "network" of the state."""
    policy: Policy
    """The greedy policy; it follows what is learned."""
    optimiser: Any

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: Config,
        seed: int,
        device: str = "cpu",
    ) -> None:
        self.spec, self.config, self.device = spec, config, torch.device(device)
        self.architecture = architecture_of(network) if isinstance(network, NetworkConfig) else network
        self.generator = torch.Generator(self.device).manual_seed(seed + 1)
        self.columns: Mapping[str, ArraySpec] = {}

    @classmethod
    def build(cls, spec: WorldSpec, settings: Settings, seed: int) -> Self:
        """Return a learner with the settings' groups `network`, its own and `runtime`."""
        return cls(spec, settings.network, getattr(settings, cls.name), seed, settings.runtime.device)

    @property
    def policy_spec(self) -> PolicySpec:
        """What a stranger needs to rebuild the policy from its weights."""
        return spec_of_policy(self.spec, self.name, {**architecture_values(self.architecture), **self.policy_values})

    @property
    def policy_values(self) -> Mapping[str, Any]:
        """What rebuilding the policy needs beside its architecture."""
        return {}

    def reset_state(self, rows: Array) -> None:
        """Nothing is remembered from tick to tick."""

    def choose(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions (R, *action shape); needs no privileged observation."""
        return self.policy.act(observations, action_mask)

    def state_dict(self) -> StateDict:
        """Return everything an exact continuation needs, as named tensors in groups (copies)."""
        return saved_state(self.network, self.optimiser, self.generator)

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        restore_state(state, self.network, self.optimiser, self.generator)

    def _tensor(self, array: Array) -> Tensor:
        return torch.from_numpy(array).to(self.device)

    def _tensors(self, observations: Mapping[str, Array]) -> dict[str, Tensor]:
        """Return what the world promises to show, as tensors on the device; other names are left out."""
        return {name: self._tensor(observations[name]) for name in self.spec.observations if name in observations}

    def _mask(self, action_mask: Array | None) -> Tensor | None:
        return None if action_mask is None else self._tensor(action_mask)

    def _flattened(self, array: Array, rows: Array | None = None) -> Tensor:
        """Return an array (T, R, ...) laid end to end (T * R, ...), or the chosen rows of it, on the device."""
        flat = array.reshape(-1, *array.shape[2:])
        return self._tensor(flat if rows is None else flat[rows])


class ActorCriticLearner(NetworkLearner[Config]):
    """A `NetworkLearner` whose network is a policy with its critic; the same arguments.

    Args:
        distribution: How the policy draws.
    """

    network: ActorCritic
    policy: ActorPolicy

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: Config,
        seed: int,
        device: str,
        distribution: Distribution,
    ) -> None:
        super().__init__(spec, network, config, seed, device)
        self.distribution = distribution
        chance, made = torch.Generator().manual_seed(seed), actor_critic_class(self.architecture)
        self.network = made(spec.observations, spec.actions, self.architecture, chance).to(self.device)
        self.policy = ActorPolicy(self.network, self.distribution)

    @classmethod
    def load_policy(cls, spec: PolicySpec, weights: Mapping[str, Tensor]) -> Policy:
        """Return the greedy policy of a checkpoint."""
        return load_actor_policy(spec, weights)
