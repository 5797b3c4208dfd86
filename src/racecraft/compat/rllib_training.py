"""Train what a script describes in RLlib's words. Begin with `train_experiment`; `rllib_config.py` translates."""

from __future__ import annotations

import inspect
import itertools
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium

from racecraft.compat.episode_listener import FinishedEpisodes, Watched
from racecraft.compat.old_gym import FromOldGym
from racecraft.compat.own_trainables import registered as registered_trainable
from racecraft.compat.own_trainables import train_own
from racecraft.compat.rllib_callbacks import Callbacks, callbacks_of
from racecraft.compat.rllib_config import Translated, policy_settings, translated
from racecraft.compat.rllib_results import RllibLines
from racecraft.compat.script_worlds import (
    Described,
    PolicyWords,
    SoleAgent,
    agents_of,
    is_multi_agent,
    offered,
    shows_mask,
)
from racecraft.compat.stored_environments import exit_if_restarted, script_code
from racecraft.compat.stored_models import refuse_to_train
from racecraft.contract.errors import SettingError, nearest
from racecraft.formats.run_folder import JOB, RunFolder
from racecraft.training import worlds
from racecraft.training.trained import Trained
from racecraft.worlds.gymnasium.env.user_env import made
from racecraft.worlds.gymnasium.training.trainer import GymRequest

NAMESPACE, DEFAULT_POLICY = "from_script", "default_policy"
_creators: dict[str, Callable[[Any], Any]] = {}


class EnvContext(dict[str, Any]):
    """What RLlib tells an environment's creator: its env_config, and which worker it is of."""

    def __init__(self, env_config: Mapping[str, Any], worker_index: int) -> None:
        super().__init__(env_config)
        self.worker_index, self.vector_index, self.remote = worker_index, 0, False


def register_env(name: str, creator: Callable[[Any], Any]) -> None:
    """Keep how an environment of a name is made."""
    _creators[name] = creator


def train_experiment(experiment: Mapping[str, Any]) -> Trained | dict[str, Any]:
    """Train; inside a job the run folder stands in its model, and a job that was interrupted goes on there.

    Raises:
        SettingError: Something is not understood; the nearest known word is told.
    """
    refuse_to_train()
    if (own := registered_trainable(experiment.get("run"))) is not None:
        return train_own(own, experiment)
    translation = translated(experiment)
    calls, uncalled = callbacks_of(translation.callbacks, experiment.get("config", {}))
    for sentence in (*translation.notes, *uncalled):
        print(f"- {sentence}")
    if translation.environment not in _creators and (
        translation.env_config or calls is not None or translation.horizon is not None
    ):
        _creators[translation.environment] = _maker_of(translation.environment)
    tally = FinishedEpisodes() if translation.environment in _creators else None
    environment, agents = _environment(translation, tally, calls)
    stops = tuple(_of_agents(one, 1 if translation.counts_agents else agents) for one in translation.stops)
    exit_if_restarted()
    model = os.environ.get("SM_MODEL_DIR")
    run = Path(model, "run") if model else None
    lines = RllibLines(
        tally, agents, calls, _episodes_of(run), translation.algorithm == "ppo", translation.rollouts_per_iteration,
        translation.counts_agents,
    )  # fmt: skip
    if run is not None and (run / JOB).exists():
        return worlds.resume(run, stops, lines, print, "gymnasium")
    code = script_code(environment) if translation.environment in _creators else None
    request = GymRequest(
        environment,
        algorithm=translation.algorithm,
        stops=stops,
        run=run,
        seed=translation.seed,
        overrides=translation.settings,
        environment_code=code,
    )
    return worlds.train(request, lines, print)


def registered(
    name: str, env_config: Mapping[str, Any], horizon: int | None, make: Callable[[], Any] | None = None
) -> str:
    """Return the id under which Gymnasium finds an environment of the script; any other name is Gymnasium's own.

    Args:
        name: Given to register_env, or Gymnasium's own.
        env_config: What its creator is told.
        horizon: Ticks after which an episode is cut; None: it ends by itself.
        make: Makes one in place of the creator.
    """
    if name not in _creators:
        return name
    own = _numbered(name, env_config)
    make = make or (lambda: FromOldGym(own()))
    known = f"{NAMESPACE}/{name}-v0"
    gymnasium.registry.pop(known, None)
    gymnasium.register(
        known,
        entry_point=lambda **words: make(),
        disable_env_checker=True,
        max_episode_steps=horizon,
        order_enforce=False,
    )
    return known


def _maker_of(name: str) -> Callable[[Any], Any]:
    """Return what makes an environment of Gymnasium's that is told an env_config."""
    return lambda env_config: gymnasium.make(name, **env_config)


def _episodes_of(run: Path | None) -> int:
    """Return how many episodes a run has had; none where it is not yet there."""
    if run is None or not (run / JOB).exists():
        return 0
    return sum(int(row.get("episodes") or 0) for row in RunFolder.open(run).read_metrics())


