"""What a world promises: N worlds of M agents each, stepped side by side.

A world writes into arrays that its caller owns (`StepBuffers`), in place, so that a rollout can hand it rows of its
own storage. Every array begins with the axes (N, M): world, agent.

One call of `step` does this, for each world by itself:

1. obeys the actions of the agents that are `active`;
2. writes reward, `terminated` and `truncated` for the tick just taken;
3. if the episode ended, writes `final_observations` for the rows that ended (only those rows are meaningful, and only
   `truncated` rows need them), begins the next episode **in the same step**, and `observations` then shows its start;
4. writes `observations`, `active` and, where the world has one, `action_mask` for the coming tick.

`terminated`: the story is over, nothing follows. `truncated`: we stopped watching, value still follows.
`active[n, m]` tells that the agent's coming action will be obeyed; a row acted while inactive (a car held at the start
line, a snake that left the game) is kept out of learning.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import DTypeLike, NDArray

Array = NDArray[Any]


@dataclass(frozen=True)
class ArraySpec:
    """One named observation of one agent."""

    shape: tuple[int, ...]
    """Shape without the leading (N, M)."""
    dtype: DTypeLike
    """NumPy type of its numbers."""
    low: float = -np.inf
    """Smallest value, inclusive."""
    high: float = np.inf
    """Largest value, inclusive."""
    privileged: bool = False
    """True for what a critic may see while training but no policy will have when it drives."""
    doc: str = ""
    """One sentence: what it is, with unit and sign."""


@dataclass(frozen=True)
class DiscreteActions:
    """One of `count` choices, an int64 in [0, count)."""

    count: int
    labels: tuple[str, ...] = ()
    """A name for each choice, for people; may be empty."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of one agent's action: a scalar."""
        return ()

    @property
    def dtype(self) -> type[np.int64]:
        """Type of the action array."""
        return np.int64


