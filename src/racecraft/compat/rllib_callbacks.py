"""RLlib's callbacks, called where the worlds are: metrics of a script's own, and what it does after an iteration.

They come in two shapes: functions by name that are told one dictionary (Ray before 0.8.4), or a class whose methods are
told by keyword (`DefaultCallbacks`). Begin with `callbacks_of`, then `Callbacks`. Only worlds that are learned in are
told of, and a saved episode that is played again is told of again, so that its metrics are whole.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from racecraft.compat.episode_listener import EpisodeListener
from racecraft.compat.rllib_words import CALLBACK_WORDS
from racecraft.compat.unknown_names import error_about
from racecraft.contract.errors import RacecraftError, SettingError, UserInputError, nearest
from racecraft.contract.user_code_location import user_code_location

ITERATION_HOOK = "on_train_result"
CALLED = tuple(name for name, told in CALLBACK_WORDS.items() if not told.startswith("not called"))
NOT_CALLED = tuple(name for name in CALLBACK_WORDS if name not in CALLED)
EPISODE_WORDS = ("worker", "base_env", "policies", "episode", "env_index")
ITERATION_WORDS = ("trainer", "algorithm", "result")


class CallbackError(UserInputError):
    """A callback of the script's own raised."""


class Episode:
    """An episode under way, as a callback sees it: what was seen, done and earned last, and room for metrics.

    Args:
        number: Counted from 0, over all worlds.
        world: In which it is.
        policies: Each agent's policy, by agent.
    """

    def __init__(self, number: int, world: int, policies: Mapping[Any, str]) -> None:
        self.episode_id, self.env_id, self.length, self.total_reward = number, world, 0, 0.0
        self.custom_metrics: dict[str, Any] = {}
        self.user_data: dict[str, Any] = {}
        self.hist_data: dict[str, Any] = {}
        self.media: dict[str, Any] = {}
        self.agent_rewards: dict[Any, float] = {}
        self._policies = dict(policies)
        self._seen: dict[Any, Any] = {}
        self._done: dict[Any, Any] = {}
        self._earned: dict[Any, float] = {}
        self._infos: dict[Any, Any] = {}

    def get_agents(self) -> list[Any]:
        """Return every agent."""
        return list(self._policies)

    def policy_for(self, agent_id: Any = None) -> str:
        """Return the name of an agent's policy."""
        return self._policies[self._agent(agent_id)]

    def last_observation_for(self, agent_id: Any = None) -> Any:
        """Return what an agent saw last."""
        return self._seen.get(self._agent(agent_id))

    last_raw_obs_for = last_observation_for

    def last_action_for(self, agent_id: Any = None) -> Any:
        """Return what an agent did last; None: nothing yet."""
        return self._done.get(self._agent(agent_id))

    def last_reward_for(self, agent_id: Any = None) -> float:
        """Return what an agent earned last."""
        return self._earned.get(self._agent(agent_id), 0.0)

    def last_info_for(self, agent_id: Any = None) -> Any:
        """Return what the environment said of an agent last; {}: nothing yet."""
        return self._infos.get(self._agent(agent_id), {})

    def see(self, seen: Mapping[Any, Any]) -> None:
        """Take in what agents see."""
        self._seen.update(seen)

    def take_step(self, done: Mapping[Any, Any], earned: Mapping[Any, float], infos: Mapping[Any, Any]) -> None:
        """Take in one tick."""
        self.length += 1
        self._done.update(done)
        self._infos.update(infos)
        self._earned = dict(earned)
        for agent, reward in earned.items():
            key = (agent, self._policies.get(agent))
            self.agent_rewards[key] = self.agent_rewards.get(key, 0.0) + reward
        self.total_reward += sum(earned.values())

    def _agent(self, agent_id: Any) -> Any:
        return next(iter(self._policies)) if agent_id is None else agent_id


class Policy:
    """One policy, by name: its weights are the learner's own affair here."""

    def __init__(self, name: str) -> None:
        self.name = name


class Worlds:
    """The environments that are learned in, as RLlib's `worker` and `base_env` show them: one worker has them all."""

    worker_index = 0

    def __init__(self) -> None:
        self.envs: list[Any] = []

    @property
    def env(self) -> Any:
        """The first of them."""
        return self.envs[0]

    def foreach_env(self, function: Callable[[Any], Any]) -> list[Any]:
        """Ask something of each."""
        return [function(env) for env in self.envs]

    def get_sub_environments(self) -> list[Any]:
        """Return all of them."""
        return list(self.envs)

    get_unwrapped = get_sub_environments