def _environment(translation: Translated, tally: FinishedEpisodes | None, calls: Callbacks | None) -> tuple[str, int]:
    """Return what a training calls the environment, Gymnasium's id or a world of the script's own, and its agents.

    Args:
        translation: The experiment.
        tally: Hears of training episodes.
        calls: Hears of them tick by tick.
    """
    if translation.environment not in _creators:
        if translation.multiagent:
            raise SettingError(
                "config.multiagent stands beside env {environment!r}, which is Gymnasium's; expected a "
                "MultiAgentEnv given to register_env.",
                environment=translation.environment,
            )
        return translation.environment, 1
    make = _numbered(translation.environment, translation.env_config)
    first = make()
    kept = itertools.chain([first], iter(make, None))
    if is_multi_agent(first):
        return offered(_described(translation, lambda: next(kept), tally, calls)), len(agents_of(first))
    if translation.multiagent:
        raise SettingError(
            "config.multiagent stands beside env {environment!r}, which makes a {type_name}; expected a MultiAgentEnv.",
            environment=translation.environment,
            type_name=type(first).__name__,
        )
    if shows_mask(first) and not translation.has_own_model:
        return offered(_described(translation, lambda: SoleAgent(next(kept)), tally, calls)), 1
    number, trained_in = itertools.count(), _num_worlds(translation)

    def watched() -> Any:
        own = next(kept)
        if tally is None or next(number) >= trained_in:
            return FromOldGym(own)
        return Watched(FromOldGym(own), tally.ended, calls, own)

    return registered(translation.environment, translation.env_config, translation.horizon, watched), 1


def _of_agents(stop: str, agents: int) -> str:
    """Return a stop whose steps, each of all agents, are counted as one agent's."""
    name, _, amount = stop.partition("=")
    return f"steps={float(amount) * agents:.12g}" if name == "steps" else stop


def _numbered(name: str, env_config: Mapping[str, Any]) -> Callable[[], Any]:
    """Return how a script's environments are made, each with a number of its own."""
    number, creator = itertools.count(1), _creators[name]
    return lambda: made(creator, EnvContext(env_config, next(number)))


def _num_worlds(translation: Translated) -> int:
    (count,) = (one.partition("=")[2] for one in translation.settings if one.startswith("rollout.num_worlds="))
    return int(count)


def _described(
    translation: Translated, make: Callable[[], Any], tally: FinishedEpisodes | None, calls: Callbacks | None
) -> Described:
    """Return what a script says of its environment and its policies.

    Raises:
        SettingError: A policy of a class of its own, or that learns and is not there.
    """
    policies = {
        name: _policy(name, policy, translation.algorithm)
        for name, policy in _named_policies(translation.multiagent).items()
    }
    mapping = translation.multiagent.get("policy_mapping_fn")
    taught = translation.multiagent.get("policies_to_train")
    taught = list(policies) if taught is None else list(taught)
    for name in taught:
        if name not in policies:
            raise SettingError(
                "multiagent.policies_to_train has no policy '{name}'. {hint}", name=name, hint=nearest(name, policies)
            )
    if not taught:
        raise SettingError("multiagent.policies_to_train is empty; expected a policy that learns.")
    if mapping is None and len(policies) > 1:
        raise SettingError("multiagent has several policies and no policy_mapping_fn; expected one.")
    sole = next(iter(policies))
    return Described(
        translation.environment,
        make,
        translation.horizon,
        policies,
        (lambda agent: sole) if mapping is None else (lambda agent: _mapped(mapping, agent)),
        frozenset(policies) - frozenset(taught),
        takes_mask=not translation.has_own_model,
        tally=tally,
        listener=calls,
    )


def _named_policies(multiagent: Mapping[str, Any]) -> dict[str, Any]:
    policies = multiagent.get("policies") or (DEFAULT_POLICY,)
    return dict(policies) if isinstance(policies, Mapping) else dict.fromkeys(sorted(policies))


def _policy(name: str, value: Any, algorithm: str) -> PolicyWords:
    """Return what is said of one policy: nothing, four things in a row, or RLlib's PolicySpec."""
    if value is None:
        return PolicyWords()
    words = ("policy_class", "observation_space", "action_space", "config")
    parts = value if isinstance(value, tuple) else [getattr(value, word, None) for word in words]
    if len(parts) != len(words):
        raise SettingError(
            "multiagent.policies['{name}'] is {said!r}; expected (None, observation space, action space, config).",
            name=name,
            said=value,
        )
    if parts[0] is not None:
        raise SettingError(
            "multiagent.policies['{name}'] is of the class {problem}; expected None, "
            "which is that of `run`: classes of RLlib's policies do not run here.",
            name=name,
            problem=getattr(parts[0], "__name__", parts[0]),
        )
    return PolicyWords(parts[1], parts[2], policy_settings(parts[3] or {}, algorithm))


def _mapped(mapping: Callable[..., Any], agent: Any) -> str:
    """Return an agent's policy; since Ray 1.4 the function is also told the episode, of which there is none yet."""
    try:
        several = len(inspect.signature(mapping).bind(agent).arguments) != 1
    except TypeError:
        several = True
    return str(mapping(agent, None) if several else mapping(agent))
