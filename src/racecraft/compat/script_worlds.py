"""A script's own environment as a world where a Gymnasium environment is too narrow. Begin with `ScriptWorld`.

Two kinds need it: RLlib's `MultiAgentEnv`, whose reset and step give dictionaries by agent, and environments that show
an `action_mask` beside what is seen. Each agent is a column of the world; policies of different names are groups of the
contract's. As with `GymnasiumWorld`, a saved state is the episode's number and the actions taken in it.

Agents are those that the first reset shows, and those that the environment names (`possible_agents`, `get_agent_ids`).
One that is not shown need not act: its row is inactive until it is shown again. One that is done rests until the whole
episode is over (`__all__`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from racecraft.algorithms.multi_policy import group_spec, narrow
from racecraft.compat.episode_listener import EpisodeListener, FinishedEpisodes, WatchedEpisode
from racecraft.compat.old_gym import start_episode, takes_seed
from racecraft.contract.errors import ContractError, SettingError
from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import (
    POLICY_ID,
    AgentGroup,
    Array,
    ArraySpec,
    DiscreteActions,
    GroupedActions,
    StepBuffers,
    WorldSpec,
    allocate,
    mask_width,
)
from racecraft.worlds.gymnasium.env.spaces import action_translation, parts_of
from racecraft.worlds.gymnasium.env.user_env import call_env, contract_error, made, reward_given

MASK, ALL, SOLE_AGENT = "action_mask", "__all__", "agent_0"
PLACE = "racecraft.compat.script_worlds"


@dataclass(frozen=True)
class PolicyWords:
    """What a script says of one policy."""

    observation_space: Any = None
    """None: the environment's."""
    action_space: Any = None
    settings: tuple[str, ...] = ()
    """Of its own, as after --set."""


@dataclass(frozen=True)
class Described:
    """What a script says of its environment and of who acts in it."""

    name: str
    make: Callable[[], Any]
    horizon: int | None
    """Ticks after which an episode is cut, its value still follows; None: it ends by itself."""
    policies: Mapping[str, PolicyWords]
    policy_of: Callable[[Any], str]
    """Names an agent's policy."""
    still: frozenset[str] = frozenset()
    """Policies that act and learn nothing."""
    takes_mask: bool = True
    """Whether an observation `action_mask` is one; a model of the script's own reads it itself."""
    tally: FinishedEpisodes | None = field(default_factory=FinishedEpisodes)
    """Hears of training episodes."""
    listener: EpisodeListener | None = None
    """Hears of them tick by tick."""


