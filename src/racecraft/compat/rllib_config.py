"""A script's experiment of RLlib's, in our settings. Begin with `translated`; `rllib_words.py` has the words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from racecraft.compat.rllib_defaults import DEPRECATED, MODEL, defaults_of, is_default
from racecraft.compat.rllib_words import (
    ALGORITHMS,
    APEX_EVERY,
    CUSTOM,
    ELSEWHERE,
    EPSILONS,
    EXPERIMENT_WORDS,
    JUDGED_EPISODES,
    LATER_NAMES,
    LATER_STOPS,
    MODEL_WORDS,
    MULTI_WORDS,
    NO_MODEL,
    RUNS,
    SHORTEST_ROLLOUT,
    STOPS,
    UNFOLLOWED,
    WITH_REPLAY,
    ConfigKey,
    words_of,
)
from racecraft.contract.errors import SettingError, nearest

NEVER = 10**12
"""Steps after which nobody trains any more."""


@dataclass(frozen=True)
class Translated:
    """An experiment of RLlib's, in our words."""

    algorithm: str
    """As --algorithm takes it."""
    environment: str
    env_config: Mapping[str, Any]
    settings: tuple[str, ...]
    """group.name=value."""
    stops: tuple[str, ...]
    seed: int | None
    multiagent: Mapping[str, Any]
    """As the script said it; empty: one policy for all agents."""
    has_own_model: bool
    """Whether a model of the script's own decides."""
    horizon: int | None
    """Ticks after which an episode is cut, its value still follows; None: the environment's own limit, or none."""
    notes: tuple[str, ...] = field(default_factory=tuple)
    """What has no meaning here, a sentence each."""
    callbacks: Any = None
    """As the script said it: a class of RLlib's callbacks, or functions by name; None: none."""
    rollouts_per_iteration: int = 1
    """Iterations of ours in one of RLlib's."""
    counts_agents: bool = False
    """Whether a step is one agent's; else it is a tick of an environment, however many agents act in it."""


def translated(experiment: Mapping[str, Any]) -> Translated:
    """Return an experiment, `{"run", "stop", "config"}`, in our words.

    Raises:
        SettingError: An algorithm, a word or a stop that is not understood; the nearest known one is told.

    >>> told = translated(
    ...     {
    ...         "run": "PPO",
    ...         "stop": {"timesteps_total": 10000},
    ...         "config": {"env": "x", "gamma": 0.995, "train_batch_size": 500, "num_workers": 2},
    ...     }
    ... )
    >>> told.settings[:2], told.stops
    (('rollout.num_worlds=2', 'rollout.horizon=250'), ('steps=10000',))
    >>> "ppo.discount=0.995" in told.settings, "ppo.learning_rate=5e-05" in told.settings
    (True, True)
    >>> told.notes[0]
    'kl_coeff: this PPO clips and has no KL penalty beside it'
    """
    notes: list[str] = []
    _require_experiment_words(experiment, notes)
    run = str(experiment.get("run"))
    if run not in RUNS:
        raise SettingError(
            "run: {run!r}; `racecraft run` understands {runs} of RLlib's algorithms.", run=run, runs=", ".join(RUNS)
        )
    algorithm = ALGORITHMS[run]
    said_words, defaults = _by_first_names("config", _part(experiment, "config"), LATER_NAMES), defaults_of(run)
    given = {name: value for name, value in said_words.items() if not is_default(name, value, defaults)}
    environment = given.get("env") or experiment.get("env")
    if not isinstance(environment, str):
        raise SettingError(
            "config.env is {environment!r}; expected a name given to register_env, or a Gymnasium id.",
            environment=environment,
        )
    notes += _notes(run, given)
    config = {**defaults, **given, "exploration_config": _exploration_config(defaults, given)}
    worlds = [*_worlds(run, config), f"evaluation.episodes={JUDGED_EPISODES}", *RUNS[run]]
    multiagent = _part(config, "multiagent")
    _require_multi_words(multiagent, notes)
    count = _rollouts_per_iteration(run, config, worlds)
    horizon = _integer(config, "horizon", 0, 1) or None
    stops = _by_first_names("stop", _part(experiment, "stop"), LATER_STOPS)
    model = _model_of(run, config, said_words)
    return Translated(
        algorithm,
        environment,
        _part(config, "env_config"),
        (*worlds, *_settings(run, config, given), *_model(model, notes)),
        tuple(_stop(name, amount, count) for name, amount in stops.items()),
        config.get("seed"),
        multiagent,
        model.get("custom_model") not in NO_MODEL,
        horizon,
        tuple(notes),
        config.get("callbacks"),
        count,
        multiagent.get("count_steps_by") == "agent_steps",
    )