@dataclass(frozen=True)
class ContinuousActions:
    """A float32 vector with `low[i] <= action[i] <= high[i]`."""

    low: tuple[float, ...]
    high: tuple[float, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of one agent's action."""
        return (len(self.low),)

    @property
    def dtype(self) -> type[np.float32]:
        """Type of the action array."""
        return np.float32


@dataclass(frozen=True)
class MultiDiscreteActions:
    """One choice in each of K branches: int64 (K,), number k in [0, counts[k])."""

    counts: tuple[int, ...]
    """Choices of each branch."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of one agent's action."""
        return (len(self.counts),)

    @property
    def dtype(self) -> type[np.int64]:
        """Type of the action array."""
        return np.int64


@dataclass(frozen=True)
class HybridActions:
    """Numbers and choices at once: a float32 vector, the numbers first, then one whole number for each branch."""

    continuous: ContinuousActions
    discrete: MultiDiscreteActions

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of one agent's action."""
        return (self.continuous.shape[0] + self.discrete.shape[0],)

    @property
    def dtype(self) -> type[np.float32]:
        """Type of the action array; choices are exact in it up to 2^24."""
        return np.float32


@dataclass(frozen=True)
class GroupedActions:
    """Actions of several kinds of agents: a float32 vector as wide as the widest group's.

    An agent's own action stands in the first numbers of its row; a single choice is one number. See `AgentGroup`.
    """

    width: int

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of one agent's action."""
        return (self.width,)

    @property
    def dtype(self) -> type[np.float32]:
        """Type of the action array; choices are exact in it up to 2^24."""
        return np.float32


SingleActions = DiscreteActions | ContinuousActions | MultiDiscreteActions | HybridActions
"""What one policy can decide."""
ActionSpec = SingleActions | GroupedActions

POLICY_ID = "policy_id"
"""In a world with several groups: the observation, int64 (), that tells the number of an agent's group."""


@dataclass(frozen=True)
class AgentGroup:
    """Agents of one kind, with a policy of their own. Their observations stand in the world's as "group/name"."""

    observations: Mapping[str, ArraySpec]
    """By their own names."""
    actions: SingleActions
    has_action_mask: bool = False
    """Whether the first columns of the world's action mask are theirs."""


@dataclass(frozen=True)
class WorldSpec:
    """The shape of a world's promise."""

    name: str
    num_worlds: int
    """N: worlds stepped side by side."""
    num_agents: int
    """M: agents in each world."""
    observations: Mapping[str, ArraySpec]
    """Every observation by name; the order is the order of declaration."""
    actions: ActionSpec
    has_action_mask: bool = False
    """Whether `StepBuffers.action_mask` is written: one column for each choice, branch after branch."""
    groups: Mapping[str, AgentGroup] = field(default_factory=dict)
    """Kinds of agents by name, numbered in this order by the observation `POLICY_ID`; empty where all are alike."""
    tick_seconds: float = 0.0
    """Simulated seconds a step takes; 0 where the world has no clock."""


@dataclass
class StepBuffers:
    """Where a world writes one step; owned by the caller. Every array begins with (N, M)."""

    observations: dict[str, Array]
    final_observations: dict[str, Array]
    """The last observation of an episode that just ended; meaningful in ended rows only."""
    reward: Array
    """float32 (N, M)."""
    terminated: Array
    """bool (N, M)."""
    truncated: Array
    """bool (N, M)."""
    active: Array
    """bool (N, M): the coming action will be obeyed."""
    action_mask: Array | None = None
    """bool (N, M, A), True where a choice is allowed; None where the world has no mask. A is `mask_width`."""

    @property
    def ended(self) -> Array:
        """Which agents' episode ended in this step, bool (N, M)."""
        return np.asarray(self.terminated | self.truncated)


@runtime_checkable
class World(Protocol):
    """N worlds of M agents; see the page above for what one step promises."""

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise; never changes."""
        ...

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every world anew and write `observations`, `active` and `action_mask`.

        The same seed followed by the same actions tells the same story, bit for bit.
        """
        ...

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Advance every world by one tick. `actions` has shape (N, M, *spec.actions.shape)."""
        ...

    def save_state(self) -> dict[str, Array]:
        """Return everything the world needs to go on from here, as named arrays (copies)."""
        ...

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state and write `observations`, `active` and `action_mask` as they were."""
        ...

    def close(self) -> None:
        """Let go of processes and files; closing twice is closing once."""
        ...


@dataclass
class EpisodeRecord:
    """What one agent's finished episode came to."""

    world: int
    agent: int
    steps: int
    """Ticks, counting from the start of the episode."""
    reward: float
    """Sum of rewards."""
    status: str
    """How it ended, in the world's own words ("lap_complete", "off_track", "truncated" …)."""
    facts: dict[str, float] = field(default_factory=dict)
    """Further figures with their unit in the name ("progress_percent", "lap_seconds" …); "seconds": how long it took in
    the world's own time."""


@runtime_checkable
class ReportsEpisodes(Protocol):
    """A world that tells of its finished episodes in its own words."""

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call or `reset`, oldest first."""
        ...


@runtime_checkable
class RestartsEpisodes(Protocol):
    """A world that can break off every episode and begin the next, going on with its starts where it was."""

    def begin_episodes(self, buffers: StepBuffers) -> None:
        """Begin the next episode in every world and write `observations`, `active` and `action_mask`.

        Episodes that were broken off are not told of. An episode that has only begun is taken as it is.
        """
        ...


def mask_width(spec: WorldSpec | AgentGroup) -> int:
    """Return A, the columns of an action mask: one for each choice, branch after branch; 0 where nothing is chosen.

    >>> mask_width(AgentGroup({}, MultiDiscreteActions((3, 2)), has_action_mask=True))
    5
    """
    actions = spec.actions
    if isinstance(actions, DiscreteActions):
        return actions.count
    if isinstance(actions, MultiDiscreteActions):
        return sum(actions.counts)
    if isinstance(actions, HybridActions):
        return sum(actions.discrete.counts)
    if isinstance(actions, GroupedActions) and isinstance(spec, WorldSpec):
        return max(mask_width(group) for group in spec.groups.values() if group.has_action_mask)
    return 0


def allocate(spec: WorldSpec) -> StepBuffers:
    """Return buffers of the right shapes for a world, filled with zeros (masks with True).

    >>> spec = WorldSpec("toy", 2, 1, {"x": ArraySpec((3,), np.float32)}, DiscreteActions(4), has_action_mask=True)
    >>> buffers = allocate(spec)
    >>> buffers.observations["x"].shape, buffers.action_mask.shape
    ((2, 1, 3), (2, 1, 4))
    """
    rows = (spec.num_worlds, spec.num_agents)

    def named() -> dict[str, Array]:
        return {name: np.zeros(rows + part.shape, part.dtype) for name, part in spec.observations.items()}

    mask = None
    if spec.has_action_mask:
        if isinstance(spec.actions, ContinuousActions):
            raise ValueError(f"{spec.name}: an action mask needs choices to mask, found {spec.actions}")
        mask = np.ones((*rows, mask_width(spec)), bool)
    return StepBuffers(
        observations=named(),
        final_observations=named(),
        reward=np.zeros(rows, np.float32),
        terminated=np.zeros(rows, bool),
        truncated=np.zeros(rows, bool),
        active=np.ones(rows, bool),
        action_mask=mask,
    )