class SoleAgent:
    """An environment of one agent in the manner of many."""

    def __init__(self, env: Any) -> None:
        self.env = env
        self.observation_space, self.action_space = env.observation_space, env.action_space

    def reset(self, seed: int | None = None) -> dict[str, Any]:
        """Begin an episode."""
        first = start_episode(self.env, seed)
        is_new = isinstance(first, tuple) and len(first) == 2 and isinstance(first[1], dict)
        return {SOLE_AGENT: first[0] if is_new else first}

    def step(self, actions: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
        """Act once."""
        seen, reward, *ends, info = self.env.step(actions[SOLE_AGENT])
        over = [{ALL: bool(one)} for one in ends]
        return {SOLE_AGENT: seen}, {SOLE_AGENT: reward}, *over, {SOLE_AGENT: info}

    def close(self) -> None:
        """Let go of it."""
        if hasattr(self.env, "close"):
            self.env.close()


class ScriptWorld:
    """N copies of a script's environment.

    Args:
        num_worlds: N, copies side by side.

    Raises:
        UserInputError: A space that cannot be shown, an agent without a policy, a policy that nobody described.
    """

    described: ClassVar[Described]
    worlds_made: ClassVar[int] = 0
    """The first world that is made is learned in; others are judged in, and are not tallied."""

    def __init__(self, num_worlds: int) -> None:
        described, offered_as = self.described, _class_with(type(self), "described")
        self._tally = described.tally if offered_as.worlds_made == 0 else None
        self._listener = described.listener if offered_as.worlds_made == 0 else None
        offered_as.worlds_made += 1
        self._envs = [made(described.make) for _ in range(num_worlds)]
        if self._listener is not None:
            for env in self._envs:
                self._listener.on_env(getattr(env, "env", env) if isinstance(env, SoleAgent) else env)
        self._agents = agents_of(self._envs[0])
        self._place = {agent: m for m, agent in enumerate(self._agents)}
        self._policy = [_policy_of(described, agent) for agent in self._agents]
        used = [name for name in described.policies if name in self._policy]
        self._kinds = {name: _Kind(self._envs[0], self._agent_with(name), name, described) for name in used}
        self._spec = _spec(described.name, num_worlds, len(self._agents), self._kinds)
        self._number = [used.index(name) for name in self._policy]
        self._seed, self._keys = 0, stream_keys(0, "script episodes", num_worlds)
        self._episode, self._steps = np.zeros(num_worlds, np.int64), np.zeros(num_worlds, np.int64)
        rows = (num_worlds, len(self._agents))
        self._active, self._over = np.zeros(rows, bool), np.zeros(rows, bool)
        self._earned = np.zeros(rows)
        self._history: list[list[Array]] = [[] for _ in range(num_worlds)]
        self._shown = allocate(self._spec)
        self._begun = self._closed = False

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise."""
        return self._spec

    @property
    def group_settings(self) -> dict[str, tuple[str, ...]]:
        """What a group's learner has otherwise, as after --set."""
        return {name: self.described.policies[name].settings for name in self._spec.groups}

    @property
    def still_groups(self) -> frozenset[str]:
        """Groups that act and learn nothing."""
        return self.described.still

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every copy anew."""
        self._set_seed(seed)
        self._episode[:] = 0
        for n in range(self._spec.num_worlds):
            self._begin(n)
        self._write_observations(buffers)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Advance every copy by one tick; ended ones begin again at once."""
        if not self._begun:
            raise ContractError("{name}: step before reset; expected reset first.", name=self._spec.name)
        for n in range(self._spec.num_worlds):
            if self._advance(n, actions[n], buffers):
                self._tell(n)
                self._episode[n] += 1
                self._begin(n)
        self._write_observations(buffers)

    def save_state(self) -> dict[str, Array]:
        """Return the seed, each copy's episode and the actions taken in it."""
        lengths = np.array([len(taken) for taken in self._history], np.int64)
        taken = np.zeros(
            (len(lengths), int(lengths.max()), len(self._agents), *self._spec.actions.shape), self._spec.actions.dtype
        )
        for n, history in enumerate(self._history):
            if history:
                taken[n, : len(history)] = history
        return {"seed": np.array(self._seed, np.int64), "episode": self._episode.copy(), "lengths": lengths,
                "actions": taken}  # fmt: skip

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Begin the saved episodes again and play their actions up to where they were."""
        self._set_seed(int(state["seed"]))
        self._episode[:] = state["episode"]
        for n in range(self._spec.num_worlds):
            self._begin(n)
            for k in range(int(state["lengths"][n])):
                self._advance(n, state["actions"][n, k], buffers)
        self._write_observations(buffers)

    def close(self) -> None:
        """Close every copy; closing twice is closing once."""
        if not self._closed:
            self._closed = True
            for env in self._envs:
                if callable(getattr(env, "close", None)):
                    call_env(env, "close")

    def _set_seed(self, seed: int) -> None:
        self._seed, self._begun = seed, True
        self._keys = stream_keys(seed, "script episodes", self._spec.num_worlds)

    def _begin(self, n: int) -> None:
        """Begin the present episode of copy n and show it."""
        key = (int(self._keys[n]) + 0x9E3779B97F4A7C15 * int(self._episode[n])) % (1 << 64)
        seen = begin_episode_of(self._envs[n], key >> 33)
        seen = seen[0] if isinstance(seen, tuple) else seen
        self._history[n], self._steps[n] = [], 0
        self._active[n], self._over[n], self._earned[n] = False, False, 0.0
        for m, number in enumerate(self._number):
            if POLICY_ID in self._shown.observations:
                self._shown.observations[POLICY_ID][n, m] = number
        self._show(n, seen, self._shown.observations)
        if self._listener is not None:
            self._listener.on_start(n, dict(zip(self._agents, self._policy, strict=True)), seen)

    def _advance(self, n: int, actions: Array, buffers: StepBuffers) -> bool:
        """Advance copy n by one tick; tell whether its episode is over."""
        results = {
            agent: self._kinds[self._policy[m]].action(actions[m], grouped=bool(self._spec.groups))
            for m, agent in enumerate(self._agents)
            if self._active[n, m]
        }
        seen, rewards, terminated, truncated, infos = self._ask(self._envs[n], results)
        self._history[n].append(np.array(actions))
        self._steps[n] += 1
        is_over, is_cut = bool(terminated.get(ALL, False)), bool(truncated.get(ALL, False))
        horizon = self.described.horizon
        is_cut = is_cut or (horizon is not None and not is_over and self._steps[n] >= horizon)
        for m, agent in enumerate(self._agents):
            reward = rewards.get(agent, 0.0)
            self._earned[n, m] += reward
            ended = not self._over[n, m] and (is_over or bool(terminated.get(agent, False)))
            cut = not self._over[n, m] and not ended and (is_cut or bool(truncated.get(agent, False)))
            buffers.reward[n, m] = reward
            buffers.terminated[n, m], buffers.truncated[n, m] = ended, cut
            if ended or cut:
                for name, last in self._shown.observations.items():
                    buffers.final_observations[name][n, m] = last[n, m]
            self._over[n, m] |= ended or cut
        observations = {agent: seen[agent] for agent in seen if agent in self._place}
        self._show(n, observations, buffers.final_observations, only=buffers.ended[n])
        self._active[n] = False
        if set(seen) - set(self._place) - {ALL}:
            new = ", ".join(map(repr, sorted(map(str, set(seen) - set(self._place)))))
            raise SettingError(
                "{name}: step shows agent {new}, which the first reset did not; expected every agent in "
                "the first reset, or named by the environment's possible_agents.",
                name=self._spec.name,
                new=new,
            )
        going_on = {one: seen[one] for one in observations if not self._over[n, self._place[one]]}
        self._show(n, going_on, self._shown.observations)
        if self._listener is not None:
            self._listener.on_step(n, results, seen, rewards, infos)
        return is_over or is_cut or bool(self._over[n].all())

    def _ask(self, env: Any, actions: Mapping[Any, Any]) -> tuple[Any, Any, Any, Any, Any]:
        """Step an environment, old or new; return what is seen, what was earned, whose end it is, and what is said."""
        result = call_env(env, "step", actions)
        try:
            seen, rewards, *ends, infos = result
            terminated, truncated = ends if len(ends) == 2 else (*ends, {})
            rewards = {agent: reward_given(env, earned) for agent, earned in {**rewards}.items()}
            return {**seen}, rewards, {**terminated}, {**truncated}, dict(infos) if isinstance(infos, Mapping) else {}
        except (TypeError, ValueError) as error:
            expected = "dictionaries by agent: (observations, rewards, terminated, truncated, infos)"
            raise contract_error(env, "step", "its answer", result, expected, error) from error

    def _show(self, n: int, seen: Mapping[Any, Any], into: dict[str, Array], only: Array | None = None) -> None:
        """Write what agents see; into what is shown next, they are active then."""
        for agent, value in seen.items():
            m = self._place.get(agent)
            if m is None or (only is not None and not only[m]):
                continue
            kind = self._kinds[self._policy[m]]
            try:
                kind.show(value, into, (n, m), f"{kind.name}/" if self._spec.groups else "")
            except (LookupError, TypeError, ValueError) as error:
                method = "step" if self._steps[n] else "reset"
                raise contract_error(
                    self._envs[n], method, f"{agent}'s observation", value, kind.seen, error
                ) from error
            if into is self._shown.observations:
                self._active[n, m] = True
                if self._shown.action_mask is not None:
                    kind.show_mask(value, self._shown.action_mask[n, m])

    def _write_observations(self, buffers: StepBuffers) -> None:
        """Show every agent what it saw last, those that rest, too: a row is never what it was a rollout ago."""
        for name, array in self._shown.observations.items():
            buffers.observations[name][:] = array
        if buffers.action_mask is not None:
            buffers.action_mask[:] = self._shown.action_mask
        buffers.active[:] = self._active

    def _tell(self, n: int) -> None:
        if self._listener is not None:
            self._listener.on_end(n)
        if self._tally is not None:
            by_policy: dict[str, list[float]] = {}
            for name, earned in zip(self._policy, self._earned[n].tolist(), strict=True):
                by_policy.setdefault(name, []).append(earned)
            policies = by_policy if len(self.described.policies) > 1 else {}
            self._tally.add(WatchedEpisode(float(self._earned[n].sum()), int(self._steps[n]), policies))

    def _agent_with(self, policy: str) -> Any:
        return self._agents[self._policy.index(policy)]


class _Kind:
    """Agents of one policy: what they see, and what they may do."""

    def __init__(self, env: Any, agent: Any, name: str, described: Described) -> None:
        words = described.policies[name]
        seen = words.observation_space or _space_of(env, "observation_space", agent)
        does = words.action_space or _space_of(env, "action_space", agent)
        what = f"{described.name}, policy {name}"
        self.name, self.seen, self._translation = name, seen, action_translation(does, what)
        self.actions = self._translation.actions
        parts = parts_of(seen, what)
        mask = parts[MASK].space if MASK in parts else None
        self.has_mask = (
            described.takes_mask
            and isinstance(mask, spaces.Box)
            and isinstance(self.actions, DiscreteActions)
            and mask.shape == (self.actions.count,)
            and len(parts) > 1
        )
        self.parts = {key: part for key, part in parts.items() if key != MASK or not self.has_mask}
        self.observations = {key: part.spec(f"{what}, observation '{key}'") for key, part in self.parts.items()}

    def group(self) -> AgentGroup:
        """Return the kind as the contract knows it."""
        return AgentGroup(self.observations, self.actions, self.has_mask)

    def action(self, action: Array, grouped: bool) -> Any:
        """Return an action as the environment wants it."""
        own = narrow(np.asarray(action), group_spec(self.name, self.group(), 1)) if grouped else action
        return self._translation.to_environment(own)

    def show(self, seen: Any, into: dict[str, Array], row: tuple[int, int], before: str) -> None:
        """Write what an agent sees into its row."""
        for name, part in self.parts.items():
            part.show(seen, into[before + name][row])

    def show_mask(self, seen: Any, into: Array) -> None:
        """Write what an agent may do; where nothing is allowed, everything is, for somebody must act."""
        into[:] = True
        if self.has_mask:
            allowed = np.asarray(seen[MASK]) > 0
            into[: len(allowed)] = allowed if allowed.any() else True


def offered(described: Described) -> str:
    """Have a described environment be found as "module:Class"; return that name."""
    name = "".join(letter if letter.isalnum() else "_" for letter in f"Script_{described.name}")
    globals()[name] = type(name, (ScriptWorld,), {"described": described, "worlds_made": 0})
    return f"{PLACE}:{name}"


def begin_episode_of(env: Any, seed: int) -> Any:
    """Begin an episode of a script's environment and return what it shows."""
    if callable(getattr(env, "seed", None)):
        call_env(env, "seed", seed)
        return call_env(env, "reset")
    return call_env(env, "reset", seed=seed) if takes_seed(env) else call_env(env, "reset")


def is_multi_agent(env: Any) -> bool:
    """Tell whether an environment is one of RLlib's for several agents."""
    return any(kind.__name__ == "MultiAgentEnv" for kind in type(env).__mro__)


def shows_mask(env: Any) -> bool:
    """Tell whether an environment of one agent shows which of its choices are allowed."""
    seen, does = getattr(env, "observation_space", None), getattr(env, "action_space", None)
    if not isinstance(seen, spaces.Dict) or not isinstance(does, spaces.Discrete):
        return False
    mask = seen.spaces.get(MASK)
    return isinstance(mask, spaces.Box) and mask.shape == (int(does.n),) and len(seen.spaces) > 1


def agents_of(env: Any) -> list[Any]:
    """Return every agent, sorted by name; those of the first reset, and those that the environment names."""
    seen = call_env(env, "reset")
    seen = seen[0] if isinstance(seen, tuple) else seen
    if not isinstance(seen, Mapping):
        raise SettingError(
            "{type_name}.reset gives {type_name_2}; a MultiAgentEnv gives a dictionary of what each agent sees.",
            type_name=type(env).__name__,
            type_name_2=type(seen).__name__,
        )
    named: Sequence[Any] = list(getattr(env, "possible_agents", None) or ())
    if not named and callable(getattr(env, "get_agent_ids", None)):
        named = list(env.get_agent_ids() or ())
    return sorted({*seen, *named}, key=lambda one: (len(str(one)), str(one)))


def _class_with(kind: type, name: str) -> Any:
    """Return the class that has a name of its own, among those that were derived from it to tell its errors."""
    return next(one for one in kind.__mro__ if name in vars(one))


def _policy_of(described: Described, agent: Any) -> str:
    name = described.policy_of(agent)
    if name not in described.policies:
        raise SettingError(
            "multiagent: policy_mapping_fn gives agent {agent!r} the policy {name!r}; expected one of {policies}.",
            agent=agent,
            name=name,
            policies=", ".join(described.policies),
        )
    return name


def _space_of(env: Any, which: str, agent: Any) -> Any:
    space = getattr(env, which, None)
    if space is None:
        raise SettingError(
            "{type_name} has no {which}, and the policy of agent {agent!r} names none; expected one of them.",
            type_name=type(env).__name__,
            which=which,
            agent=agent,
        )
    if isinstance(space, spaces.Dict) and agent in space.spaces:
        return space.spaces[agent]
    return space


def _spec(name: str, num_worlds: int, num_agents: int, kinds: Mapping[str, _Kind]) -> WorldSpec:
    if len(kinds) == 1:
        (only,) = kinds.values()
        return WorldSpec(name, num_worlds, num_agents, only.observations, only.actions, only.has_mask)
    observations = {POLICY_ID: ArraySpec((), np.int64, 0, len(kinds) - 1, doc="number of the row's policy")}
    groups = {}
    for group, kind in kinds.items():
        observations |= {f"{group}/{part}": spec for part, spec in kind.observations.items()}
        groups[group] = kind.group()
    width = max((1, *(number for kind in kinds.values() for number in kind.actions.shape)))
    masked = any(mask_width(group) for group in groups.values() if group.has_action_mask)
    return WorldSpec(name, num_worlds, num_agents, observations, GroupedActions(width), masked, groups)
