"""What RLlib does where a script says nothing. Begin with `defaults_of`.

Source: RLlib's default configurations of Ray 0.8.5 to 1.6, the versions in SageMaker's images. Where these differ, the
value is that of Ray 1.0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

DEPRECATED = -1
"""What Ray writes into a key that it renamed."""
RENAMED = (
    "use_pytorch", "eager", "monitor", "sample_batch_size", "use_state_preprocessor", "simple_optimizer",
    "vf_share_layers", "buffer_size", "learning_starts", "min_iter_time_s", "timesteps_per_iteration",
    "num_data_loader_buffers", "evaluation_num_episodes", "prioritized_replay", "model.lstm_use_prev_action_reward",
)  # fmt: skip
"""Keys in which that value stands in some version."""

COMMON: Mapping[str, Any] = {
    "num_workers": 2, "num_envs_per_worker": 1, "rollout_fragment_length": 200, "batch_mode": "truncate_episodes",
    "num_gpus": 0, "train_batch_size": 200, "model": {}, "optimizer": {}, "gamma": 0.99, "horizon": None,
    "soft_horizon": False, "no_done_at_end": False, "env_config": {}, "env": None, "normalize_actions": False,
    "clip_rewards": None, "clip_actions": True, "preprocessor_pref": "deepmind", "lr": 1e-4, "monitor": False,
    "log_level": "WARN", "callbacks": None, "ignore_worker_failures": False, "log_sys_usage": True,
    "fake_sampler": False, "framework": "tf", "eager_tracing": False, "explore": True,
    "exploration_config": {"type": "StochasticSampling"}, "evaluation_interval": None, "evaluation_num_episodes": 10,
    "in_evaluation": False, "evaluation_config": {}, "evaluation_num_workers": 0, "custom_eval_function": None,
    "sample_async": False, "_use_trajectory_view_api": True, "observation_filter": "NoFilter",
    "synchronize_filters": True,
    "tf_session_args": {
        "intra_op_parallelism_threads": 2, "inter_op_parallelism_threads": 2, "gpu_options": {"allow_growth": True},
        "log_device_placement": False, "device_count": {"CPU": 1}, "allow_soft_placement": True,
    },
    "local_tf_session_args": {"intra_op_parallelism_threads": 8, "inter_op_parallelism_threads": 8},
    "compress_observations": False, "collect_metrics_timeout": 180, "metrics_smoothing_episodes": 100,
    "remote_worker_envs": False, "remote_env_batch_wait_ms": 0, "min_iter_time_s": 0, "timesteps_per_iteration": 0,
    "seed": None, "extra_python_environs_for_driver": {}, "extra_python_environs_for_worker": {},
    "num_cpus_per_worker": 1, "num_gpus_per_worker": 0, "custom_resources_per_worker": {}, "num_cpus_for_driver": 1,
    "memory": 0, "object_store_memory": 0, "memory_per_worker": 0, "object_store_memory_per_worker": 0,
    "input": "sampler", "input_evaluation": ["is", "wis"], "postprocess_inputs": False, "shuffle_buffer_size": 0,
    "output": None, "output_compress_columns": ["obs", "new_obs"], "output_max_file_size": 67108864,
    "multiagent": {}, "logger_config": None, "replay_sequence_length": 1, "use_pytorch": False, "eager": False,
    "no_eager_on_workers": False, "_fake_gpus": False, "create_env_on_driver": False, "action_space": None,
    "observation_space": None, "render_env": False, "record_env": False, "evaluation_parallel_to_training": False,
}  # fmt: skip
"""Of every algorithm."""
PPO: Mapping[str, Any] = {
    "use_critic": True, "use_gae": True, "lambda": 1.0, "kl_coeff": 0.2, "train_batch_size": 4000,
    "sgd_minibatch_size": 128, "shuffle_sequences": True, "num_sgd_iter": 30, "lr": 5e-5, "lr_schedule": None,
    "vf_share_layers": False, "vf_loss_coeff": 1.0, "entropy_coeff": 0.0, "entropy_coeff_schedule": None,
    "clip_param": 0.3, "vf_clip_param": 10.0, "grad_clip": None, "kl_target": 0.01, "simple_optimizer": False,
}  # fmt: skip
APPO: Mapping[str, Any] = {
    "vtrace": True, "use_critic": True, "use_gae": True, "lambda": 1.0, "clip_param": 0.4, "use_kl_loss": False,
    "kl_coeff": 1.0, "kl_target": 0.01, "rollout_fragment_length": 50, "train_batch_size": 500, "min_iter_time_s": 10,
    "num_data_loader_buffers": 1, "num_multi_gpu_tower_stacks": 1, "minibatch_buffer_size": 1, "num_sgd_iter": 1,
    "replay_proportion": 0.0, "replay_buffer_num_slots": 100, "learner_queue_size": 16, "learner_queue_timeout": 300,
    "max_sample_requests_in_flight_per_worker": 2, "broadcast_interval": 1, "grad_clip": 40.0, "opt_type": "adam",
    "lr": 5e-4, "lr_schedule": None, "decay": 0.99, "momentum": 0.0, "epsilon": 0.1, "vf_loss_coeff": 0.5,
    "entropy_coeff": 0.01, "entropy_coeff_schedule": None, "vtrace_clip_rho_threshold": 1.0,
    "vtrace_clip_pg_rho_threshold": 1.0, "num_aggregation_workers": 0, "vtrace_drop_last_ts": True,
    "vf_share_layers": True,
}  # fmt: skip
REPLAY: Mapping[str, Any] = {
    "n_step": 1, "prioritized_replay_alpha": 0.6, "prioritized_replay_beta": 0.4, "prioritized_replay_eps": 1e-6,
    "final_prioritized_replay_beta": 0.4, "prioritized_replay_beta_annealing_timesteps": 20_000,
    "training_intensity": None, "num_workers": 0, "worker_side_prioritization": False, "min_iter_time_s": 1,
    "store_buffer_in_checkpoints": False,
}  # fmt: skip
"""Of every algorithm with a replay."""
DQN: Mapping[str, Any] = {
    **REPLAY,
    "num_atoms": 1, "v_min": -10.0, "v_max": 10.0, "noisy": False, "sigma0": 0.5, "dueling": True, "hiddens": [256],
    "double_q": True, "timesteps_per_iteration": 1000, "target_network_update_freq": 500, "buffer_size": 50_000,
    "prioritized_replay": True, "before_learn_on_batch": None, "lr": 5e-4, "lr_schedule": None, "adam_epsilon": 1e-8,
    "grad_clip": 40, "learning_starts": 1000, "rollout_fragment_length": 4, "train_batch_size": 32,
    "exploration_config": {
        "type": "EpsilonGreedy", "initial_epsilon": 1.0, "final_epsilon": 0.02, "epsilon_timesteps": 10_000,
    },
    "evaluation_config": {"explore": False}, "soft_q": False, "softmax_temp": 1.0, "parameter_noise": False,
    "per_worker_exploration": False,
}  # fmt: skip
APEX: Mapping[str, Any] = {
    **DQN,
    "optimizer": {"max_weight_sync_delay": 400, "num_replay_buffer_shards": 4, "debug": False}, "n_step": 3,
    "num_gpus": 1, "num_workers": 32, "buffer_size": 2_000_000, "learning_starts": 50_000, "train_batch_size": 512,
    "rollout_fragment_length": 50, "target_network_update_freq": 500_000, "timesteps_per_iteration": 25_000,
    "exploration_config": {"type": "PerWorkerEpsilonGreedy"}, "worker_side_prioritization": True,
    "min_iter_time_s": 30, "per_worker_exploration": True,
}  # fmt: skip
SAC: Mapping[str, Any] = {
    **REPLAY,
    "twin_q": True, "use_state_preprocessor": False, "policy": "GaussianLatentSpacePolicy", "clip_actions": False,
    "normalize_actions": True, "tau": 5e-3, "initial_alpha": 1.0, "target_entropy": "auto",
    "timesteps_per_iteration": 100, "buffer_size": 1_000_000, "prioritized_replay": False, "grad_clip": None,
    "optimization": {"actor_learning_rate": 3e-4, "critic_learning_rate": 3e-4, "entropy_learning_rate": 3e-4},
    "learning_starts": 1500, "rollout_fragment_length": 1, "train_batch_size": 256, "target_network_update_freq": 0,
    "Q_model": {"fcnet_activation": "relu", "fcnet_hiddens": [256, 256]},
    "policy_model": {"fcnet_activation": "relu", "fcnet_hiddens": [256, 256]},
    "evaluation_config": {"explore": False}, "_deterministic_loss": False, "_use_beta_distribution": False,
    "use_huber": False, "huber_threshold": 1.0,
}  # fmt: skip
ES: Mapping[str, Any] = {
    "action_noise_std": 0.01, "l2_coeff": 0.005, "noise_stdev": 0.02, "episodes_per_batch": 1000,
    "train_batch_size": 10_000, "eval_prob": 0.003, "return_proc_mode": "centered_rank", "num_workers": 10,
    "stepsize": 0.01, "observation_filter": "MeanStdFilter", "noise_size": 250_000_000, "report_length": 10,
}  # fmt: skip
RUNS: Mapping[str, Mapping[str, Any]] = {"PPO": PPO, "APPO": APPO, "DQN": DQN, "APEX": APEX, "SAC": SAC, "ES": ES}
"""What each algorithm has otherwise, or beside the common keys."""

MODEL: Mapping[str, Any] = {
    "fcnet_hiddens": [256, 256], "fcnet_activation": "tanh", "conv_filters": None, "conv_activation": "relu",
    "free_log_std": False, "no_final_linear": False, "vf_share_layers": True, "use_lstm": False, "max_seq_len": 20,
    "lstm_cell_size": 256, "lstm_use_prev_action_reward": False, "lstm_use_prev_action": False,
    "lstm_use_prev_reward": False, "_time_major": False, "state_shape": None, "framestack": True, "dim": 84,
    "grayscale": False, "zero_mean": True, "custom_model": None, "custom_model_config": {}, "custom_options": {},
    "custom_action_dist": None, "custom_preprocessor": None, "post_fcnet_hiddens": [], "post_fcnet_activation": "relu",
    "use_attention": False, "attention_num_transformer_units": 1, "attention_dim": 64, "attention_num_heads": 1,
    "attention_head_dim": 32, "attention_memory_inference": 50, "attention_memory_training": 50,
    "attention_position_wise_mlp_dim": 32, "attention_init_gru_gate_bias": 2.0, "attention_use_n_prev_actions": 0,
    "attention_use_n_prev_rewards": 0, "num_framestacks": "auto", "_use_default_native_models": False,
    "_disable_preprocessor_api": False, "_disable_action_flattening": False,
}  # fmt: skip
"""Of `model`."""
MULTIAGENT: Mapping[str, Any] = {
    "policies": {}, "policy_mapping_fn": None, "policies_to_train": None, "observation_fn": None,
    "replay_mode": "independent", "count_steps_by": "env_steps", "policy_map_capacity": 100, "policy_map_cache": None,
}  # fmt: skip
"""Of `multiagent`."""


def defaults_of(run: str) -> dict[str, Any]:
    """Return every key of an algorithm of RLlib's, with the value that it has where a script says nothing.

    >>> defaults_of("PPO")["lr"], defaults_of("DQN")["gamma"]
    (5e-05, 0.99)
    """
    return {**COMMON, **RUNS[run]}


def is_default(name: str, value: Any, defaults: Mapping[str, Any]) -> bool:
    """Tell whether a key has the value that it has where a script says nothing; part by part where it has parts.

    >>> is_default("hiddens", (256,), {"hiddens": [256]}), is_default("lr", 1e-3, {"lr": 1e-4})
    (True, False)
    """
    if name in RENAMED and _plain(value) == DEPRECATED and not isinstance(value, bool):
        return True
    if name not in defaults:
        return False
    default = defaults[name]
    if isinstance(default, Mapping) and isinstance(value, Mapping):
        known = MODEL if name == "model" else MULTIAGENT if name == "multiagent" else default
        return all(is_default(part, one, known) for part, one in value.items())
    try:
        return bool(_plain(value) == _plain(default))
    except Exception:  # a value of the script's own may compare as it likes
        return False


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
