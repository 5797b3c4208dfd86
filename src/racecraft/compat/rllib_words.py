"""RLlib's words for PPO and APPO (Ray 0.5 to 1.6), in ours. Begin with `WORDS`; docs and launcher read this table.

Three kinds of word: it has a setting of ours; it is taken into account in another way; it has no meaning here, and the
launcher says why. A word that stands nowhere in the table is refused with the nearest one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from racecraft.contract.errors import SettingError, nearest

ELSEWHERE = "elsewhere"
"""A word that `translated` takes into account itself."""


@dataclass(frozen=True)
class Word:
    """What a word of RLlib's means here."""

    setting: str = ""
    """Ours, as after --set; ELSEWHERE; "": none."""
    doc: str = ""
    """How it is taken into account, or why it means nothing here."""


WORDS: Mapping[str, Word] = {
    "gamma": Word("ppo.discount"),
    "lambda": Word("ppo.gae_lambda"),
    "lr": Word("ppo.learning_rate"),
    "num_sgd_iter": Word("ppo.epochs"),
    "sgd_minibatch_size": Word("ppo.batch_size"),
    "clip_param": Word("ppo.clip"),
    "entropy_coeff": Word("ppo.entropy_weight"),
    "vf_loss_coeff": Word("ppo.value_weight"),
    "grad_clip": Word("ppo.max_grad_norm"),
    "env": Word(ELSEWHERE, "the environment: one given to register_env, or one that Gymnasium knows"),
    "env_config": Word(ELSEWHERE, "what the environment's creator is told"),
    "num_workers": Word(ELSEWHERE, "rollout.num_worlds = num_workers x num_envs_per_worker: worlds side by side"),
    "num_envs_per_worker": Word(ELSEWHERE, "see num_workers"),
    "train_batch_size": Word(ELSEWHERE, "rollout.horizon = train_batch_size / rollout.num_worlds"),
    "seed": Word(ELSEWHERE, "--seed"),
    "horizon": Word(ELSEWHERE, "ticks after which an episode of the script's environment is cut; 1,000 unless said"),
    "model": Word(ELSEWHERE, "fcnet_hiddens: network.hidden_units; fcnet_activation: network.activation"),
    "kl_coeff": Word("", "this PPO clips and has no KL penalty beside it"),
    "kl_target": Word("", "this PPO clips and has no KL penalty beside it"),
    "vf_clip_param": Word("", "the value loss is not clipped here"),
    "vf_share_layers": Word(ELSEWHERE, "network.separate_networks, turned round"),
    "rollout_fragment_length": Word("", "every world gives equally many ticks, see train_batch_size"),
    "sample_batch_size": Word("", "every world gives equally many ticks, see train_batch_size"),
    "batch_mode": Word("", "episodes may be cut by an update; their value still follows"),
    "vtrace": Word("", "APPO's learner is always corrected by V-trace, PPO's never needs it"),
    "broadcast_interval": Word("", "actors take over APPO's weights once a rollout"),
    "learner_queue_size": Word("", "one rollout waits for APPO's learner, never more"),
    "use_gae": Word("", "advantages are always generalised (GAE)"),
    "shuffle_sequences": Word("", "minibatches are always shuffled"),
    "num_gpus": Word("", "the learner's device is runtime.device"),
    "num_gpus_per_worker": Word("", "worlds need no GPU"),
    "num_cpus_per_worker": Word("", "worlds share the job's cores"),
    "num_cpus_for_driver": Word("", "worlds and learner share the job's cores"),
    "framework": Word("", "it is PyTorch"),
    "use_pytorch": Word("", "it is PyTorch"),
    "eager": Word("", "it is PyTorch"),
    "monitor": Word("", "no video of each episode is kept"),
    "log_level": Word("", "every iteration is told in a line"),
    "ignore_worker_failures": Word("", "an environment that raises ends the job, and says why"),
    "create_env_on_driver": Word("", "worlds live in the learner's process"),
    "observation_filter": Word("", "observations are seen as the environment gives them; network.normalise evens them"),
    "clip_actions": Word("", "actions are always kept inside the space"),
    "simple_optimizer": Word("", "there is one optimiser"),
}  # fmt: skip
"""Every word of a configuration that is understood."""
RUNS: Mapping[str, tuple[str, ...]] = {"PPO": (), "APPO": ("ppo.asynchronous=true",)}
"""RLlib's algorithms that are understood, with what asks for them here."""
STOPS: Mapping[str, str] = {
    "timesteps_total": "steps",
    "training_iteration": "iterations",
    "time_total_s": "minutes",
    "episode_reward_mean": "score",
}
"""RLlib's stops, and ours; seconds become minutes."""
LONGEST_EPISODE = 1000
"""Ticks; a greedy policy that has learned nothing yet may never end an episode by itself."""
JUDGED_EPISODES = 4
"""Episodes of one evaluation, each in an environment of its own: scripts' environments may be whole programs."""
MODEL_WORDS = ("fcnet_hiddens", "fcnet_activation", "vf_share_layers", "free_log_std")