class Workers:
    """All workers: one."""

    def __init__(self, worlds: Worlds) -> None:
        self._worlds = worlds

    def local_worker(self) -> Worlds:
        """Return it."""
        return self._worlds

    def remote_workers(self) -> list[Worlds]:
        """Return those elsewhere: none."""
        return []

    def foreach_worker(self, function: Callable[[Worlds], Any]) -> list[Any]:
        """Ask something of it."""
        return [function(self._worlds)]


class Trainer:
    """What trains, as far as a callback asks for it."""

    def __init__(self, worlds: Worlds, config: Mapping[str, Any]) -> None:
        self.workers, self.config = Workers(worlds), dict(config)
        self.iteration = 0


class DefaultCallbacks:
    """The base of a script's own class of callbacks; each does nothing."""

    def __init__(self, legacy_callbacks_dict: Mapping[str, Any] | None = None) -> None:
        self.legacy_callbacks = dict(legacy_callbacks_dict or {})

    def on_episode_start(self, **kwargs: Any) -> None:
        """An episode begins."""

    def on_episode_step(self, **kwargs: Any) -> None:
        """A tick of an episode is over."""

    def on_episode_end(self, **kwargs: Any) -> None:
        """An episode is over."""

    def on_train_result(self, **kwargs: Any) -> None:
        """An iteration is over; what is laid into `result` is told with it."""


class Callbacks(EpisodeListener):
    """Calls what a script wants called.

    Args:
        hooks: What to call, by name, each told by keyword.
        config: The script's configuration of RLlib's.
    """

    def __init__(self, hooks: Mapping[str, Callable[..., Any]], config: Mapping[str, Any]) -> None:
        self._hooks, self._worlds = hooks, Worlds()
        self._trainer = Trainer(self._worlds, config)
        self._episodes: dict[int, Episode] = {}
        self._policies: dict[str, Policy] = {}
        self._begun = 0
        self._metrics: list[dict[str, Any]] = []

    def on_env(self, env: Any) -> int:
        """Take in an environment that is learned in; return its number."""
        self._worlds.envs.append(env)
        return len(self._worlds.envs) - 1

    def on_start(self, world: int, policies: Mapping[Any, str], seen: Mapping[Any, Any]) -> None:
        """Take in that an episode begins."""
        self._policies.update({name: Policy(name) for name in policies.values() if name not in self._policies})
        self._episodes[world] = Episode(self._begun, world, policies)
        self._begun += 1
        self._episodes[world].see(seen)
        self._call("on_episode_start", world)

    def on_step(
        self, world: int, done: Mapping[Any, Any], seen: Mapping[Any, Any], earned: Mapping[Any, float],
        infos: Mapping[Any, Any],
    ) -> None:  # fmt: skip
        """Take in one tick of an episode."""
        episode = self._episodes[world]
        episode.take_step(done, earned, infos)
        episode.see(seen)
        self._call("on_episode_step", world)

    def on_end(self, world: int) -> None:
        """Take in that an episode is over, and what it measured."""
        self._call("on_episode_end", world)
        self._metrics.append(dict(self._episodes[world].custom_metrics))

    def take_metrics(self) -> dict[str, float]:
        """Return mean, least and greatest of each metric of the episodes since somebody last asked; forget them.

        >>> calls = Callbacks({}, {})
        >>> calls._metrics = [{"eaten": 1}, {"eaten": 4}]
        >>> calls.take_metrics()
        {'eaten_mean': 2.5, 'eaten_min': 1.0, 'eaten_max': 4.0}
        """
        metrics, self._metrics = self._metrics, []
        by_name: dict[str, list[float]] = {}
        for one in metrics:
            for name, value in one.items():
                by_name.setdefault(name, []).append(_number(name, value))
        return {
            f"{name}_{word}": float(of(values))
            for name, values in by_name.items()
            for word, of in (("mean", lambda values: sum(values) / len(values)), ("min", min), ("max", max))
        }

    def iteration(self, result: dict[str, Any]) -> None:
        """Have an iteration be told of; what a callback lays into it stays."""
        if hook := self._hooks.get(ITERATION_HOOK):
            self._trainer.iteration = int(result["training_iteration"])
            words = {"trainer": self._trainer, "algorithm": self._trainer, "result": result}
            _guarded(ITERATION_HOOK, partial(hook, **words))

    def _call(self, name: str, world: int) -> None:
        if hook := self._hooks.get(name):
            words = {
                "worker": self._worlds, "base_env": self._worlds, "policies": self._policies,
                "episode": self._episodes[world], "env_index": world,
            }  # fmt: skip
            _guarded(name, partial(hook, **words))


