"""RLlib's words for PPO, APPO, DQN and Ape-X, in ours. Begin with `WORDS`; docs and launcher read it.

The tables speak as Ray 0.5 to 1.6 did, when scripts were written; `LATER_NAMES` has what Ray 2 calls the same.

Three kinds of word: it has a setting of ours; it is taken into account in another way; it has no meaning here, and the
launcher says why. A word that stands nowhere in the table is refused with the nearest one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from racecraft.contract.errors import SettingError, nearest

ELSEWHERE = "elsewhere"
"""A word that `translated` takes into account itself."""


@dataclass(frozen=True)
class ConfigKey:
    """What a word of RLlib's means here."""

    setting: str = ""
    """Ours, as after --set; ELSEWHERE; "": none."""
    doc: str = ""
    """How it is taken into account, or why it means nothing here."""


WORDS: Mapping[str, ConfigKey] = {
    "gamma": ConfigKey("ppo.discount"),
    "lambda": ConfigKey("ppo.gae_lambda"),
    "lr": ConfigKey("ppo.learning_rate"),
    "num_sgd_iter": ConfigKey("ppo.epochs"),
    "sgd_minibatch_size": ConfigKey("ppo.batch_size"),
    "clip_param": ConfigKey("ppo.clip"),
    "entropy_coeff": ConfigKey("ppo.entropy_weight"),
    "vf_loss_coeff": ConfigKey("ppo.value_weight"),
    "grad_clip": ConfigKey("ppo.max_grad_norm"),
    "env": ConfigKey(ELSEWHERE, "the environment: one given to register_env, or one that Gymnasium knows"),
    "env_config": ConfigKey(ELSEWHERE, "what the environment's creator is told"),
    "num_workers": ConfigKey(ELSEWHERE, "rollout.num_worlds = num_workers x num_envs_per_worker: worlds side by side"),
    "num_envs_per_worker": ConfigKey(ELSEWHERE, "see num_workers"),
    "train_batch_size": ConfigKey(ELSEWHERE, "rollout.horizon = train_batch_size / rollout.num_worlds"),
    "seed": ConfigKey(ELSEWHERE, "--seed"),
    "horizon": ConfigKey(ELSEWHERE, "ticks after which an episode of the environment is cut; 1,000 unless given"),
    "model": ConfigKey(ELSEWHERE, "see the table of its words"),
    "multiagent": ConfigKey(ELSEWHERE, "see the table of its words"),
    "callbacks": ConfigKey(ELSEWHERE, "see the table of its words"),
    "kl_coeff": ConfigKey("", "this PPO clips and has no KL penalty beside it"),
    "kl_target": ConfigKey("", "this PPO clips and has no KL penalty beside it"),
    "vf_clip_param": ConfigKey("", "the value loss is not clipped here"),
    "vf_share_layers": ConfigKey(ELSEWHERE, "network.separate_networks, turned round"),
    "rollout_fragment_length": ConfigKey("", "every world gives equally many ticks, see train_batch_size"),
    "sample_batch_size": ConfigKey("", "every world gives equally many ticks, see train_batch_size"),
    "batch_mode": ConfigKey("", "episodes may be cut by an update; their value still follows"),
    "vtrace": ConfigKey("", "APPO's learner is always corrected by V-trace, PPO's never needs it"),
    "broadcast_interval": ConfigKey("", "actors take over APPO's weights once a rollout"),
    "learner_queue_size": ConfigKey("", "one rollout waits for APPO's learner, never more"),
    "use_gae": ConfigKey("", "advantages are always generalised (GAE)"),
    "shuffle_sequences": ConfigKey("", "minibatches are always shuffled"),
    "num_gpus": ConfigKey("", "the learner's device is runtime.device"),
    "num_gpus_per_worker": ConfigKey("", "worlds need no GPU"),
    "num_cpus_per_worker": ConfigKey("", "worlds share the job's cores"),
    "num_cpus_for_driver": ConfigKey("", "worlds and learner share the job's cores"),
    "framework": ConfigKey("", "it is PyTorch"),
    "use_pytorch": ConfigKey("", "it is PyTorch"),
    "eager": ConfigKey("", "it is PyTorch"),
    "monitor": ConfigKey("", "no video of each episode is kept"),
    "log_level": ConfigKey("", "every iteration is told in a line"),
    "ignore_worker_failures": ConfigKey("", "an environment that raises ends the job, and says why"),
    "create_env_on_driver": ConfigKey("", "worlds live in the learner's process"),
    "observation_filter": ConfigKey("", "observations are used as they come; network.normalise standardises them"),
    "clip_rewards": ConfigKey("", "rewards are learned from as they are"),
    "clip_actions": ConfigKey("", "actions are always kept inside the space"),
    "simple_optimizer": ConfigKey("", "there is one optimiser"),
}  # fmt: skip
"""Every word of a configuration that is understood."""
OF_PPO = (
    "lambda", "num_sgd_iter", "sgd_minibatch_size", "clip_param", "entropy_coeff", "vf_loss_coeff", "kl_coeff",
    "kl_target", "vf_clip_param", "vf_share_layers", "vtrace", "broadcast_interval", "learner_queue_size", "use_gae",
    "shuffle_sequences", "simple_optimizer",
)  # fmt: skip
"""Words that DQN and Ape-X do not know."""
OF_DQN = ("exploration_final_eps", "exploration_fraction")
"""Words that mean nothing to Ape-X, to RLlib's neither."""
VALUE_WORDS: Mapping[str, ConfigKey] = {
    **{name: word for name, word in WORDS.items() if name not in OF_PPO},
    "gamma": ConfigKey("dqn.discount"),
    "lr": ConfigKey("dqn.learning_rate"),
    "train_batch_size": ConfigKey("dqn.batch_size"),
    "grad_clip": ConfigKey("dqn.max_grad_norm"),
    "n_step": ConfigKey("dqn.n_step"),
    "double_q": ConfigKey("dqn.double"),
    "dueling": ConfigKey("dqn.dueling"),
    "adam_epsilon": ConfigKey("dqn.adam_epsilon"),
    "buffer_size": ConfigKey("replay.capacity"),
    "learning_starts": ConfigKey("replay.learning_starts"),
    "prioritized_replay": ConfigKey("replay.prioritised"),
    "prioritized_replay_alpha": ConfigKey("replay.priority_exponent"),
    "prioritized_replay_beta": ConfigKey("replay.importance_exponent"),
    "rollout_fragment_length": ConfigKey(ELSEWHERE, "rollout.horizon; DQN learns once in as many ticks of "
                                    "all worlds (dqn.train_every), Ape-X's once in 16 steps (apex.train_every)"),
    "sample_batch_size": ConfigKey(ELSEWHERE, "the same (Ray before 0.8.4)"),
    "target_network_update_freq": ConfigKey(ELSEWHERE, "dqn.target_every: over the steps between two of learning"),
    "exploration_config": ConfigKey(ELSEWHERE, "initial_epsilon, final_epsilon, epsilon_timesteps: dqn.epsilon_first, "
                               "epsilon_last, epsilon_steps"),
    "exploration_final_eps": ConfigKey("dqn.epsilon_last"),
    "schedule_max_timesteps": ConfigKey(ELSEWHERE, "steps of which the two fractions are parts; 100,000 unless said"),
    "exploration_fraction": ConfigKey(ELSEWHERE, "dqn.epsilon_steps = exploration_fraction x schedule_max_timesteps"),
    "beta_annealing_fraction": ConfigKey(ELSEWHERE, "replay.importance_steps, likewise"),
    "num_atoms": ConfigKey(ELSEWHERE, "1; with more a value would be a distribution (C51), which is refused"),
    "noisy": ConfigKey(ELSEWHERE, "false; noise within the network is refused"),
    "v_min": ConfigKey("", "a value is its mean, and no range is cut into atoms"),
    "v_max": ConfigKey("", "a value is its mean, and no range is cut into atoms"),
    "hiddens": ConfigKey(ELSEWHERE, "layers behind those of the model, with network.hidden_units"),
    "prioritized_replay_eps": ConfigKey("", "what is added to an error is fixed"),
    "final_prioritized_replay_beta": ConfigKey("", "it always ends at 1"),
    "per_worker_exploration": ConfigKey("", "Ape-X's worlds always explore each in their own degree, DQN's all alike"),
    "worker_side_prioritization": ConfigKey("", "Ape-X's actors always note what they expected"),
    "num_aggregation_workers": ConfigKey("", "there is one memory"),
    "compress_observations": ConfigKey("", "what is remembered is kept once, in the environment's own types"),
    "timesteps_per_iteration": ConfigKey("", "an iteration is a rollout"),
    "min_iter_time_s": ConfigKey("", "an iteration is a rollout"),
}  # fmt: skip
"""Likewise, of DQN and Ape-X; where a setting begins with dqn., Ape-X's begins with apex."""
RUNS: Mapping[str, tuple[str, ...]] = {
    "PPO": (),
    "APPO": ("ppo.asynchronous=true",),
    "DQN": ("dqn.optimiser=adam", "dqn.double=true", "dqn.dueling=true", "replay.prioritised=true"),
    "APEX": ("apex.optimiser=adam", "replay.prioritised=true"),
}
"""RLlib's algorithms that are understood, with what asks for them here: first what RLlib's own do by default."""
ALGORITHMS = {"PPO": "ppo", "APPO": "ppo", "DQN": "dqn", "APEX": "apex"}
"""What each of them is called here."""
FRAGMENTS = {"DQN": 4, "APEX": 50}
"""RLlib's rollout_fragment_length where a script says none."""
EPSILONS = {"initial_epsilon": "first", "final_epsilon": "last", "epsilon_timesteps": "steps"}
LATER_NAMES: Mapping[str, str] = {
    "lambda_": "lambda",
    "num_epochs": "num_sgd_iter",
    "minibatch_size": "sgd_minibatch_size",
    "train_batch_size_per_learner": "train_batch_size",
    "num_rollout_workers": "num_workers",
    "num_env_runners": "num_workers",
    "num_envs_per_env_runner": "num_envs_per_worker",
    "num_cpus_per_env_runner": "num_cpus_per_worker",
    "num_gpus_per_env_runner": "num_gpus_per_worker",
    "create_env_on_local_worker": "create_env_on_driver",
    "ignore_env_runner_failures": "ignore_worker_failures",
    "callbacks_class": "callbacks",
    "framework_str": "framework",
    "num_steps_sampled_before_learning_starts": "learning_starts",
    "min_time_s_per_iteration": "min_iter_time_s",
    "min_sample_timesteps_per_iteration": "timesteps_per_iteration",
}
"""Words of Ray 2's configuration, and what they were called before."""
LATER_STOPS: Mapping[str, str] = {
    "env_runners/episode_return_mean": "episode_reward_mean",
    "sampler_results/episode_reward_mean": "episode_reward_mean",
    "episode_return_mean": "episode_reward_mean",
    "num_env_steps_sampled": "timesteps_total",
    "num_env_steps_sampled_lifetime": "timesteps_total",
}
"""The same of stops."""
EXPERIMENT_WORDS: Mapping[str, str] = {
    "run": "see the table of its words",
    "env": "as config.env, which goes before it",
    "stop": "see the table of its words",
    "config": "see the tables above",
    "name": "nothing: the run folder has its environment's name",
    "local_dir": "nothing: in a job the run folder stands in its model, else among the runs",
    "checkpoint_freq": "nothing: every iteration is kept, the oldest go when they take 4 GB",
    "checkpoint_at_end": "nothing: every iteration is kept",
    "keep_checkpoints_num": "nothing: every iteration is kept, the oldest go when they take 4 GB",
    "checkpoint_score_attr": "nothing: the best is known by its evaluation",
    "num_samples": "refused where more than one is asked: `racecraft tune` trains many times",
    "restore": "refused: the same job, or --resume, goes on from its last iteration",
    "max_failures": "nothing: a job that a signal ended is begun again",
    "resources_per_trial": "nothing: a job says its cores",
    "verbose": "nothing: every iteration is told in a line",
    "loggers": "nothing: every run has its metrics in files",
    "export_formats": "nothing: `racecraft export` makes them",
    "sync_config": "nothing: nothing is copied elsewhere",
    "sync_function": "nothing: nothing is copied elsewhere",
    "upload_dir": "nothing: nothing is copied elsewhere",
    "trial_name_creator": "nothing: there are no trials",
}
"""Words of one experiment, and what they are here."""
STOPS: Mapping[str, str] = {
    "timesteps_total": "steps",
    "training_iteration": "iterations",
    "time_total_s": "minutes",
    "episode_reward_mean": "score",
}
"""RLlib's stops, and ours; seconds become minutes."""
APEX_EVERY = 16
"""Ape-X's steps between two of learning; RLlib has no such number, the setting's own default."""
LONGEST_EPISODE = 1000
"""Ticks; a greedy policy that has learned nothing yet may never end an episode by itself."""
JUDGED_EPISODES = 4
"""Episodes of one evaluation, each in an environment of its own: scripts' environments may be whole programs."""
MODEL_WORDS: Mapping[str, str] = {
    "fcnet_hiddens": "network.hidden_units",
    "fcnet_activation": "network.activation",
    "vf_share_layers": "network.separate_networks, turned round",
    "conv_filters": "network.conv_filters, conv_kernels and conv_strides; no padding",
    "use_lstm": "network.memory=lstm",
    "lstm_cell_size": "network.memory_units, with use_lstm",
    "max_seq_len": "ppo.sequence_length, with use_lstm",
    "custom_model": "network.policy: a TorchModelV2 given to ModelCatalog.register_custom_model, which decides and "
    'values by itself; "" or none: our own network. One of TensorFlow is refused by name',
    "custom_model_config": "what the custom model is told",
    "custom_options": "the same (Ray before 0.8.4)",
    "conv_activation": "nothing: network.activation is that of all layers",
    "no_final_linear": "nothing: the heads are always linear",
    "free_log_std": "nothing: the spread of continuous actions is always free of what is seen",
}
"""Words of config.model, and what they are here."""
CUSTOM = ("custom_model", "custom_model_config", "custom_options")
MULTI_WORDS: Mapping[str, str] = {
    "policies": "names, or (class, observation space, action space, config) of each: a network and learner of its own; "
    "a class is refused, a config may say what is its own",
    "policy_mapping_fn": "asked once for each agent",
    "policies_to_train": "policies that are not named here act and learn nothing",
    "policy_map_capacity": "nothing: all policies are in memory",
    "policy_map_cache": "nothing: all policies are in memory",
    "observation_fn": "refused: what an agent sees is the environment's affair",
    "replay_mode": "nothing: nothing is replayed",
    "count_steps_by": "nothing: a step is one agent's",
}
"""Words of config.multiagent, and what they are here."""
CALLBACK_WORDS: Mapping[str, str] = {
    "on_episode_start": "called in the worlds that are learned in, with episode, worker, base_env, policies, env_index",
    "on_episode_step": "the same, behind every tick",
    "on_episode_end": "the same; the episode's custom_metrics are told as NAME_mean, NAME_min and NAME_max",
    "on_train_result": "called behind every iteration once an episode has ended, with trainer and result; what it lays "
    "into the result is told with it",
} | dict.fromkeys(
    (
        "on_sample_end", "on_postprocess_traj", "on_postprocess_trajectory", "on_learn_on_batch", "on_trainer_init",
        "on_algorithm_init", "on_create_policy", "on_sub_environment_created", "on_environment_created",
        "on_episode_created", "on_evaluate_start", "on_evaluate_end", "on_workers_recreated", "on_checkpoint_loaded",
    ),
    "not called: batches, policies and workers have another shape here",
)  # fmt: skip
"""RLlib's callbacks, and what they are here."""
NO_MODEL = ("", "none", "None", None)


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
    horizon: int
    """Ticks after which an episode is cut; its value still follows."""
    said: tuple[str, ...] = field(default_factory=tuple)
    """What has no meaning here, a sentence each."""
    callbacks: Any = None
    """As the script said it: a class of RLlib's callbacks, or functions by name; None: none."""