@dataclass(frozen=True)
class Translated:
    """An experiment of RLlib's, in our words."""

    environment: str
    env_config: Mapping[str, Any]
    settings: tuple[str, ...]
    """group.name=value."""
    stops: tuple[str, ...]
    seed: int | None
    horizon: int
    """Ticks after which an episode is cut; its value still follows."""
    said: tuple[str, ...] = field(default_factory=tuple)
    """What has no meaning here, a sentence each."""


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
    if experiment.get("run") not in RUNS:
        raise SettingError(
            f"run: {experiment.get('run')!r}; `racecraft run` understands {' and '.join(RUNS)} of RLlib's algorithms."
        )
    config = dict(experiment.get("config", {}))
    environment = config.get("env") or experiment.get("env")
    if not isinstance(environment, str):
        raise SettingError(f"config.env is {environment!r}; expected a name given to register_env, or a Gymnasium id.")
    settings = [*_worlds(config), f"evaluation.episodes={JUDGED_EPISODES}", *RUNS[experiment["run"]]]
    said: list[str] = []
    for name, value in config.items():
        if name not in WORDS:
            raise SettingError(f"config has no '{name}' that is understood here. {nearest(name, WORDS)}")
        word = WORDS[name]
        if not word.setting:
            said.append(f"{name}: {word.doc}")
        elif word.setting != ELSEWHERE:
            settings.append(f"{word.setting}={'none' if value is None else value}")
    model = {**config.get("model", {}), **{name: config[name] for name in ("vf_share_layers",) if name in config}}
    settings += _model(model, said)
    horizon = int(config.get("horizon") or LONGEST_EPISODE)
    stops = tuple(_stop(name, amount) for name, amount in dict(experiment.get("stop", {})).items())
    return Translated(
        environment, config.get("env_config", {}), tuple(settings), stops, config.get("seed"), horizon, tuple(said)
    )


def _worlds(config: Mapping[str, Any]) -> list[str]:
    worlds = max(1, int(config.get("num_workers", 2))) * int(config.get("num_envs_per_worker", 1))
    horizon = max(1, round(int(config.get("train_batch_size", 4000)) / worlds))
    return [f"rollout.num_worlds={worlds}", f"rollout.horizon={horizon}"]


def _model(model: Mapping[str, Any], said: list[str]) -> list[str]:
    settings = []
    for name, value in model.items():
        if name not in MODEL_WORDS:
            raise SettingError(f"config.model has no '{name}' that is understood here. {nearest(name, MODEL_WORDS)}")
        if name == "fcnet_hiddens":
            settings.append(f"network.hidden_units={','.join(map(str, value))}")
        elif name == "fcnet_activation":
            settings.append(f"network.activation={value}")
        elif name == "vf_share_layers":
            settings.append(f"network.separate_networks={str(not value).lower()}")
        else:
            said.append("model.free_log_std: the spread of continuous actions is always free of what is seen")
    return settings


def _stop(name: str, amount: Any) -> str:
    if name not in STOPS:
        raise SettingError(f"stop has no '{name}' that is understood here. {nearest(name, STOPS)}")
    value = float(amount) / 60.0 if name == "time_total_s" else float(amount)
    return f"{STOPS[name]}={value:.12g}"
