"""Gradient steps of PPO: joint or in two threads, in float32 or bfloat16. Begin with `GradientSteps`.

Every acceleration of the update enters here: a written-out gradient for small networks (`closed_form.py`), half
precision (`half_precision.py`), separate threads for networks that share no weights (`parallel_updates.py`), and steps
as if pixels were centred (`centred_pixels.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import torch
from torch import Tensor
from torch.nn.utils import clip_grad_norm_

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.centred_pixels import CentredPixels
from racecraft.algorithms.closed_form import closed_form_of
from racecraft.algorithms.distributions import Distribution
from racecraft.algorithms.half_precision import Bfloat16Copy, processor_precision
from racecraft.algorithms.networks import ActorCritic, Encoder
from racecraft.algorithms.parallel_updates import run_in_parallel
from racecraft.algorithms.ppo_batch import Minibatch
from racecraft.algorithms.ppo_config import PpoConfig
from racecraft.algorithms.ppo_loss import policy_objective, ppo_loss, value_error
from racecraft.algorithms.recurrent_network import RecurrentActorCritic

WORTH_A_THREAD = 10_000_000
"""Rows of a minibatch times weights from which policy and critic are worth a thread each; AWS's networks have 70 times
as much to do."""
CRITIC_PARTS = "critic_body.", "value_head."
"""How the names of the critic's own weights begin."""


class GradientSteps:
    """Steps of a network's weights along the gradients of PPO's loss.

    Args:
        network: The network whose weights are stepped.
        distribution: How its policy draws.
        config: The algorithm's settings.
    """

    def __init__(self, network: ActorCritic, distribution: Distribution, config: PpoConfig) -> None:
        self.network, self.distribution = network, distribution
        self.half = Bfloat16Copy(network) if processor_precision(config.precision) == "bfloat16" else None
        self.working = network if self.half is None else self.half.network
        """What explores and learns: the network itself, or its copy of half the precision."""
        self._weights, self._learned = list(network.parameters()), list(self.working.parameters())
        """The weights that are stepped, and those that gradients are found for; asking the modules for them takes as
        long as a small network's losses."""
        self.size = sum(one.numel() for one in self._weights)
        self.optimiser = Adam(network.parameters(), config.learning_rate, config.adam_epsilon, config.adam_form)
        self._max_grad_norm = config.max_grad_norm
        self._pixels = CentredPixels(network) if config.centred_pixels else None
        names = [name for name, _ in network.named_parameters()]
        self._critics = tuple(index for index, name in enumerate(names) if name.startswith(CRITIC_PARTS))
        self._policys = tuple(index for index in range(len(names)) if index not in self._critics)
        self.learns_apart = self._may_learn_apart(config)
        """Whether policy and critic take their steps each in a thread of its own."""
        self.written_out = closed_form_of(network, distribution) if self.half is None else None
        """The gradient of a small network, written out; None: autograd finds it."""

    def look(self, observations: Mapping[str, Tensor], rows: Tensor) -> None:
        """See what a rollout shows in the rows (int64) that the steps to come are taken from."""
        if self._pixels is not None:
            self._pixels.look(observations, rows)

    def run(self, drawn: Iterable[Tensor], taken: Callable[[Tensor], Minibatch], config: PpoConfig) -> list[Tensor]:
        """Step once for each minibatch; return the first six `FIGURES` of each step, (6,).

        Args:
            drawn: The rows (int64) of each minibatch.
            taken: Returns what the rows of a minibatch hold.
            config: The settings as the schedules have them now.
        """
        if self.learns_apart:
            return self._apart(list(drawn), taken, config)
        return [self._step(taken(picked), config) for picked in drawn]

    def _may_learn_apart(self, config: PpoConfig) -> bool:
        """Tell whether policy and critic have nothing to do with each other, and enough to do by themselves."""
        bodies = self.network.policy_body, self.network.critic_body
        return (
            all(isinstance(body, Encoder) for body in bodies)
            and not isinstance(self.network, RecurrentActorCritic)
            and config.max_grad_norm is None  # a norm over both has them wait for each other
            and self._pixels is None  # only joint steps are centred
            and self._weights[0].device.type == "cpu"
            and config.batch_size * self.size > WORTH_A_THREAD
        )

    def _step(self, batch: Minibatch, config: PpoConfig) -> Tensor:
        """Take one gradient step and return its figures, in the order of `FIGURES`."""
        if self.half is not None and self._max_grad_norm is None and self._pixels is None:
            figures = self._go_back(batch, config)
            self.half.step(self.optimiser)
            return torch.cat([figures, figures.new_zeros(1)])
        figures = self.find_gradients(batch, config)
        return torch.cat([figures, self._descend().reshape(1)])

    def _apart(self, drawn: list[Tensor], taken: Callable[[Tensor], Minibatch], config: PpoConfig) -> list[Tensor]:
        """Step policy and critic, which share no weights, through the minibatches, each in a thread; as `_step`."""
        policy = (self._step_policy(taken(picked), config) for picked in drawn)
        critic = (self._step_critic(taken(picked), config) for picked in drawn)
        steps = zip(*run_in_parallel(policy, critic), strict=True)
        return [torch.cat([one[:1], other[:1], one[1:], other.new_zeros(1)]) for one, other in steps]

    def _step_policy(self, batch: Minibatch, config: PpoConfig) -> Tensor:
        """Take a step of the policy alone; return its figures (4,)."""
        params = self.working.policy(batch.observations)
        loss, figures = policy_objective(params, self.network.log_std, self.distribution, batch, config)
        self._step_part(loss, self._policys)
        return figures

    def _step_critic(self, batch: Minibatch, config: PpoConfig) -> Tensor:
        """Take a step of the critic alone; return its loss (1,)."""
        loss = value_error(self.working.value(batch.observations), batch, config)
        self._step_part(config.value_weight * loss, self._critics)
        return loss.detach().reshape(1)

    def _step_part(self, loss: Tensor, part: tuple[int, ...]) -> None:
        """Step some of the weights, by their places among all, along the gradients of a loss that is theirs alone."""
        for place in part:
            self._learned[place].grad = None
        loss.backward()
        if self.half is None:
            self.optimiser.step(part)
        else:
            self.half.step(self.optimiser, part)

    def find_gradients(self, batch: Minibatch, config: PpoConfig) -> Tensor:
        """Leave with the weights the gradients of a minibatch's loss; return the loss's figures (5,)."""
        figures = self._go_back(batch, config)
        if self.half is not None:
            self.half.hand_over()
        return figures

    def _go_back(self, batch: Minibatch, config: PpoConfig) -> Tensor:
        """As `find_gradients`, with them left where they were found: with the weights of half precision, if any."""
        if self.written_out is not None:
            return self.written_out.find_gradients(batch, config)
        loss, figures = ppo_loss(self.working, self.distribution, batch, config)
        for one in self._learned:
            one.grad = None
        loss.backward()
        return figures

    def _descend(self) -> Tensor:
        """Step along the gradients that are with the weights; return their norm before they were cut, ()."""
        if self._pixels is not None:
            self._pixels.before_step()
        norm = torch.zeros((), device=self._weights[0].device)
        if self._max_grad_norm is not None:
            norm = clip_grad_norm_(self._weights, self._max_grad_norm)
        self.optimiser.step()
        if self._pixels is not None:
            self._pixels.after_step()
        if self.half is not None:
            self.half.refresh()
        return norm
