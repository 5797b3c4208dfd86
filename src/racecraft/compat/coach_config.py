"""Presets of Coach (rl_coach 0.10 to 1.0) in our words. Begin with `translated`; `AGENT_WORDS` is the one table.

A preset only lays values into a tree of parameters. `Part` stands for any branch of that tree and remembers what is
laid into it; nothing of Coach runs. What is laid into it stands in the table, or is refused with the nearest word.
Defaults of a preset that says nothing are Coach's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from racecraft.contract.errors import SettingError, nearest

STEPS, EPISODES, TRAININGS = "EnvironmentSteps", "EnvironmentEpisodes", "TrainingSteps"
PPO, DQN = "ppo", "dqn"
AGENTS = {"ClippedPPOAgentParameters": PPO, "DQNAgentParameters": DQN, "DDQNAgentParameters": DQN}
"""Coach's agents that are trained here, and our algorithm."""
LONGEST = 10**12
"""Steps that no training reaches."""
WORLDS = 8
"""Copies of the environment side by side; Coach has one a worker."""


class Part:
    """A branch of a preset: any name may be laid into it, and what was not laid is a further branch."""

    def __init__(self, kind: str = "", **parts: Any) -> None:
        vars(self)["kind"], vars(self)["parts"] = kind, dict(parts)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self[name]

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value

    def __getitem__(self, name: str) -> Any:
        return self.parts.setdefault(name, Part())

    def __setitem__(self, name: str, value: Any) -> None:
        self.parts[name] = value

    def add_observation_filter(self, observation: str, name: str, chosen: Any) -> None:
        """Remember a filter of what is observed."""
        self.parts["observation_filter"] = chosen

    def leaves(self, before: str = "") -> Iterator[tuple[str, Any]]:
        """Yield every value that was laid into it, by its path."""
        for name, value in self.parts.items():
            if isinstance(value, Part) and not value.kind.endswith("Filter"):
                yield from value.leaves(f"{before}{name}.")
            else:
                yield f"{before}{name}", value


@dataclass(frozen=True)
class Amount:
    """So many steps, episodes or acts of learning."""

    kind: str
    count: float


@dataclass(frozen=True)
class Line:
    """A schedule from one value to another over so many steps."""

    first: float
    last: float
    steps: int


@dataclass(frozen=True)
class Layer:
    """A dense layer."""

    units: int


@dataclass(frozen=True)
class Head:
    """What a network of DQN ends in."""

    is_dueling: bool


MAIN = "network_wrappers.main."
SEEN = f"{MAIN}input_embedders_parameters.observation."
BEHIND = f"{MAIN}middleware_parameters."
TABLE, HERE = "table", "here"
"""How a word is taken into account: it is a setting of ours, or `translated` looks at it itself."""
AGENT_WORDS: Mapping[str, tuple[str, str]] = {
    f"{MAIN}learning_rate": (TABLE, "learning_rate"),
    f"{MAIN}batch_size": (TABLE, "batch_size"),
    f"{MAIN}optimizer_epsilon": (TABLE, "adam_epsilon"),
    f"{SEEN}scheme": (HERE, "the first of network.hidden_units"),
    f"{BEHIND}scheme": (HERE, "the last of network.hidden_units"),
    f"{SEEN}activation_function": (HERE, "network.activation"),
    f"{BEHIND}activation_function": (HERE, "network.activation"),
    f"{MAIN}heads_parameters": (HERE, "dqn.dueling: [QHeadParameters()] or [DuelingQHeadParameters()]"),
    f"{MAIN}adam_optimizer_beta2": ("", "Adam's second figure is 0.999 here"),
    f"{MAIN}replace_mse_with_huber_loss": ("", "DQN's loss is Huber's here"),
    "algorithm.discount": (TABLE, "discount"),
    "algorithm.clip_likelihood_ratio_using_epsilon": (TABLE, "clip"),
    "algorithm.beta_entropy": (TABLE, "entropy_weight"),
    "algorithm.gae_lambda": (TABLE, "gae_lambda"),
    "algorithm.optimization_epochs": (TABLE, "epochs"),
    "algorithm.num_steps_between_copying_online_weights_to_target": (
        HERE, "PPO: how much is collected before an update; DQN: dqn.target_every"
    ),
    "algorithm.num_consecutive_playing_steps": (HERE, "PPO: likewise; DQN: dqn.train_every"),
    "algorithm.clipping_decay_schedule": ("", "how far a ratio may move stays as it is set"),
    "algorithm.estimate_state_value_using_gae": ("", "advantages and values are always generalised (GAE)"),
    "algorithm.num_episodes_in_experience_replay": ("", "PPO learns from what was just collected"),
    "algorithm.distributed_coach_synchronization_type": ("", "there is one learner"),
    "exploration.epsilon_schedule": (HERE, "DQN: dqn.epsilon_…; PPO explores by its own policy"),
    "memory.max_size": (HERE, "replay.capacity"),
    "pre_network_filter.observation_filter": (HERE, "network.normalise"),
}  # fmt: skip
"""What may be laid into `agent_params`, by path: (how, what it is here)."""
SCHEDULE_WORDS = ("improve_steps", "heatup_steps", "evaluation_steps", "steps_between_evaluation_periods")
DEFAULTS = {
    PPO: ("ppo.learning_rate=0.00025", "ppo.batch_size=64", "ppo.epochs=10", "ppo.clip=0.2", "ppo.entropy_weight=0.01",
          "ppo.gae_lambda=0.95", "ppo.discount=0.99", "ppo.max_grad_norm=none", "network.separate_networks=true"),
    DQN: ("dqn.learning_rate=0.00025", "dqn.batch_size=32", "dqn.discount=0.99", "dqn.optimiser=adam",
          "dqn.max_grad_norm=none", "dqn.n_step=1", "dqn.epsilon_first=1", "dqn.epsilon_last=0.1",
          "dqn.epsilon_steps=1000000"),
}  # fmt: skip
"""Of Coach, where a preset says nothing."""
PLAYED = {PPO: Amount(STEPS, 2048), DQN: Amount(STEPS, 4)}
SEEN_UNITS = {"Empty": (), "Shallow": (128,), "Medium": (256,), "Deep": (128, 128, 128)}
BEHIND_UNITS = {"Empty": (), "Shallow": (64,), "Medium": (512,), "Deep": (128, 128, 128)}
"""Coach's named schemes for vectors."""


