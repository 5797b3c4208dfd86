"""`UnityToGymWrapper`: a scene of one agent and one behavior as an old-style `gym.Env`.

Where a `gym` is installed the wrapper is one of its environments, else one of ours.
"""

from __future__ import annotations

import importlib
import itertools
from importlib.machinery import PathFinder
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from racecraft.compat.names.mlagents_envs.base_env import ActionTuple, BaseEnv, DecisionSteps, TerminalSteps

if TYPE_CHECKING:
    from racecraft.compat.names import gym
    from racecraft.compat.names.gym import error, spaces
else:
    _home = "gym" if PathFinder.find_spec("gym") else "racecraft.compat.names.gym"
    gym = importlib.import_module(_home)
    error, spaces = importlib.import_module(f"{_home}.error"), importlib.import_module(f"{_home}.spaces")


class UnityGymException(error.Error):
    """The scene, or how it was used, does not fit."""


class UnityToGymWrapper(gym.Env):  # without a subscript: a real gym's may not be generic
    """One agent.

    Args:
        unity_env: The player.
        uint8_visual: Pictures as uint8 instead of float32 in [0, 1].
        flatten_branched: Several branches as one choice among all combinations.
        allow_multiple_obs: All observations as a list, pictures first; else the first picture, or the vectors in a row.
        action_space_seed: Seed of `action_space`.

    Raises:
        UnityGymException: Several behaviors or agents, or actions that are numbers and choices at once.
    """

    def __init__(
        self,
        unity_env: BaseEnv,
        uint8_visual: bool = False,
        flatten_branched: bool = False,
        allow_multiple_obs: bool = False,
        action_space_seed: int | None = None,
    ) -> None:
        self._env, self._uint8, self._many = unity_env, uint8_visual, allow_multiple_obs
        self.game_over = False
        if not unity_env.behavior_specs:
            unity_env.reset()
        names = list(unity_env.behavior_specs)
        if len(names) != 1:
            raise UnityGymException(f"the scene has behaviors {', '.join(names)}; this wrapper is for one.")
        self.name = names[0]
        self.group_spec = unity_env.behavior_specs[self.name]
        self._pictures = [i for i, part in enumerate(self.group_spec.observation_specs) if len(part.shape) == 3]
        self._vectors = [i for i, part in enumerate(self.group_spec.observation_specs) if len(part.shape) == 1]
        if not self._pictures and not self._vectors:
            raise UnityGymException("the agent sees neither numbers nor pictures.")
        self._flattener: ActionFlattener | None = None
        self.action_space = self._make_action_space(flatten_branched)
        if action_space_seed is not None:
            self.action_space.seed(action_space_seed)
        self.observation_space = self._make_observation_space()
        self._require_one(len(unity_env.get_steps(self.name)[0]))

    @property
    def observation_size(self) -> int:
        """How many sensors."""
        return len(self.group_spec.observation_specs)

    def reset(self) -> Any:
        """Begin an episode and return what is seen."""
        self._env.reset()
        self.game_over = False
        decisions, _ = self._env.get_steps(self.name)
        self._require_one(len(decisions))
        return self._observation(decisions)

    def step(self, action: Any) -> tuple[Any, float, bool, dict[str, Any]]:
        """Act once.

        Returns:
            Observation, reward, whether the episode ended, and `{"step": …}`, ML-Agents' own row. Whether it was cut by
            the clock stands there as `interrupted`.
        """
        if self.game_over:
            raise UnityGymException("the episode is over; call reset() first.")
        self._env.set_actions(self.name, self._action(action))
        self._env.step()
        decisions, ended = self._env.get_steps(self.name)
        while not len(decisions) and not len(ended):
            self._env.step()
            decisions, ended = self._env.get_steps(self.name)
        self.game_over = len(ended) > 0
        steps: DecisionSteps | TerminalSteps = ended if self.game_over else decisions
        self._require_one(len(steps))
        return self._observation(steps), float(steps.reward[0]), self.game_over, {"step": steps}

    def render(self, mode: str = "rgb_array") -> NDArray[Any] | None:
        """Return the picture that the agent saw last; None without one."""
        decisions, ended = self._env.get_steps(self.name)
        steps: DecisionSteps | TerminalSteps = ended if len(ended) else decisions
        return self._picture(steps.obs[self._pictures[0]][0]) if self._pictures else None

    def seed(self, seed: Any = None) -> None:
        """Do nothing: players take their seed when they start."""

    def close(self) -> None:
        """End the player."""
        self._env.close()

    def _make_action_space(self, flatten: bool) -> Any:
        spec = self.group_spec.action_spec
        if spec.is_continuous():
            return spaces.Box(-1.0, 1.0, (spec.continuous_size,), np.float32)
        if not spec.is_discrete():
            raise UnityGymException("the agent's actions are numbers and choices at once; this wrapper is for either.")
        if spec.discrete_size == 1:
            return spaces.Discrete(spec.discrete_branches[0])
        if flatten:
            self._flattener = ActionFlattener(spec.discrete_branches)
            return self._flattener.action_space
        return spaces.MultiDiscrete(list(spec.discrete_branches))

    def _make_observation_space(self) -> Any:
        shapes = [part.shape for part in self.group_spec.observation_specs]
        boxes: list[Any] = []
        for index in self._pictures:
            high, kind = (255, np.uint8) if self._uint8 else (1.0, np.float32)
            boxes.append(spaces.Box(0, high, shapes[index], kind))
        if self._vectors:
            width = sum(shapes[index][0] for index in self._vectors)
            boxes.append(spaces.Box(-np.inf, np.inf, (width,), np.float32))
        return spaces.Tuple(boxes) if self._many else boxes[0]

    def _observation(self, steps: DecisionSteps | TerminalSteps) -> Any:
        parts = [self._picture(steps.obs[index][0]) for index in self._pictures]
        if self._vectors:
            parts.append(np.concatenate([steps.obs[index][0] for index in self._vectors]))
        return parts if self._many else parts[0]

    def _picture(self, picture: NDArray[Any]) -> NDArray[Any]:
        return np.round(picture * 255).astype(np.uint8) if self._uint8 else picture

    def _action(self, action: Any) -> ActionTuple:
        spec = self.group_spec.action_spec
        if self._flattener is not None:
            action = self._flattener.lookup_action(int(action))
        row = np.asarray(action).reshape(1, -1)
        return ActionTuple(continuous=row) if spec.is_continuous() else ActionTuple(discrete=row)

    def _require_one(self, agents: int) -> None:
        if agents > 1:
            raise UnityGymException(f"{agents} agents ask at once; this wrapper is for one.")


class ActionFlattener:
    """Several branches as one choice among all their combinations."""

    def __init__(self, branched_action_space: Any) -> None:
        self._combinations = list(itertools.product(*map(range, branched_action_space)))
        self.action_space = spaces.Discrete(len(self._combinations))

    def lookup_action(self, action: int) -> list[int]:
        """Return what a choice means, a number a branch."""
        return list(self._combinations[action])


__all__ = ["ActionFlattener", "UnityGymException", "UnityToGymWrapper"]