def translated(experiment: Mapping[str, Any]) -> Translated:
    """Return an experiment, `{"run", "stop", "config"}`, in our words.

    Raises:
        SettingError: An algorithm, a word or a stop that is not understood; the nearest known one is told.

    >>> told = translated(
    ...     {
    ...         "run": "PPO",
    ...         "stop": {"timesteps_total": 10000},
    ...         "config": {"env": "x", "gamma": 0.995, "train_batch_size": 500, "num_workers": 2, "kl_coeff": 1.0},
    ...     }
    ... )
    >>> told.settings, told.stops
    (('rollout.num_worlds=2', 'rollout.horizon=250', 'evaluation.episodes=4', 'ppo.discount=0.995'), ('steps=10000',))
    >>> told.said
    ('kl_coeff: this PPO clips and has no KL penalty beside it',)
    """
    said: list[str] = []
    _require_experiment_words(experiment, said)
    run = str(experiment.get("run"))
    if run not in RUNS:
        raise SettingError(
            "run: {run!r}; `racecraft run` understands {runs} of RLlib's algorithms.", run=run, runs=", ".join(RUNS)
        )
    algorithm = ALGORITHMS[run]
    known = words_of(algorithm)
    config = _by_first_names("config", _part(experiment, "config"), LATER_NAMES)
    environment = config.get("env") or experiment.get("env")
    if not isinstance(environment, str):
        raise SettingError(
            "config.env is {environment!r}; expected a name given to register_env, or a Gymnasium id.",
            environment=environment,
        )
    settings = [*_worlds(run, config), f"evaluation.episodes={JUDGED_EPISODES}", *RUNS[run]]
    for name, value in config.items():
        if name not in known:
            near = nearest(name, [*known, *LATER_NAMES])
            raise SettingError(
                "config of {run} has no '{name}' that is understood here. {near}", run=run, name=name, near=near
            )
        word = known[name]
        if not word.setting:
            said.append(f"{name}: {word.doc}")
        elif word.setting != ELSEWHERE:
            settings.append(f"{word.setting}={'none' if value is None else value}")
    model = {**_part(config, "model"), **{name: config[name] for name in ("vf_share_layers",) if name in config}}
    if run in FRAGMENTS:
        settings += [*_exploration(run, config), *_schedules(run, config)]
        model = _model_of_values(run, model, config)
    settings += _model(model, said)
    multiagent = _part(config, "multiagent")
    _require_multi_words(multiagent, said)
    horizon = _whole(config, "horizon", LONGEST_EPISODE)
    asked_stops = _by_first_names("stop", _part(experiment, "stop"), LATER_STOPS)
    stops = tuple(_stop(name, amount) for name, amount in asked_stops.items())
    return Translated(
        algorithm, environment, _part(config, "env_config"), tuple(settings), stops, config.get("seed"), multiagent,
        model.get("custom_model") not in NO_MODEL, horizon, tuple(said), config.get("callbacks"),
    )  # fmt: skip


