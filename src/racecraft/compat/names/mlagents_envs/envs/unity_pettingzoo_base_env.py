"""What the two PettingZoo faces of a scene share: who is there, what each sees, earns and may do.

They keep to the PettingZoo that is installed (terminations and truncations apart, `reset(seed, options)`), not to the
1.15 of ML-Agents' days. The rest is ML-Agents': agents are named `Behavior?team=0?agent_id=3`, with the id that Unity
gives, so a new episode is a new agent; an observation is an array, or a list of them; with choices that may be masked
`{"observation": ..., "action_mask": [...]}`, True where a choice is forbidden. Rewards are the agent's own; its group's
stands in `infos`. Continuous actions are float32, where ML-Agents drew whole numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.compat.names.gym import error, spaces
from racecraft.compat.names.mlagents_envs.base_env import (
    ActionSpec,
    ActionTuple,
    BaseEnv,
    BehaviorSpec,
    DecisionSteps,
    TerminalSteps,
)
from racecraft.compat.names.mlagents_envs.envs.env_helpers import agent_name, behavior_of


class UnityPettingzooBaseEnv:
    """Agents of a low-level environment, by name.

    Args:
        env: The environment; it is closed with this one.
        seed: Of the spaces.
        metadata: PettingZoo's.
    """

    def __init__(self, env: BaseEnv, seed: int | None = None, metadata: dict[str, Any] | None = None) -> None:
        self._env: BaseEnv | None = env
        self._seed = seed
        self.metadata = metadata or {"render_modes": [], "name": "unity"}
        self.render_mode = None
        self.agents: list[str] = []
        self.possible_agents: list[str] = []
        """All that were ever seen in this game; Unity tells no more beforehand."""
        self.rewards: dict[str, float] = {}
        self.terminations: dict[str, bool] = {}
        self.truncations: dict[str, bool] = {}
        self.infos: dict[str, dict[str, Any]] = {}
        self._seen: dict[str, Any] = {}
        self._rows: dict[str, tuple[str, int]] = {}
        self._spaces: dict[str, tuple[Any, Any]] = {}
        if not env.behavior_specs:
            env.reset()
        self._begin_game()

    @property
    def observation_spaces(self) -> dict[str, Any]:
        """What each agent sees."""
        return {agent: self.observation_space(agent) for agent in self.possible_agents}

    @property
    def action_spaces(self) -> dict[str, Any]:
        """What each agent does."""
        return {agent: self.action_space(agent) for agent in self.possible_agents}

    def observation_space(self, agent: str) -> Any:
        """Return what an agent sees: a Box, or a Tuple of them; the same object for all agents of its behavior."""
        return self._spaces_of(behavior_of(agent))[0]

    def action_space(self, agent: str) -> Any:
        """Return what an agent does: Discrete, MultiDiscrete, Box, or a Tuple of Box and either."""
        return self._spaces_of(behavior_of(agent))[1]

    @property
    def side_channel(self) -> dict[str, Any]:
        """The environment's side channels, by the name of their class."""
        manager = getattr(self._loaded, "_side_channel_manager", None)
        return {} if manager is None else {type(channel).__name__: channel for channel in manager.channels}

    def seed(self, seed: int | None = None) -> None:
        """Seed the spaces anew."""
        self._seed = seed
        self._spaces.clear()

    def render(self) -> None:
        """Show nothing: the player has a window of its own."""

    def state(self) -> Any:
        """Refuse: a scene tells what its agents see, and no more."""
        raise NotImplementedError("a Unity scene has no state beyond what its agents see")

    def close(self) -> None:
        """Close the environment; twice is once."""
        env, self._env = self._env, None
        if env is not None:
            env.close()

    @property
    def _loaded(self) -> BaseEnv:
        if self._env is None:
            raise error.Error("the environment is closed; open another.")
        return self._env

    def _begin_game(self) -> None:
        self._loaded.reset()
        self.possible_agents = []
        self._hear()
        self.rewards = dict.fromkeys(self.agents, 0.0)

    def _act(self, actions: dict[str, Any]) -> None:
        """Send one action an agent that asks; who is left out gets zeros."""
        env = self._loaded
        by_behavior: dict[str, ActionTuple] = {}
        for name, spec in env.behavior_specs.items():
            by_behavior[name] = spec.action_spec.empty_action(
                sum(behavior == name for behavior, _ in self._rows.values())
            )
        for agent, action in actions.items():
            name, row = self._rows[agent]
            numbers, choices = _parts(env.behavior_specs[name].action_spec, action)
            by_behavior[name].continuous[row], by_behavior[name].discrete[row] = numbers, choices
        for name, action in by_behavior.items():
            env.set_actions(name, action)
        env.step()
        self._hear()

    def _hear(self) -> None:
        """Take in who asks and who left; both are `agents` until the next step."""
        self._seen, self._rows = {}, {}
        self.rewards, self.terminations, self.truncations, self.infos = {}, {}, {}, {}
        for name in self._loaded.behavior_specs:
            decisions, ended = self._loaded.get_steps(name)
            for row, agent_id in enumerate(ended.agent_id):
                agent = agent_name(name, int(agent_id))
                self._tell(agent, name, ended, row)
                cut = bool(ended.interrupted[row])
                self.terminations[agent], self.truncations[agent] = not cut, cut
                self.infos[agent]["interrupted"] = cut
            for row, agent_id in enumerate(decisions.agent_id):
                agent = agent_name(name, int(agent_id))
                self._tell(agent, name, decisions, row)
                self.terminations[agent] = self.truncations[agent] = False
                self._rows[agent] = name, row
                if decisions.action_mask is not None:
                    masks = [mask[row] for mask in decisions.action_mask]
                    self._seen[agent] = {"observation": self._seen[agent], "action_mask": masks}
        self.agents = sorted(self._seen)
        self.possible_agents = sorted({*self.possible_agents, *self.agents})

    def _tell(self, agent: str, behavior: str, rows: DecisionSteps | TerminalSteps, row: int) -> None:
        seen = [values[row] for values in rows.obs]
        self._seen[agent] = seen if len(seen) > 1 else seen[0]
        self.rewards[agent] = float(rows.reward[row])
        self.infos[agent] = {
            "behavior_name": behavior,
            "group_id": int(rows.group_id[row]),
            "group_reward": float(rows.group_reward[row]) if len(rows.group_reward) else 0.0,
        }

    def _spaces_of(self, behavior: str) -> tuple[Any, Any]:
        if behavior not in self._spaces:
            made = _spaces_for(self._loaded.behavior_specs[behavior])
            if self._seed is not None:
                for space in made:
                    space.seed(self._seed)
            self._spaces[behavior] = made
        return self._spaces[behavior]