def callbacks_of(value: Any, config: Mapping[str, Any]) -> tuple[Callbacks | None, tuple[str, ...]]:
    """Return what calls a script's callbacks, and a sentence for each that is not called here.

    Args:
        value: config.callbacks: functions by name, or a class; None or {}: nothing is to be called.
        config: The script's configuration of RLlib's.

    Raises:
        SettingError: It is neither, has a name that RLlib does not call, or asks to be told what nothing here knows.
    """
    if not value:
        return None, ()
    found = _of_functions(value) if isinstance(value, Mapping) else _of_class(value)
    left = tuple(f"callbacks.{name}: not called here; {', '.join(CALLED)} are" for name in found if name in NOT_CALLED)
    hooks = {name: hook for name, hook in found.items() if name in CALLED}
    return (Callbacks(hooks, config) if hooks else None), left


def _of_functions(value: Mapping[str, Any]) -> dict[str, Callable[..., Any]]:
    """Return functions that are told one dictionary as hooks that are told by keyword."""
    for name, function in value.items():
        if name not in (*CALLED, *NOT_CALLED):
            raise SettingError("config.callbacks has no '{name}'. {hint}", name=name, hint=nearest(name, CALLED))
        if not callable(function):
            raise SettingError(
                "config.callbacks: '{name}' is {function!r}; expected a function.", name=name, function=function
            )
    return {name: partial(_with_one_dictionary, function) for name, function in value.items()}


def _with_one_dictionary(function: Callable[[dict[str, Any]], Any], **words: Any) -> None:
    if "episode" in words:
        words = {"env": words["base_env"], "policy": words["policies"], "episode": words["episode"]}
    function({name: value for name, value in words.items() if name != "algorithm"})


def _of_class(value: Any) -> dict[str, Callable[..., Any]]:
    """Return the methods that a class of callbacks has of its own."""
    if not callable(value):
        raise SettingError(
            "config.callbacks is {said!r}; expected a class of callbacks, or functions by name.", said=value
        )
    made = _guarded("__init__", value)
    found = {}
    for name in (*CALLED, *NOT_CALLED):
        if getattr(type(made), name, None) not in (None, getattr(DefaultCallbacks, name, None)):
            method = getattr(made, name)
            known = ITERATION_WORDS if name == ITERATION_HOOK else EPISODE_WORDS
            found[name] = _with_known_arguments(name, method, known) if name in CALLED else method
    return found


def _with_known_arguments(name: str, method: Callable[..., Any], known: tuple[str, ...]) -> Callable[..., Any]:
    """Return a method that is told those of the words that it has arguments for."""
    asks = inspect.signature(method).parameters.values()
    takes_all = any(one.kind is one.VAR_KEYWORD for one in asks)
    takes = [word for word in known if takes_all or word in {one.name for one in asks}]
    for one in asks:
        if one.default is one.empty and one.kind not in (one.VAR_KEYWORD, one.VAR_POSITIONAL) and one.name not in known:
            raise SettingError(
                "config.callbacks: {name} asks for '{name_2}', which nothing here knows; it may ask for {known}.",
                name=name,
                name_2=one.name,
                known=", ".join(known),
            )
    return lambda **words: method(**{word: value for word, value in words.items() if word in takes})


def _guarded(name: str, call: Callable[[], Any]) -> Any:
    """Call what is a script's own.

    Raises:
        CallbackError: It raised.
    """
    try:
        return call()
    except RacecraftError:
        raise
    except Exception as error:
        message = error_about(error, ()) or (
            f"{user_code_location(error)}: callbacks.{name} raised {type(error).__name__}: {error}; expected one that "
            "can be called again and again. Mend it there."
        )
        raise CallbackError(message) from error


def _number(name: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise CallbackError(
            "custom_metrics['{name}'] is {value!r}; expected a number for each episode.", name=name, value=value
        ) from None