def words_of(algorithm: str) -> Mapping[str, ConfigKey]:
    """Return every word of a configuration that is understood with an algorithm of ours, with its settings.

    >>> words_of("apex")["gamma"].setting
    'apex.discount'
    """
    if algorithm == "ppo":
        return WORDS
    return {
        name: replace(word, setting=word.setting.replace("dqn.", f"{algorithm}."))
        if algorithm == "dqn" or name not in OF_DQN
        else ConfigKey("", "Ape-X's worlds explore each in their own degree")
        for name, word in VALUE_WORDS.items()
    }


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


def _whole(config: Mapping[str, Any], name: str, otherwise: int, least: int = 0) -> int:
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


def _require_experiment_words(experiment: Mapping[str, Any], said: list[str]) -> None:
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
            said.append(f"{name}: {meaning.removeprefix('nothing: ')}")


def _require_multi_words(multiagent: Mapping[str, Any], said: list[str]) -> None:
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
            said.append(f"multiagent.{name}: {MULTI_WORDS[name].removeprefix('nothing: ')}")


def _worlds(run: str, config: Mapping[str, Any]) -> list[str]:
    worlds = max(1, _whole(config, "num_workers", 2)) * max(1, _whole(config, "num_envs_per_worker", 1, 1))
    if run in FRAGMENTS:
        return [
            f"rollout.num_worlds={worlds}",
            f"rollout.horizon={_fragment(run, config)}",
            *_pace(run, config, worlds),
        ]
    horizon = max(1, round(_whole(config, "train_batch_size", 4000, 1) / worlds))
    return [f"rollout.num_worlds={worlds}", f"rollout.horizon={horizon}"]


