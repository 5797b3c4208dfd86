"""Any Gymnasium environment as a `World`: N copies side by side, one agent each. Begin with `GymnasiumWorld`.

The copies are stepped here one after the other and not by `gymnasium.vector`, for three reasons: observations go
straight into the caller's arrays; an ended copy begins again in the same step with its final observation kept; and
every episode is begun with a seed of its own, a pure function of (seed, copy, episode). So copy n tells the same story
whatever runs beside it, and the world can be saved without any pickle: a saved state is the episode's number and the
actions taken since it began, and loading it plays them again. That asks one thing of the environment: an episode must
depend on nothing but its seed and its actions.

An episode of more than MAX_HISTORY actions is not kept: after loading, that copy begins its next episode. `spaces.py`
says which spaces there are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np

from racecraft.contract.errors import ContractError, UserInputError
from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array, StepBuffers, WorldSpec
from racecraft.worlds.gymnasium.env.spaces import action_translation, parts_of
from racecraft.worlds.gymnasium.env.user_env import (
    call_env,
    call_reset,
    contract_error,
    made,
    reward_given,
    step_env,
)

MAX_HISTORY = 20_000
"""Actions of one episode that are kept, to play it again after loading."""


class GymnasiumWorld:
    """N copies of a Gymnasium environment as a world.

    Args:
        make: The environment's id, such as "CartPole-v1", or a function that returns a new environment.
        num_worlds: N, copies side by side.
        settings: Further arguments of `gymnasium.make`.

    Raises:
        UserInputError: No such environment, or a space that cannot be shown.
    """

    def __init__(self, make: str | Callable[[], gymnasium.Env], num_worlds: int, **settings: Any) -> None:
        self._envs = [_make(make, settings) for _ in range(num_worlds)]
        first = self._envs[0]
        name = make if isinstance(make, str) else type(first.unwrapped).__name__
        self._parts = parts_of(first.observation_space, name)
        self._translation = action_translation(first.action_space, name)
        observations = {key: part.spec(f"{name}, observation '{key}'") for key, part in self._parts.items()}
        self._spec = WorldSpec(name, num_worlds, 1, observations, self._translation.actions)
        self._seed = 0
        self._episode = np.zeros(num_worlds, np.int64)
        self._history: list[list[Any]] = [[] for _ in range(num_worlds)]
        self._steps = np.zeros(num_worlds, np.int64)
        self._keys = stream_keys(0, "gymnasium episodes", num_worlds)
        self._parked = np.zeros(num_worlds, bool)
        self._seen: list[Any] = [None] * num_worlds
        self._begun = self._closed = False

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise."""
        return self._spec

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every copy anew."""
        self._set_seed(seed)
        self._episode[:] = 0
        self._parked[:] = False
        for n in range(self._spec.num_worlds):
            self._show(self._begin(n), buffers.observations, n)
        buffers.active[:] = True
        self._begun = True

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Advance every copy by one tick; ended ones begin again at once."""
        if not self._begun:
            raise ContractError("{name}: step before reset; expected reset first.", name=self._spec.name)
        buffers.active[:] = True
        for n, env in enumerate(self._envs):
            if self._parked[n]:
                self._stand(n, buffers)
                continue
            seen, reward, terminated, truncated, _ = step_env(env, self._translation.to_environment(actions[n, 0]))
            self._note(n, actions[n, 0])
            buffers.reward[n, 0] = reward_given(env, reward)
            buffers.terminated[n, 0] = terminated
            buffers.truncated[n, 0] = truncated
            if terminated or truncated:
                self._show(seen, buffers.final_observations, n)
                self._episode[n] += 1
                seen = self._begin(n)
            self._show(seen, buffers.observations, n)

    def freeze(self, rows: Array) -> None:
        """Leave copies (bool (N, 1)) standing until the next reset: they are not stepped and show what they showed."""
        self._parked[:] = rows[:, 0]

    def rest(self, rows: Array) -> None:
        """Leave copies standing whose episodes have been judged; see `freeze`."""
        self.freeze(rows)

    def save_state(self) -> dict[str, Array]:
        """Return the seed, each copy's episode and the actions taken in it; length -1: too many to keep."""
        lengths = np.where(self._steps > MAX_HISTORY, -1, self._steps)
        actions = self._spec.actions
        taken = np.zeros((len(lengths), int(max(0, lengths.max())), *actions.shape), actions.dtype)
        for n, history in enumerate(self._history):
            if history:
                taken[n, : len(history)] = np.asarray(history)
        return {
            "seed": np.array(self._seed, np.int64),
            "episode": self._episode.copy(),
            "lengths": lengths,
            "actions": taken,
        }

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Begin the saved episodes again and play their actions up to where they were."""
        self._set_seed(int(state["seed"]))
        self._episode[:] = state["episode"] + (state["lengths"] < 0)
        for n, env in enumerate(self._envs):
            seen = self._begin(n)
            for k in range(int(state["lengths"][n])):
                seen = step_env(env, self._translation.to_environment(state["actions"][n, k]))[0]
                self._note(n, state["actions"][n, k])
            self._show(seen, buffers.observations, n)
        buffers.active[:] = True
        self._parked[:] = False
        self._begun = True

    def close(self) -> None:
        """Close every copy; closing twice is closing once."""
        if not self._closed:
            self._closed = True
            for env in self._envs:
                call_env(env, "close")

    def _set_seed(self, seed: int) -> None:
        self._seed = seed
        self._keys = stream_keys(seed, "gymnasium episodes", self._spec.num_worlds)

    def _begin(self, n: int) -> Any:
        """Begin the present episode of copy n and return what it shows."""
        self._history[n], self._steps[n] = [], 0
        key = (int(self._keys[n]) + 0x9E3779B97F4A7C15 * int(self._episode[n])) % (1 << 64)
        seen, _ = call_reset(self._envs[n], key >> 33)
        return seen

    def _stand(self, n: int, buffers: StepBuffers) -> None:
        """Show of a parked copy what it showed when it was parked; nothing comes of its tick."""
        buffers.reward[n, 0] = 0.0
        buffers.terminated[n, 0] = buffers.truncated[n, 0] = False
        self._show(self._seen[n], buffers.observations, n)

    def _note(self, n: int, action: Any) -> None:
        """Keep an action, so that the episode can be played again; forget an episode that is too long for that."""
        self._steps[n] += 1
        if self._steps[n] > MAX_HISTORY:
            self._history[n].clear()
        else:
            self._history[n].append(np.copy(action))

    def _show(self, seen: Any, named: dict[str, Array], n: int) -> None:
        self._seen[n] = seen
        try:
            for name, part in self._parts.items():
                part.show(seen, named[name][n, 0])
        except (LookupError, TypeError, ValueError) as error:
            env, method = self._envs[n], "step" if self._steps[n] else "reset"
            raise contract_error(env, method, "observation", seen, env.observation_space, error) from error


def _make(make: str | Callable[[], gymnasium.Env], settings: dict[str, Any]) -> gymnasium.Env:
    env: gymnasium.Env = made(make if callable(make) else lambda: _registered(make, settings))
    return env


def _registered(name: str, settings: dict[str, Any]) -> gymnasium.Env:
    try:
        return gymnasium.make(name, disable_env_checker=True, **settings)
    except gymnasium.error.Error as error:
        raise UserInputError(
            "Gymnasium cannot make '{name}': {error}. Expected an id that is registered and whose packages are "
            "installed, such as CartPole-v1.",
            name=name,
            error=error,
        ) from error


def make_world(environment: str | Callable[[], gymnasium.Env], num_worlds: int = 1, **settings: Any) -> GymnasiumWorld:
    """Return copies of an environment side by side, for `rc.make_world`; settings go to `gymnasium.make`."""
    return GymnasiumWorld(environment, num_worlds, **settings)
