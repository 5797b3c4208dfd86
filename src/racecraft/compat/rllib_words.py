"""RLlib's words for PPO, APPO, DQN, Ape-X, SAC and ES, in ours. Begin with `words_of`; docs and launcher read it.

The tables speak as Ray 0.5 to 1.6 did, when scripts were written; `LATER_NAMES` has what Ray 2 calls the same.

Three kinds of word: it has a setting of ours; it is taken into account in another way; it has no meaning here, and the
launcher says why where a script gives it another value than RLlib's default. A word without an entry passes at RLlib's
default value and is refused otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

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
    "horizon": ConfigKey(ELSEWHERE, "ticks after which an episode is cut; None: the environment's own limit, or none"),
    "model": ConfigKey(ELSEWHERE, "see the table of its words"),
    "multiagent": ConfigKey(ELSEWHERE, "see the table of its words"),
    "callbacks": ConfigKey(ELSEWHERE, "see the table of its words"),
    **dict.fromkeys(
        ("evaluation_interval", "evaluation_num_episodes", "evaluation_num_workers", "evaluation_config",
         "in_evaluation", "evaluation_parallel_to_training"),
        ConfigKey("", "a run is evaluated by the settings of `evaluation`"),
    ),
    **dict.fromkeys(
        ("memory", "object_store_memory", "memory_per_worker", "object_store_memory_per_worker",
         "custom_resources_per_worker", "remote_worker_envs", "remote_env_batch_wait_ms", "sample_async",
         "collect_metrics_timeout", "extra_python_environs_for_driver", "extra_python_environs_for_worker"),
        ConfigKey("", "worlds and learner share the job's cores and memory"),
    ),
    **dict.fromkeys(
        ("tf_session_args", "local_tf_session_args", "eager_tracing", "no_eager_on_workers", "_fake_gpus"),
        ConfigKey("", "it is PyTorch"),
    ),
    **dict.fromkeys(
        ("log_sys_usage", "logger_config", "metrics_smoothing_episodes"),
        ConfigKey("", "an iteration tells of the episodes that ended in it"),
    ),
    "normalize_actions": ConfigKey("", "actions are always scaled to their bounds"),
    "synchronize_filters": ConfigKey("", "there is no filter beside network.normalise"),
    "_use_trajectory_view_api": ConfigKey("", "it changes nothing that is learned"),
    "use_critic": ConfigKey("", "there is always a critic"),
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
    "observation_filter": ConfigKey("", "observations are as the environment gives them; network.normalise evens them"),
    "clip_rewards": ConfigKey("", "rewards are learned from as they are"),
    "clip_actions": ConfigKey("", "actions are always kept inside the space"),
    "simple_optimizer": ConfigKey("", "there is one optimiser"),
}  # fmt: skip
"""Every word of a configuration that is understood."""
OF_PPO = (
    "lambda", "num_sgd_iter", "sgd_minibatch_size", "clip_param", "entropy_coeff", "vf_loss_coeff", "kl_coeff",
    "kl_target", "vf_clip_param", "vf_share_layers", "vtrace", "broadcast_interval", "learner_queue_size", "use_gae",
    "shuffle_sequences", "simple_optimizer", "use_critic",
)  # fmt: skip
"""Words that DQN, Ape-X, SAC and ES do not know."""
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
    "rollout_fragment_length": ConfigKey(ELSEWHERE, "rollout.horizon; DQN learns once in as many ticks of all worlds "
                                         "(dqn.train_every), Ape-X once in 16 steps (apex.train_every)"),
    "sample_batch_size": ConfigKey(ELSEWHERE, "the same (Ray before 0.8.4)"),
    "target_network_update_freq": ConfigKey(ELSEWHERE, "dqn.target_every: over the steps between two of learning"),
    "exploration_config": ConfigKey(ELSEWHERE, "initial_epsilon, final_epsilon, epsilon_timesteps: dqn.epsilon_first, "
                               "epsilon_last, epsilon_steps"),
    "exploration_final_eps": ConfigKey("dqn.epsilon_last"),
    "schedule_max_timesteps": ConfigKey(ELSEWHERE, "steps of which the two fractions are parts; 100,000 unless said"),
    "exploration_fraction": ConfigKey(ELSEWHERE, "dqn.epsilon_steps = exploration_fraction x schedule_max_timesteps"),
    "beta_annealing_fraction": ConfigKey(ELSEWHERE, "replay.importance_steps, likewise"),
    "prioritized_replay_beta_annealing_timesteps": ConfigKey(ELSEWHERE, "the same, in steps"),
    "final_prioritized_replay_beta": ConfigKey(ELSEWHERE, "where it ends: as it begins, it stays; else the slope goes "
                                               "on to 1"),
    "num_atoms": ConfigKey(ELSEWHERE, "1; with more a value would be a distribution (C51), which is refused"),
    "noisy": ConfigKey(ELSEWHERE, "false; noise within the network is refused"),
    "v_min": ConfigKey("", "a value is its mean, and no range is cut into atoms"),
    "v_max": ConfigKey("", "a value is its mean, and no range is cut into atoms"),
    "hiddens": ConfigKey(ELSEWHERE, "layers behind those of the model, with network.hidden_units"),
    "prioritized_replay_eps": ConfigKey("", "what is added to an error is fixed"),
    "per_worker_exploration": ConfigKey("", "Ape-X's worlds always explore each in their own degree, DQN's all alike"),
    "worker_side_prioritization": ConfigKey("", "Ape-X's actors always note what they expected"),
    "num_aggregation_workers": ConfigKey("", "there is one memory"),
    "compress_observations": ConfigKey("", "what is remembered is kept once, in the environment's own types"),
    "timesteps_per_iteration": ConfigKey(ELSEWHERE, "an iteration, as told and as stops count, has as many steps"),
    "min_iter_time_s": ConfigKey("", "an iteration ends with its steps"),
    "store_buffer_in_checkpoints": ConfigKey("", "replay.keep_mib says how large a memory is kept"),
}  # fmt: skip
"""Likewise, of DQN and Ape-X; where a setting begins with dqn., Ape-X's begins with apex."""
OF_VALUES_ALONE = (
    "lr", "double_q", "dueling", "adam_epsilon", "num_atoms", "noisy", "v_min", "v_max", "hiddens",
    "exploration_config", "exploration_final_eps", "schedule_max_timesteps", "exploration_fraction",
    "per_worker_exploration", "num_aggregation_workers", "grad_clip",
)  # fmt: skip
"""Words of DQN's that SAC does not know."""
SAC_WORDS: Mapping[str, ConfigKey] = {
    **{name: word for name, word in VALUE_WORDS.items() if name not in OF_VALUES_ALONE},
    "gamma": ConfigKey("sac.discount"),
    "n_step": ConfigKey("sac.n_step"),
    "train_batch_size": ConfigKey("sac.batch_size"),
    "tau": ConfigKey("sac.target_rate"),
    "initial_alpha": ConfigKey("sac.initial_temperature"),
    "target_entropy": ConfigKey(ELSEWHERE, "sac.target_entropy; auto: one nat less than nothing for each number"),
    "optimization": ConfigKey(ELSEWHERE, "sac.learning_rate; its three rates must be one"),
    "model": ConfigKey("", "layers are those of policy_model"),
    "policy_model": ConfigKey(ELSEWHERE, "as `model` elsewhere, for the policy and the critics"),
    "Q_model": ConfigKey(ELSEWHERE, "must be as policy_model"),
    "target_network_update_freq": ConfigKey(ELSEWHERE, "sac.target_interval: over the steps between two of learning"),
    "rollout_fragment_length": ConfigKey(
        ELSEWHERE, "sac.gradient_steps_per_step is one over the steps of all worlds in it"
    ),
}
ES_WORDS: Mapping[str, ConfigKey] = {
    **{name: word for name, word in WORDS.items() if name not in (*OF_PPO, "gamma", "lr", "grad_clip")},
    "stepsize": ConfigKey("es.learning_rate"),
    "noise_stdev": ConfigKey("es.noise"),
    "l2_coeff": ConfigKey(ELSEWHERE, "es.weight_decay = l2_coeff / noise_stdev: RLlib's gradient is smaller by that"),
    "episodes_per_batch": ConfigKey(ELSEWHERE, "rollout.num_worlds and episodes_per_iteration: members of the "
                                    "population, a world and a whole episode each"),
    "num_workers": ConfigKey("", "every member of the population has a world"),
    "num_envs_per_worker": ConfigKey("", "every member of the population has a world"),
    "train_batch_size": ConfigKey("", "an iteration is episodes_per_batch episodes, however long"),
    "gamma": ConfigKey("", "a member counts by the sum of its rewards"),
    "action_noise_std": ConfigKey("", "actions are without noise; the weights have it"),
    "observation_filter": ConfigKey("", "observations are seen as the environment gives them"),
    "eval_prob": ConfigKey("", "a run is evaluated by the settings of `evaluation`"),
    "noise_size": ConfigKey("", "noise is computed where it is needed, not kept in a table"),
    "report_length": ConfigKey("", "an iteration tells of the episodes that ended in it"),
}  # fmt: skip
TABLES: Mapping[str, Mapping[str, ConfigKey]] = {"ppo": WORDS, "sac": SAC_WORDS, "es": ES_WORDS}
"""The table of each algorithm of ours but DQN and Ape-X."""
RUNS: Mapping[str, tuple[str, ...]] = {
    "PPO": ("ppo.adam_epsilon=1e-08", "ppo.standardise=rollout"),
    "APPO": ("ppo.asynchronous=true", "ppo.adam_epsilon=1e-08", "ppo.standardise=none"),
    "DQN": ("dqn.optimiser=adam",),
    "APEX": ("apex.optimiser=adam",),
    "SAC": (),
    "ES": ("es.optimiser=adam",),
}
"""RLlib's algorithms that are understood, with what they do that no word of theirs says."""
ALGORITHMS = {"PPO": "ppo", "APPO": "ppo", "DQN": "dqn", "APEX": "apex", "SAC": "sac", "ES": "es"}
"""What each of them is called here."""
WITH_REPLAY = ("DQN", "APEX", "SAC")
UNFOLLOWED: Mapping[str, tuple[str, ...]] = {
    "PPO": ("kl_coeff", "vf_clip_param"),
    "ES": ("action_noise_std", "observation_filter"),
}
"""Words that RLlib follows where a script does not give them, and that have no meaning here; always said."""
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
    "checkpoint_freq": "nothing: weights of 200 iterations, evenly spread, are kept (runtime.keep_count)",
    "checkpoint_at_end": "nothing: the last is always kept",
    "keep_checkpoints_num": "nothing: weights of 200 iterations, evenly spread, are kept (runtime.keep_count)",
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
SHORTEST_ROLLOUT = 16
"""Ticks of all worlds together; SAC's fragment of one would cost more than its step of learning."""
JUDGED_EPISODES = 4
"""Episodes of one evaluation, each in an environment of its own: scripts' environments may be whole programs."""
MODEL_WORDS: Mapping[str, str] = {
    "fcnet_hiddens": "network.hidden_units; 256, 256 unless said",
    "fcnet_activation": "network.activation",
    "vf_share_layers": "network.separate_networks, turned round",
    "conv_filters": "network.conv_filters, conv_kernels and conv_strides; no padding; our own unless said",
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
    "count_steps_by": "env_steps: a step is a tick of an environment; agent_steps: one agent's",
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


def words_of(algorithm: str) -> Mapping[str, ConfigKey]:
    """Return every word of a configuration that is understood with an algorithm of ours, with its settings.

    >>> words_of("apex")["gamma"].setting
    'apex.discount'
    """
    if algorithm in TABLES:
        return TABLES[algorithm]
    return {
        name: replace(word, setting=word.setting.replace("dqn.", f"{algorithm}."))
        if algorithm == "dqn" or name not in OF_DQN
        else ConfigKey("", "Ape-X's worlds explore each in their own degree")
        for name, word in VALUE_WORDS.items()
    }