@dataclass
class Translation:
    """What a preset asks for, in our words."""

    algorithm: str
    environment: str
    env_words: dict[str, Any]
    settings: list[str]
    stop: str
    episodes: int | None = None
    """Training ends after so many, at the end of an iteration; None: `stop` says when."""
    notes: list[str] = field(default_factory=list)
    """What has no meaning here, a sentence each."""


def translated(graph: Part) -> Translation:
    """Return what a preset's graph manager asks for.

    Raises:
        SettingError: An agent or a word that is not known, or an environment that is none.
    """
    agent, environment = graph.agent_params, graph.env_params
    algorithm = AGENTS.get(agent.kind)
    if algorithm is None:
        raise SettingError(
            "the preset's agent is {kind}; expected one of {agents}: others of Coach's "
            "have no counterpart that their presets could be read into.",
            kind=agent.kind or "missing",
            agents=", ".join(AGENTS),
        )
    laid = dict(agent.leaves())
    translation = Translation(algorithm, *_environment(environment), settings=list(DEFAULTS[algorithm]), stop="")
    for path, value in laid.items():
        _require_word(path)
        how, what = AGENT_WORDS[path]
        if how == TABLE:
            translation.settings.append(_setting(algorithm, path, what, value))
        elif not how:
            translation.notes.append(f"{path}: {what}")
    translation.settings.append(f"dqn.double={str(agent.kind.startswith('DDQN')).lower()}" * (algorithm == DQN))
    translation.settings += _network(laid, algorithm)
    translation.settings += _head(laid.get(f"{MAIN}heads_parameters"), algorithm)
    _set_algorithm(translation, laid, algorithm)
    _set_schedule(translation, graph, algorithm)
    translation.settings = [one for one in translation.settings if one]
    for name in ("vis_params", "preset_validation_params"):
        if list(graph[name].leaves()):
            translation.notes.append(
                f"{name}: films and tests of presets are Coach's own; `racecraft evaluate` judges a run"
            )
    return translation


def _environment(environment: Part) -> tuple[str, dict[str, Any]]:
    known = dict(environment.parts)
    level, words = known.pop("level", ""), known.pop("additional_simulator_parameters", {})
    if environment.kind != "GymVectorEnvironment" or not isinstance(level, str) or not level:
        raise SettingError(
            "the preset's environment is {kind} with level {level!r}; expected "
            'GymVectorEnvironment(level="CartPole-v0") or (level="module:Class").',
            kind=environment.kind or "missing",
            level=level,
        )
    if known:
        raise SettingError("env_params: {known} has no counterpart here; expected level and "
                           "additional_simulator_parameters.", known=', '.join(known))  # fmt: skip
    return level, dict(words.parts if isinstance(words, Part) else words)


def _setting(algorithm: str, path: str, name: str, value: Any) -> str:
    if algorithm == DQN and name not in ("learning_rate", "batch_size", "discount", "adam_epsilon"):
        raise SettingError("{path} is a word of ClippedPPO; expected those of DQN in a preset of DQN.", path=path)
    return f"{algorithm}.{name}={value}"


def _network(laid: Mapping[str, Any], algorithm: str) -> list[str]:
    units = (
        *_units(laid.get(f"{SEEN}scheme", "Medium"), SEEN_UNITS),
        *_units(laid.get(f"{BEHIND}scheme", "Medium"), BEHIND_UNITS),
    )
    spoken = {laid[path] for path in (f"{SEEN}activation_function", f"{BEHIND}activation_function") if path in laid}
    if len(spoken) > 1:
        raise SettingError(
            "activation functions are {spoken}; expected one for all layers.", spoken=" and ".join(sorted(spoken))
        )
    activation = spoken.pop() if spoken else {PPO: "tanh", DQN: "relu"}[algorithm]
    settings = [f"network.hidden_units={','.join(map(str, units))}", f"network.activation={activation}"]
    if "pre_network_filter.observation_filter" in laid:
        settings.append("network.normalise=true")
    return settings