def _fragment(run: str, config: Mapping[str, Any]) -> int:
    said = config.get("rollout_fragment_length")
    word = "sample_batch_size" if said in (None, 0, "auto") else "rollout_fragment_length"
    return max(1, _whole(config, word, FRAGMENTS[run]) or FRAGMENTS[run])


def _pace(run: str, config: Mapping[str, Any], worlds: int) -> list[str]:
    """Return how often is learned, and how often the target network follows, in steps of learning.

    RLlib's DQN takes one step of learning behind each round of its workers' fragments. Its Ape-X learns as fast as it
    can; ours in a proportion to what is collected, which stays as it is.
    """
    algorithm = ALGORITHMS[run]
    every = worlds * _fragment(run, config) if run == "DQN" else APEX_EVERY
    told = [f"{algorithm}.train_every={every}"]
    if frequency := _whole(config, "target_network_update_freq", 0):
        told.append(f"{algorithm}.target_every={max(1, round(frequency / every))}")
    return told


def _exploration(run: str, config: Mapping[str, Any]) -> list[str]:
    said = dict(config.get("exploration_config") or {})
    kind = said.pop("type", "EpsilonGreedy")
    if kind not in ("EpsilonGreedy", "PerWorkerEpsilonGreedy"):
        raise SettingError("config.exploration_config is of type {kind!r}; expected EpsilonGreedy.", kind=kind)
    for name in said:
        if name not in EPSILONS:
            raise SettingError(
                "config.exploration_config has no '{name}'. {hint}", name=name, hint=nearest(name, EPSILONS)
            )
    if run == "APEX":
        if said:
            raise SettingError(
                "config.exploration_config: APEX's worlds explore each in their own degree; leave it out."
            )
        return []
    return [f"dqn.epsilon_{EPSILONS[name]}={value}" for name, value in said.items()]