def _spaces_for(spec: BehaviorSpec) -> tuple[Any, Any]:
    boxes = [spaces.Box(-np.inf, np.inf, part.shape, np.float32) for part in spec.observation_specs]
    of = spec.action_spec
    numbers = spaces.Box(-1.0, 1.0, (of.continuous_size,), np.float32)
    choices: Any = spaces.Discrete(of.discrete_branches[0]) if of.discrete_size == 1 else None
    if of.discrete_size > 1:
        choices = spaces.MultiDiscrete(list(of.discrete_branches))
    if choices is None and not of.continuous_size:
        raise error.Error("the agent has no actions; expected numbers, choices or both.")
    does = numbers if choices is None else spaces.Tuple((numbers, choices)) if of.continuous_size else choices
    return boxes[0] if len(boxes) == 1 else spaces.Tuple(boxes), does


def _parts(spec: ActionSpec, action: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Split an action of the space into numbers and choices.

    Raises:
        gym.error.Error: It does not fit.
    """
    both = spec.continuous_size and spec.discrete_size
    numbers, choices = action if both else (action, ()) if spec.continuous_size else ((), action)
    parts = np.asarray(numbers, np.float32).reshape(-1), np.asarray(choices, np.int32).reshape(-1)
    if (len(parts[0]), len(parts[1])) != (spec.continuous_size, spec.discrete_size):
        raise error.Error(
            f"an action of {len(parts[0])} numbers and {len(parts[1])} choices; expected {spec.continuous_size} and "
            f"{spec.discrete_size}."
        )
    return parts
