"""What a learner promises the loop, the collector and the files. Begin with `Learner`.

The loop turns `collect → update → evaluate → write` and knows no algorithm. A learner decides (`act`), notes what it
will want to know again (`columns`), learns from what was collected (`update`) and tells all of itself (`state_dict`).
What it is fed, it says in `experience`:

    ROLLOUT   the latest T ticks of R rows, once: `update(RolloutBatch)`
    EPISODES  the same, made of whole episodes
    REPLAY    whatever was seen, again and again: `update(ReplaySampler)`
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

import torch
from torch import Tensor

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import RacecraftError
from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, ArraySpec, WorldSpec

if TYPE_CHECKING:
    from racecraft.algorithms.compiled_policy import CompiledPolicy

ROLLOUT, EPISODES, REPLAY = "rollout", "episodes", "replay"

ACTING = ("memory", "stack", "exploration")
"""Groups of a learner's state that belong to whoever acts, row by row, and not to what is learned."""

StateDict = dict[str, dict[str, Tensor]]
"""Named tensors in groups; the group "network" is all that a policy is made of."""


class DivergedError(RacecraftError):
    """The losses are no longer numbers; the weights of this update are worth nothing."""


class Decision(NamedTuple):
    """What was decided for R rows."""

    actions: Array
    """What the world obeys, (R, *action shape), in the type of the world's action spec."""
    columns: dict[str, Array]
    """What the learner wants back when it learns, (R, ...) each, by the names of its `columns`."""


@runtime_checkable
class Actor(Protocol):
    """What a collector asks: decisions, and what to keep of them."""

    device: torch.device
    """Where it decides; exploration is drawn there."""

    @property
    def columns(self) -> Mapping[str, ArraySpec]:
        """What `act` notes for each row, kept beside the transition."""
        ...

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide for R rows as one does while learning, exploration in.

        Args:
            observations: Named arrays (R, ...); names it does not know are ignored.
            action_mask: bool (R, A), True where a choice is allowed, or None.
            generator: Chance to draw with; the learner's own by default.
            rows: int64 (R,), which of the collector's rows these are; None: all of them, in order.
        """
        ...

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows (bool, of all that the collector carries) whose episode ended."""
        ...


@runtime_checkable
class Learner(Actor, Protocol):
    """Whatever improves."""

    experience: str
    """ROLLOUT, EPISODES or REPLAY."""
    spec: WorldSpec
    """What it sees and decides."""

    @property
    def policy_spec(self) -> PolicySpec:
        """What a stranger needs to rebuild the policy from its weights."""
        ...

    def choose(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions (R, *action shape); needs no privileged observation."""
        ...

    def update(self, experience: Any) -> Mapping[str, float]:
        """Learn from what was collected (see `experience`); return named figures.

        Raises:
            DivergedError: A figure is no longer a number.
        """
        ...

    def state_dict(self) -> StateDict:
        """Return everything an exact continuation needs (copies)."""
        ...

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        ...


@runtime_checkable
class HasSchedules(Protocol):
    """A learner whose figures change over the training."""

    def anneal(self, done: float) -> None:
        """Hear what share of the training is done, 0 to 1; called before each update where the end is known."""
        ...


@runtime_checkable
class RecurrentLearner(Protocol):
    """A learner whose greedy policy goes by what it saw before."""

    def greedy_policy(self) -> Policy:
        """Return the greedy policy with a memory of its own; it follows what is learned."""
        ...


@runtime_checkable
class HasDecisionCount(Protocol):
    """A learner whose exploration falls with the decisions that were drawn."""

    explored: int
    """Decisions drawn so far."""


@runtime_checkable
class Compilable(Protocol):
    """A policy, or a learner, whose greedy choice compiled code may take in its place: drives of many ticks at once."""

    def compile_policy(self, name: str, frame: tuple[int, ...]) -> CompiledPolicy | None:
        """Return how it looks at frames (H, W) of that name and chooses, as it stands now; None: it has to be asked."""
        ...


def counting(learner: Learner) -> HasDecisionCount | None:
    """Return whoever counts decisions among a learner and those that it is laid round; None: nobody does."""
    within: Any = learner
    while within is not None:
        if isinstance(within, HasDecisionCount):
            return within
        within = getattr(within, "inner", None)
    return None


class LearnerPolicy:
    """The greedy choice of a learner, every time, as a policy; it follows what is learned."""

    def __init__(self, learner: Learner) -> None:
        self._learner = learner

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Choose an action for every row (R, …)."""
        return self._learner.choose(observations, action_mask)

    def reset_state(self, rows: Array) -> None:
        """Nothing is remembered from tick to tick."""

    def compile_policy(self, name: str, frame: tuple[int, ...]) -> CompiledPolicy | None:
        """Return the learner's; see `Compilable`."""
        return self._learner.compile_policy(name, frame) if isinstance(self._learner, Compilable) else None


def greedy_policy_of(learner: Learner) -> Policy:
    """Return a learner's greedy policy: with a memory of its own where it `RecurrentLearner`."""
    return learner.greedy_policy() if isinstance(learner, RecurrentLearner) else LearnerPolicy(learner)