def _schedules(run: str, config: Mapping[str, Any]) -> list[str]:
    """Return over how many steps chance grows rarer, and importance is weighed out wholly, as Ray before 0.8.3 said."""
    if _whole(config, "num_atoms", 1) != 1 or config.get("noisy"):
        raise SettingError(
            "config: num_atoms is {config} and noisy is {config_2}; expected 1 "
            "and False: neither distributions of values nor noisy networks are learned here.",
            config=config.get("num_atoms", 1),
            config_2=config.get("noisy", False),
        )
    whole = _whole(config, "schedule_max_timesteps", 100_000)
    names = {"beta_annealing_fraction": "replay.importance_steps"}
    if run == "DQN":
        names["exploration_fraction"] = "dqn.epsilon_steps"
    try:
        shares = {ours: float(config[name]) for name, ours in names.items() if name in config}
    except (TypeError, ValueError):
        raise SettingError(
            "{names}: expected shares of schedule_max_timesteps, 0 to 1.", names=", ".join(names)
        ) from None
    return [f"{ours}={max(1, round(share * whole))}" for ours, share in shares.items()]


def _model_of_values(run: str, model: Mapping[str, Any], config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the model with the layers that RLlib lays behind it."""
    if model.get("custom_model") not in NO_MODEL:
        raise SettingError(
            "config.model.custom_model is {model!r}, and run is {run}; expected PPO or APPO with a "
            'model of the script\'s own, or none (the hyperparameter rl.training.config.model.custom_model="").',
            model=model["custom_model"],
            run=run,
        )
    hiddens = config.get("hiddens")
    if hiddens:
        model = {**model, "fcnet_hiddens": [*model.get("fcnet_hiddens", ()), *hiddens]}
    return {name: value for name, value in model.items() if name != "vf_share_layers"}


def _model(model: Mapping[str, Any], said: list[str]) -> list[str]:
    settings: list[str] = []
    for name in model:
        if name not in MODEL_WORDS:
            raise SettingError(
                "config.model has no '{name}' that is understood here. {hint}",
                name=name,
                hint=nearest(name, MODEL_WORDS),
            )
        if MODEL_WORDS[name].startswith("nothing"):
            said.append(f"model.{name}: {MODEL_WORDS[name].removeprefix('nothing: ')}")
    custom = model.get("custom_model")
    if custom not in NO_MODEL:
        from racecraft.compat.script_models import offered_model

        return [f"network.policy={offered_model(custom, model)}"]
    said += [f"model.{name}: there is no custom_model that it would be told" for name in CUSTOM[1:] if model.get(name)]
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
    told = {"filters": [row[0] for row in rows], "kernels": kernels, "strides": [row[2] for row in rows]}
    return [f"network.conv_{name}={','.join(map(str, values))}" for name, values in told.items()]


def _stop(name: str, amount: Any) -> str:
    if name not in STOPS:
        near = nearest(name, [*STOPS, *LATER_STOPS])
        raise SettingError("stop has no '{name}' that is understood here. {near}", name=name, near=near)
    try:
        value = float(amount) / (60.0 if name == "time_total_s" else 1.0)
    except (TypeError, ValueError):
        raise SettingError("stop: '{name}' is {amount!r}; expected a number.", name=name, amount=amount) from None
    return f"{STOPS[name]}={value:.12g}"
