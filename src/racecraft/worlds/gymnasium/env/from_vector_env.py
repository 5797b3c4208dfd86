"""A Gymnasium environment that brings a vector version of its own, as a `World`. Begin with `VectorEnvWorld`.

Such a version steps all its rows at once: CartPole's plays twenty games in the time that three take one by one. Its
rows share one stream of chance, so what a row meets depends on its neighbours, and a row that ended begins again in the
tick behind, in which its action is not obeyed. That serves to judge; worlds that are learned in tell every copy's story
by itself (`from_gymnasium.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec, load_env_creator
from gymnasium.vector import AutoresetMode

from racecraft.contract.errors import ContractError
from racecraft.contract.world import Array, DiscreteActions, EpisodeRecord, StepBuffers, WorldSpec
from racecraft.worlds.gymnasium.env.spaces import SOLE_NAME, Part, action_translation
from racecraft.worlds.gymnasium.env.user_env import call_env, contract_error


def has_vector_version(spec: EnvSpec) -> bool:
    """Tell whether an environment's registration names a vector version that `VectorEnvWorld` can open."""
    if spec.vector_entry_point is None or spec.additional_wrappers or spec.kwargs:
        return False
    entry = spec.vector_entry_point
    creator = entry if callable(entry) else load_env_creator(entry)
    return (getattr(creator, "metadata", None) or {}).get("autoreset_mode") == AutoresetMode.NEXT_STEP


def fits(envs: gymnasium.vector.VectorEnv) -> bool:
    """Tell whether its rows show one array and are told one choice or a row of numbers."""
    actions = envs.single_action_space
    plain = isinstance(actions, spaces.Discrete) or (isinstance(actions, spaces.Box) and len(actions.shape) == 1)
    seen = envs.single_observation_space
    is_array = isinstance(seen, spaces.Box) and bool(seen.shape) and not Part((), seen).is_channel_first
    return is_array and plain


class VectorEnvWorld:
    """The rows of a vector environment as N worlds of one agent.

    Args:
        name: What it is called.
        envs: The environment, which `fits`, and whose ended rows begin again in the next step.
    """

    def __init__(self, name: str, envs: gymnasium.vector.VectorEnv) -> None:
        self._envs, count = envs, envs.num_envs
        space = envs.single_observation_space
        assert isinstance(space, spaces.Box), "`fits` was not asked"
        actions = action_translation(envs.single_action_space, name).actions
        self._first_action = int(getattr(envs.single_action_space, "start", 0))
        observations = {SOLE_NAME: Part((), space).spec(f"{name}, observation '{SOLE_NAME}'")}
        self._spec = WorldSpec(name, count, 1, observations, actions)
        self._seed = 0
        self._taken: list[Array] = []
        self._ended = np.zeros(count, bool)
        self._earned, self._steps = np.zeros(count), np.zeros(count, np.int64)
        self._finished: list[EpisodeRecord] = []
        self._begun = self._closed = False

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise."""
        return self._spec

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every row anew."""
        self._seed, self._begun = seed, True
        self._taken.clear()
        self._forget_episodes()
        seen, _ = call_env(self._envs, "reset", seed=seed % (1 << 31))
        self._ended[:] = False
        self._show(seen, buffers.observations, slice(None))
        buffers.active[:] = True

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Advance every row by one tick; of those that ended before, this tick is their beginning."""
        if not self._begun:
            raise ContractError("{name}: step before reset; expected reset first.", name=self._spec.name)
        flat_actions = actions[:, 0].copy()
        self._taken.append(flat_actions)
        if isinstance(self._spec.actions, DiscreteActions):
            flat_actions = flat_actions.astype(np.int64) + self._first_action
        seen, reward, terminated, truncated, _ = call_env(self._envs, "step", flat_actions)
        if not np.isfinite(reward).all():
            raise contract_error(self._envs, "step", "reward", reward, "numbers", "nothing is learned from it")
        plays = ~self._ended
        buffers.reward[:, 0] = reward
        buffers.reward[self._ended, 0] = 0.0
        buffers.terminated[:, 0], buffers.truncated[:, 0] = terminated & plays, truncated & plays
        self._ended = (terminated | truncated) & plays
        self._show(seen, buffers.observations, slice(None))
        buffers.active[:, 0] = ~self._ended
        self._earned += buffers.reward[:, 0]
        self._steps += plays
        if self._ended.any():
            self._show(seen[self._ended], buffers.final_observations, self._ended)
            self._finish(buffers)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, oldest first."""
        finished, self._finished = self._finished, []
        return finished

    def save_state(self) -> dict[str, Array]:
        """Return the seed and every action since: the whole is one story, so it is told again from its beginning."""
        shape = (len(self._taken), self._spec.num_worlds, *self._spec.actions.shape)
        taken = np.array(self._taken, self._spec.actions.dtype).reshape(shape)
        return {"seed": np.array(self._seed, np.int64), "actions": taken}

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Begin the saved story again and play its actions up to where it was."""
        self.reset(buffers, int(state["seed"]))
        for actions in state["actions"]:
            self.step(actions[:, None], buffers)
        self._finished.clear()

    def close(self) -> None:
        """Close it; closing twice is closing once."""
        if not self._closed:
            self._closed = True
            call_env(self._envs, "close")

    def _forget_episodes(self) -> None:
        self._earned[:], self._steps[:] = 0.0, 0
        self._finished.clear()

    def _finish(self, buffers: StepBuffers) -> None:
        """Note the episodes that ended in this tick."""
        for n in np.flatnonzero(self._ended).tolist():
            status = "terminated" if buffers.terminated[n, 0] else "truncated"
            self._finished.append(EpisodeRecord(n, 0, int(self._steps[n]), float(self._earned[n]), status))
        self._earned[self._ended], self._steps[self._ended] = 0.0, 0

    def _show(self, seen: Any, named: dict[str, Array], rows: Any) -> None:
        try:
            named[SOLE_NAME][rows, 0] = seen
        except (TypeError, ValueError) as error:
            space = self._envs.observation_space
            raise contract_error(self._envs, "step", "observation", seen, space, error) from error