def _head(heads: Any, algorithm: str) -> list[str]:
    if heads is None:
        return []
    if algorithm != DQN or not isinstance(heads, list | tuple) or [type(one) for one in heads] != [Head]:
        raise SettingError(
            "{main}heads_parameters is {heads!r}; expected, of DQN, [QHeadParameters()] or [DuelingQHeadParameters()].",
            main=MAIN,
            heads=heads,
        )
    return [f"dqn.dueling={str(heads[0].is_dueling).lower()}"]


def _units(scheme: Any, named: Mapping[str, tuple[int, ...]]) -> tuple[int, ...]:
    if isinstance(scheme, str) and scheme in named:
        return named[scheme]
    if isinstance(scheme, list | tuple) and all(isinstance(layer, Layer) for layer in scheme):
        return tuple(layer.units for layer in scheme)
    raise SettingError(
        "scheme {scheme!r}; expected one of {named}, or a list of Dense(units).", scheme=scheme, named=", ".join(named)
    )


def _set_algorithm(translation: Translation, laid: Mapping[str, Any], algorithm: str) -> None:
    """Lay how much is played between updates, how the target follows, and how is explored."""
    played = laid.get("algorithm.num_consecutive_playing_steps", PLAYED[algorithm])
    copied = laid.get("algorithm.num_steps_between_copying_online_weights_to_target")
    line = laid.get("exploration.epsilon_schedule")
    if algorithm == PPO:
        collected = copied or played
        if collected.kind == EPISODES:
            translation.settings.append(f"rollout.episodes_per_iteration={round(collected.count)}")
        else:
            translation.settings += [
                f"rollout.num_worlds={WORLDS}",
                f"rollout.horizon={max(1, round(collected.count / WORLDS))}",
            ]
        if line is not None:
            translation.notes.append("exploration.epsilon_schedule: PPO explores by its own policy")
        return
    every = max(1, round(played.count))
    follows = max(1, round((copied or Amount(STEPS, 10_000)).count / every))
    translation.settings += [f"dqn.train_every={every}", f"dqn.target_every={follows}"]
    if isinstance(line, Line):
        translation.settings += [
            f"dqn.epsilon_first={line.first}", f"dqn.epsilon_last={line.last}", f"dqn.epsilon_steps={line.steps}",
        ]  # fmt: skip
    if "memory.max_size" in laid:
        translation.settings.append(f"replay.capacity={laid['memory.max_size'][1]}")


def _set_schedule(translation: Translation, graph: Part, algorithm: str) -> None:
    """Lay how long is trained, what comes before, and how is judged; what is laid into the graph itself wins."""
    parameters = {
        **dict(graph.schedule_params.leaves()),
        **{k: v for k, v in graph.parts.items() if k in SCHEDULE_WORDS},
    }
    for name in parameters:
        if name not in SCHEDULE_WORDS:
            raise SettingError("schedule_params has no '{name}'. {hint}", name=name, hint=nearest(name, SCHEDULE_WORDS))
    improve = parameters.get("improve_steps", Amount(TRAININGS, 10_000_000_000))
    heatup = parameters.get("heatup_steps", Amount(STEPS, 0))
    translation.stop = _stop(translation, improve, algorithm)
    if algorithm == DQN and heatup.kind == STEPS and heatup.count:
        translation.settings.append(f"replay.learning_starts={round(heatup.count)}")
    elif heatup.count:
        translation.notes.append(
            f"heatup_steps: {'PPO learns from its first rollout on' if algorithm == PPO else heatup}"
        )
    judged = parameters.get("evaluation_steps")
    if judged is not None and judged.kind == EPISODES and judged.count >= 1:
        translation.settings.append(f"evaluation.episodes={round(judged.count)}")
    if "steps_between_evaluation_periods" in parameters:
        translation.notes.append("steps_between_evaluation_periods: evaluation.every says how often is judged")


def _stop(translation: Translation, improve: Amount, algorithm: str) -> str:
    """Return our stop; an act of learning is an iteration of PPO's, and so many steps of DQN's."""
    if improve.kind == TRAININGS and algorithm == PPO:
        return f"iterations={round(improve.count)}"
    if improve.kind == TRAININGS:
        every = next(int(one.rpartition("=")[2]) for one in translation.settings if one.startswith("dqn.train_every"))
        return f"steps={round(improve.count * every)}"
    if improve.kind == STEPS:
        return f"steps={round(improve.count)}"
    translation.episodes = round(improve.count)
    return f"steps={LONGEST}"


def _require_word(path: str) -> None:
    if path not in AGENT_WORDS:
        raise SettingError(
            "agent_params.{path} has no meaning that is known here. {hint}", path=path, hint=nearest(path, AGENT_WORDS)
        )
