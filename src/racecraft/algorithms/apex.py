"""Ape-X: many actors that explore unlike each other, one learner that learns meanwhile. Begin with `ApexLearner`.

Source: Horgan et al., "Distributed prioritized experience replay", 2018. What it adds to `dqn.py`:

* the rows of the collector are the actors, and each has its own share of random choices, a ladder from almost greedy to
  wandering (`ladder`), which stays the same all training long;
* an actor notes what it expected, so that what is new enters the replay with a priority of its own;
* the learner works in a thread beside the actors, who decide with a copy of its weights. They meet at every update,
  that is every `rollout.horizon` ticks: weights are copied, and the learner is given the gradient steps that the new
  transitions are worth. Whoever is faster waits there, so that the proportion of learning to acting is kept.

What the learner draws hangs on when it draws it: a training is not bit-reproducible, and a resumed one goes on from the
last meeting. `ApexLearner._meet` is the only place where the two sides touch; another process may stand behind it.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.dqn import FIGURES as DQN_FIGURES
from racecraft.algorithms.dqn import DqnConfig, DqnLearner
from racecraft.algorithms.learner import Decision, StateDict
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.q_network import QPolicy, allowed_only
from racecraft.algorithms.replay_sampler import VALUE_BEST, VALUE_TAKEN, ReplaySampler
from racecraft.contract.world import Array, ArraySpec, DiscreteActions, WorldSpec
from racecraft.settings.table import check_group, setting

FIGURES = {
    **DQN_FIGURES,
    "epsilon": "Mean share of random choices of all actors, 0 to 1.",
    "gradient_steps": "Gradient steps that the learner took since it met the actors before.",
}
"""What an update tells: of the learning that went on beside the collecting before it."""


@dataclass(frozen=True)
class ApexConfig:
    """Ape-X: DQN with many actors and a learner beside them; the defaults are the paper's, batches are smaller."""

    learning_rate: float = setting(6.25e-5, "The optimiser's step size.", low=1e-8, high=1.0)
    discount: float = setting(0.99, "Weight of the next tick's value (gamma).", low=0.0, high=1.0)
    batch_size: int = setting(128, "Transitions in one gradient step; 512 in the paper.", low=1)
    train_every: int = setting(16, "So many transitions collected are worth `gradient_steps`.", unit="steps", low=1)
    gradient_steps: int = setting(1, "Gradient steps for every `train_every` transitions.", low=1)
    target_every: int = setting(
        2500, "The target network follows after so many gradient steps.", unit="gradient steps", low=1
    )
    target_share: float = setting(1.0, "How far it follows then (tau).", low=1e-6, high=1.0)
    epsilon: float = setting(0.4, "Share of random choices of the actor that wanders most.", low=0.0, high=1.0)
    ladder: float = setting(
        7.0, "How far the others fall below it (alpha): actor i of N has epsilon ** (1 + i / (N - 1) * alpha).", low=0.0
    )
    optimiser: str = setting("rmsprop", "RMSProp (centred), or Adam.", choices=("rmsprop", "adam"))
    adam_epsilon: float = setting(1e-8, "Adam's epsilon.", low=0.0)
    max_grad_norm: float | None = setting(40.0, "Gradients are scaled down to this norm.", low=0.0)
    double: bool = setting(True, "The network chooses what the target network values.")
    dueling: bool = setting(True, "A moment's worth and what each choice adds are told apart.")
    n_step: int = setting(3, "Rewards summed before a value is asked for.", unit="ticks", low=1, high=100)

    def __post_init__(self) -> None:
        check_group(self)


APART = ("epsilon", "ladder")
"""Settings that plain DQN knows nothing of."""


def ladder(epsilon: float, alpha: float, actors: int) -> Tensor:
    """Return the share of random choices of each actor, (N,), from the one that wanders most.

    >>> [round(float(share), 4) for share in ladder(0.4, 7.0, 3)]
    [0.4, 0.0162, 0.0007]
    """
    return epsilon ** (1.0 + torch.arange(actors) / max(actors - 1, 1) * alpha)


class ApexLearner(DqnLearner):
    """Actors in the collector's rows, a learner in a thread beside them.

    Args:
        spec: The world's promise; only its observations and actions are read.
        network: The network's settings, or a whole `Architecture`.
        config: The algorithm's settings.
        seed: Of the first weights, of what is drawn and (unless `act` is given another) of exploration.
        device: "cpu" or "cuda".
    """

    figures = FIGURES
    name = "apex"

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: ApexConfig,
        seed: int,
        device: str = "cpu",
    ) -> None:
        shared = {part: value for part, value in vars(config).items() if part not in APART}
        super().__init__(spec, network, DqnConfig(**shared), seed, device)
        assert isinstance(spec.actions, DiscreteActions)
        self.actor = self._network(spec.actions, torch.Generator().manual_seed(seed))
        """What decides, and what is judged and saved: the learner's weights when they last met."""
        self.policy = QPolicy(self.actor)
        self.ladder = ladder(config.epsilon, config.ladder, spec.num_worlds * spec.num_agents).to(self.device)
        self.columns = {
            VALUE_TAKEN: ArraySpec((), np.float32, doc="what was expected of what was taken"),
            VALUE_BEST: ArraySpec((), np.float32, doc="what was expected of the best"),
        }
        self._beside = ThreadPoolExecutor(max_workers=1, thread_name_prefix="learner")
        self._learning: Future[list[Tensor]] | None = None
        self._settled = self._meet()

    @property
    def epsilon(self) -> float:
        """Mean share of random choices of all actors."""
        return float(self.ladder.mean())

    @torch.inference_mode()
    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide for R rows, each an actor with its own share of random choices; see `Actor.act`."""
        worth = self.actor(self._tensors(observations))
        shares = self.ladder[: len(worth)] if rows is None else self.ladder[torch.from_numpy(rows)]
        drawn = self._explore(worth, action_mask, shares, generator or self.generator)
        self.explored += len(drawn)
        columns = {
            VALUE_TAKEN: worth.gather(1, drawn.unsqueeze(1)).squeeze(1).cpu().numpy(),
            VALUE_BEST: allowed_only(worth, self._mask(action_mask)).amax(dim=1).cpu().numpy(),
        }
        return Decision(drawn.cpu().numpy(), columns)

    def update(self, experience: ReplaySampler) -> dict[str, float]:
        """Meet the learner: hear what it learned, take over its weights, give it new work; return `FIGURES`.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        steps = [] if self._learning is None else self._learning.result()
        figures = self.metrics(steps, experience)
        self.owed += experience.new_transitions
        self._settled = self._meet()
        self._learning = self._beside.submit(self._learn, experience, self._due_steps())
        return figures

    def state_dict(self) -> StateDict:
        """Return everything as it was when learner and actors last met; nobody waits for it."""
        return self._settled

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        super().load_state_dict(state)
        self._settled = self._meet()

    def _meet(self) -> StateDict:
        """Copy the learner's weights to the actors; return its whole state, the steps it owes included."""
        self.actor.load_state_dict(self.network.state_dict())
        return super().state_dict()