def policy_settings(config: Mapping[str, Any], algorithm: str = "ppo") -> tuple[str, ...]:
    """Return what one policy of several has otherwise, as after --set.

    Raises:
        SettingError: A word that is not one policy's own.

    >>> policy_settings({"gamma": 0.9, "model": {"fcnet_hiddens": [8]}})
    ('ppo.discount=0.9', 'network.hidden_units=8')
    """
    settings: list[str] = []
    known = words_of(algorithm)
    for name, value in _by_first_names("a policy's config", config, LATER_NAMES).items():
        word = known.get(name, ConfigKey())
        if name == "model":
            settings += _model(value, [])
        elif word.setting not in ("", ELSEWHERE):
            settings.append(f"{word.setting}={'none' if value is None else value}")
        elif name not in known or word.setting == ELSEWHERE:
            own = [other for other, one in known.items() if one.setting not in ("", ELSEWHERE)]
            raise SettingError(
                "multiagent: a policy's config has '{name}', which is not one policy's own here. {hint}",
                name=name,
                hint=nearest(name, [*own, "model"]),
            )
    return tuple(settings)


def _notes(run: str, given: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each word without a meaning here; refuse words that are not understood."""
    known, defaults, notes = words_of(ALGORITHMS[run]), defaults_of(run), []
    for name in dict.fromkeys((*UNFOLLOWED.get(run, ()), *given)):
        if name in known and not known[name].setting:
            notes.append(f"{name}: {known[name].doc}")
        elif name not in known and name in defaults:
            raise SettingError(
                "config of {run}: {name} is {value!r}; expected {default!r}, RLlib's default: nothing follows it here.",
                run=run,
                name=name,
                value=given[name],
                default=defaults[name],
            )
        elif name not in known:
            near = nearest(name, [*known, *LATER_NAMES])
            raise SettingError(
                "config of {run} has no '{name}' that is understood here. {near}", run=run, name=name, near=near
            )
    return notes


def _settings(run: str, config: Mapping[str, Any], given: Mapping[str, Any]) -> list[str]:
    """Return RLlib's defaults as settings, then what the script gives."""
    known = words_of(ALGORITHMS[run])

    def of(words: Mapping[str, Any]) -> list[str]:
        own = {name: known[name].setting for name in words if name in known}
        return [_assigned(setting, words[name]) for name, setting in own.items() if setting not in ("", ELSEWHERE)]

    settings = of({name: value for name, value in config.items() if name not in given})
    if run == "DQN":
        settings += _exploration(config)
    if run in WITH_REPLAY:
        settings += _schedules(run, config, given)
    if run == "APPO" and "sgd_minibatch_size" not in given:
        settings.append(f"ppo.batch_size={_integer(config, 'train_batch_size', 1, 1)}")
    if run == "SAC":
        settings += _of_sac(config)
    if run == "ES":
        settings.append(f"es.weight_decay={_number(config, 'l2_coeff') / _number(config, 'noise_stdev'):.6g}")
    return settings + of(given)


def _assigned(setting: str, value: Any) -> str:
    return f"{setting}={'none' if value is None else value}"


def _of_sac(config: Mapping[str, Any]) -> list[str]:
    rates = _part(config, "optimization")
    if len(set(rates.values())) != 1:
        raise SettingError(
            "config.optimization is {rates}; expected one rate for actor, critic and entropy.", rates=rates
        )
    entropy = config["target_entropy"]
    return [
        f"sac.learning_rate={next(iter(rates.values()))}",
        _assigned("sac.target_entropy", None if entropy == "auto" else entropy),
    ]


def _number(config: Mapping[str, Any], name: str) -> float:
    try:
        return float(config[name])
    except (TypeError, ValueError):
        raise SettingError("'{name}' is {value!r}; expected a number.", name=name, value=config[name]) from None


def _exploration_config(defaults: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return what RLlib makes of it: one of the same type is laid over the default."""
    default, said = dict(defaults["exploration_config"]), dict(given.get("exploration_config") or {})
    return said if said.get("type", default["type"]) != default["type"] else {**default, **said}


def _rollouts_per_iteration(run: str, config: Mapping[str, Any], worlds: list[str]) -> int:
    """Return how many of our iterations have as many steps as one of RLlib's."""
    if run not in WITH_REPLAY:
        return 1
    sizes = [int(one.partition("=")[2]) for one in worlds[:2]]
    return max(1, -(-_integer(config, "timesteps_per_iteration", 1) // (sizes[0] * sizes[1])))


def _part(whole: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return what stands under a word, as words and values; none where it is absent."""
    found = whole.get(name)
    if found is not None and not isinstance(found, Mapping):
        raise SettingError(
            "'{name}' is {found!r}; expected words and their values, {{'word': value}}.", name=name, found=found
        )
    return dict(found or {})


def _by_first_names(place: str, words: Mapping[str, Any], later: Mapping[str, str]) -> dict[str, Any]:
    """Return words by the names that the tables have."""
    found: dict[str, Any] = {}
    for name, value in words.items():
        first = later.get(name, name)
        if first in found:
            raise SettingError(
                "{place} says '{name}' and {first}, which are one word; give it once.",
                place=place,
                name=name,
                first=first,
            )
        found[first] = value
    return found


def _integer(config: Mapping[str, Any], name: str, otherwise: int, least: int = 0) -> int:
    """Return a whole number of a configuration, `otherwise` where it says none."""
    value = config.get(name)
    try:
        number = otherwise if value is None else int(value)
        if value is not None and (number != float(value) or number < least):
            raise ValueError
    except (TypeError, ValueError):
        raise SettingError(
            "'{name}' is {value!r}; expected a whole number, {least} or more.", name=name, value=value, least=least
        ) from None
    return number


def _require_experiment_words(experiment: Mapping[str, Any], notes: list[str]) -> None:
    """Refuse words that no experiment has; what has no meaning here is said."""
    for name, value in experiment.items():
        if name not in EXPERIMENT_WORDS:
            raise SettingError(
                "an experiment has no '{name}' that is understood here. {hint}",
                name=name,
                hint=nearest(name, EXPERIMENT_WORDS),
            )
        meaning = EXPERIMENT_WORDS[name]
        if meaning.startswith("refused") and value not in (None, 1, ""):
            raise SettingError("'{name}' is {value!r}, which is {meaning}.", name=name, value=value, meaning=meaning)
        if meaning.startswith("nothing"):
            notes.append(f"{name}: {meaning.removeprefix('nothing: ')}")


def _require_multi_words(multiagent: Mapping[str, Any], notes: list[str]) -> None:
    for name, value in multiagent.items():
        if name not in MULTI_WORDS:
            raise SettingError(
                "config.multiagent has no '{name}' that is understood here. {hint}",
                name=name,
                hint=nearest(name, MULTI_WORDS),
            )
        if MULTI_WORDS[name].startswith("refused") and value is not None:
            raise SettingError(
                "config.multiagent.{name} is {value!r}; {multi_words}.",
                name=name,
                value=value,
                multi_words=MULTI_WORDS[name].removeprefix("refused: "),
            )
        if MULTI_WORDS[name].startswith("nothing"):
            notes.append(f"multiagent.{name}: {MULTI_WORDS[name].removeprefix('nothing: ')}")


def _worlds(run: str, config: Mapping[str, Any]) -> list[str]:
    """Return how many worlds collect, how many ticks in one iteration of ours, and how often is learned."""
    if run == "ES":
        members = _integer(config, "episodes_per_batch", 2, 2)
        return [f"rollout.num_worlds={members}", "rollout.horizon=1", f"rollout.episodes_per_iteration={members}"]
    worlds = max(1, _integer(config, "num_workers", 2)) * max(1, _integer(config, "num_envs_per_worker", 1, 1))
    if run not in WITH_REPLAY:
        horizon = max(1, round(_integer(config, "train_batch_size", 4000, 1) / worlds))
        return [f"rollout.num_worlds={worlds}", f"rollout.horizon={horizon}"]
    fragment = _fragment(config)
    horizon = fragment if run != "SAC" else fragment * max(1, SHORTEST_ROLLOUT // (worlds * fragment))
    return [f"rollout.num_worlds={worlds}", f"rollout.horizon={horizon}", *_pace(run, config, worlds * fragment)]


def _fragment(config: Mapping[str, Any]) -> int:
    length = config.get("sample_batch_size") or config.get("rollout_fragment_length")
    return (
        1 if length == "auto" else max(1, _integer({"rollout_fragment_length": length}, "rollout_fragment_length", 1))
    )


def _pace(run: str, config: Mapping[str, Any], collected: int) -> list[str]:
    """Return how often is learned, and how often the target network follows, in steps of learning.

    RLlib's DQN and SAC take one step of learning behind each round of their workers' fragments. Its Ape-X learns as
    fast as it can; ours in a proportion to what is collected, which stays as it is.

    Args:
        run: RLlib's algorithm.
        config: With its defaults.
        collected: Steps of a round of fragments.
    """
    every = APEX_EVERY if run == "APEX" else collected
    target = max(1, round(_integer(config, "target_network_update_freq", 0) / every))
    if run == "SAC":
        return [f"sac.gradient_steps_per_step={1 / every:.6g}", f"sac.target_interval={target}"]
    return [f"{ALGORITHMS[run]}.train_every={every}", f"{ALGORITHMS[run]}.target_every={target}"]


def _exploration(config: Mapping[str, Any]) -> list[str]:
    said = dict(config["exploration_config"])
    kind = said.pop("type", "EpsilonGreedy")
    if kind != "EpsilonGreedy":
        raise SettingError("config.exploration_config is of type {kind!r}; expected EpsilonGreedy.", kind=kind)
    for name in said:
        if name not in EPSILONS:
            raise SettingError(
                "config.exploration_config has no '{name}'. {hint}", name=name, hint=nearest(name, EPSILONS)
            )
    return [f"dqn.epsilon_{EPSILONS[name]}={value}" for name, value in said.items()]


def _schedules(run: str, config: Mapping[str, Any], given: Mapping[str, Any]) -> list[str]:
    """Return over how many steps chance grows rarer, and importance is weighed out."""
    if run != "SAC" and (_integer(config, "num_atoms", 1) != 1 or config.get("noisy")):
        raise SettingError(
            "config: num_atoms is {config} and noisy is {config_2}; expected 1 "
            "and False: neither distributions of values nor noisy networks are learned here.",
            config=config.get("num_atoms", 1),
            config_2=config.get("noisy", False),
        )
    if run == "APEX" and "exploration_config" in given:
        raise SettingError("config.exploration_config: APEX's worlds explore each in their own degree; leave it out.")
    whole = _integer(config, "schedule_max_timesteps", 100_000)
    try:
        shares = {
            name: max(1, round(float(config[name]) * whole))
            for name in ("beta_annealing_fraction", "exploration_fraction")
            if name in config
        }
    except (TypeError, ValueError):
        raise SettingError(
            "exploration_fraction, beta_annealing_fraction: expected shares of schedule_max_timesteps, 0 to 1."
        ) from None
    first, last = _number(config, "prioritized_replay_beta"), _number(config, "final_prioritized_replay_beta")
    steps = shares.get("beta_annealing_fraction") or _integer(
        config, "prioritized_replay_beta_annealing_timesteps", 1, 1
    )
    settings = [f"replay.importance_steps={NEVER if last <= first else round(steps * (1 - first) / (last - first))}"]
    if run == "DQN" and "exploration_fraction" in shares:
        settings.append(f"dqn.epsilon_steps={shares['exploration_fraction']}")
    return settings


def _model_of(run: str, config: Mapping[str, Any], exploration: Mapping[str, Any]) -> dict[str, Any]:
    """Return the model that RLlib makes: its defaults, what the script says, and the layers laid behind it."""
    own = _part(exploration, "model")
    if own.get("custom_model") not in NO_MODEL:
        if run not in ("PPO", "APPO"):
            raise SettingError(
                "config.model.custom_model is {model!r}, and run is {run}; expected PPO or APPO with a "
                'model of the script\'s own, or none (the hyperparameter rl.training.config.model.custom_model="").',
                model=own["custom_model"],
                run=run,
            )
        return own
    if run == "SAC":
        layers = {**defaults_of(run)["policy_model"], **_part(exploration, "policy_model")}
        if {**defaults_of(run)["Q_model"], **_part(exploration, "Q_model")} != layers:
            raise SettingError("config.Q_model differs from policy_model; expected the same layers in both.")
        return layers
    model = {"fcnet_hiddens": MODEL["fcnet_hiddens"], "fcnet_activation": MODEL["fcnet_activation"], **own}
    if run in ("DQN", "APEX"):
        model["fcnet_hiddens"] = [*model["fcnet_hiddens"], *(config.get("hiddens") or ())]
    if run in ("PPO", "APPO") and not model.get("use_lstm"):
        first = exploration if exploration.get("vf_share_layers", DEPRECATED) != DEPRECATED else own
        return {**model, "vf_share_layers": first.get("vf_share_layers", config["vf_share_layers"])}
    return {name: value for name, value in model.items() if name != "vf_share_layers"}


def _model(model: Mapping[str, Any], notes: list[str]) -> list[str]:
    settings: list[str] = []
    for name, value in model.items():
        if is_default(f"model.{name}", value, {f"model.{part}": default for part, default in MODEL.items()}):
            continue
        if name not in MODEL_WORDS and name in MODEL:
            raise SettingError(
                "config.model: {name} is {value!r}; expected {default!r}, RLlib's default: nothing follows it here.",
                name=name,
                value=value,
                default=MODEL[name],
            )
        if name not in MODEL_WORDS:
            raise SettingError(
                "config.model has no '{name}' that is understood here. {hint}",
                name=name,
                hint=nearest(name, MODEL_WORDS),
            )
        if MODEL_WORDS[name].startswith("nothing"):
            notes.append(f"model.{name}: {MODEL_WORDS[name].removeprefix('nothing: ')}")
    custom = model.get("custom_model")
    if custom not in NO_MODEL:
        from racecraft.compat.script_models import offered_model

        return [f"network.policy={offered_model(custom, model)}"]
    notes += [f"model.{name}: there is no custom_model that it would be told" for name in CUSTOM[1:] if model.get(name)]
    if "fcnet_hiddens" in model:
        settings.append(f"network.hidden_units={','.join(map(str, model['fcnet_hiddens']))}")
    if "fcnet_activation" in model:
        settings.append(f"network.activation={model['fcnet_activation']}")
    if "vf_share_layers" in model:
        settings.append(f"network.separate_networks={str(not model['vf_share_layers']).lower()}")
    settings += _convolutions(model.get("conv_filters"))
    if model.get("use_lstm"):
        settings += ["network.memory=lstm", f"network.memory_units={model.get('lstm_cell_size', 256)}",
                     f"ppo.sequence_length={model.get('max_seq_len', 20)}"]  # fmt: skip
    return settings


def _convolutions(filters: Any) -> list[str]:
    """Return [[filters, [kernel, kernel], stride], …] as settings."""
    if not filters:
        return []
    try:
        rows = [(int(count), kernel if isinstance(kernel, int) else set(kernel), int(stride))
                for count, kernel, stride in filters]  # fmt: skip
    except (TypeError, ValueError):
        raise SettingError(
            "config.model.conv_filters is {filters!r}; expected [[filters, [kernel, kernel], stride], …].",
            filters=filters,
        ) from None
    kernels = [kernel if isinstance(kernel, int) else int(max(kernel)) for _, kernel, _ in rows]
    if any(isinstance(kernel, set) and len(kernel) > 1 for _, kernel, _ in rows):
        raise SettingError("config.model.conv_filters is {filters!r}; expected square kernels.", filters=filters)
    layers = {"filters": [row[0] for row in rows], "kernels": kernels, "strides": [row[2] for row in rows]}
    return [f"network.conv_{name}={','.join(map(str, values))}" for name, values in layers.items()]


def _stop(name: str, amount: Any, rollouts: int) -> str:
    if name not in STOPS:
        near = nearest(name, [*STOPS, *LATER_STOPS])
        raise SettingError("stop has no '{name}' that is understood here. {near}", name=name, near=near)
    try:
        value = float(amount) * {"time_total_s": 1 / 60, "training_iteration": rollouts}.get(name, 1)
    except (TypeError, ValueError):
        raise SettingError("stop: '{name}' is {amount!r}; expected a number.", name=name, amount=amount) from None
    return f"{STOPS[name]}={value:.12g}"
