"""Hyperparameters of a SageMaker job: how they travel to a script, and which `rl.…` names mean something.

Overrides such as `rl.training.config.lr` change the experiment that a launcher script describes (facts:
battlesnake-and-sagemaker-rl.md C.5). A misspelt one would only be noticed after minutes, or never; so it is checked
when the estimator is made.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from racecraft.contract.errors import SettingError, nearest

PREFIX = "rl."
EXPERIMENT_WORDS = (
    "run", "env", "stop", "config", "checkpoint_freq", "checkpoint_at_end", "local_dir", "num_samples", "restore",
    "max_failures", "keep_checkpoints_num", "checkpoint_score_attr", "resources_per_trial", "verbose", "name",
    "loggers", "export_formats", "sync_config", "sync_function", "upload_dir", "trial_name_creator",
)  # fmt: skip
"""Words of one experiment, `rl.training.WORD`."""
STOP_WORDS = (
    "time_total_s", "timesteps_total", "episodes_total", "training_iteration", "episode_reward_mean",
    "episode_reward_max", "episode_reward_min", "episode_len_mean", "env_runners/episode_return_mean",
    "sampler_results/episode_reward_mean", "episode_return_mean", "num_env_steps_sampled",
    "num_env_steps_sampled_lifetime",
)  # fmt: skip
"""Words behind `rl.training.stop.`"""
CONFIG_WORDS = (
    "env", "env_config", "num_workers", "num_gpus", "num_gpus_per_worker", "num_cpus_per_worker",
    "num_cpus_for_driver", "num_envs_per_worker", "framework", "eager", "use_pytorch", "seed", "monitor", "log_level",
    "ignore_worker_failures", "gamma", "lambda", "lr", "lr_schedule", "kl_coeff", "kl_target", "clip_param",
    "vf_clip_param", "vf_loss_coeff", "vf_share_layers", "entropy_coeff", "entropy_coeff_schedule", "grad_clip",
    "num_sgd_iter", "sgd_minibatch_size", "train_batch_size", "sample_batch_size", "rollout_fragment_length",
    "batch_mode", "horizon", "soft_horizon", "clip_rewards", "clip_actions", "normalize_actions", "observation_filter",
    "use_gae", "use_critic", "shuffle_sequences", "simple_optimizer", "model", "multiagent", "evaluation_interval",
    "evaluation_num_episodes", "evaluation_config", "callbacks", "compress_observations", "no_done_at_end",
    "synchronize_filters", "tf_session_args", "buffer_size", "learning_starts", "prioritized_replay",
    "prioritized_replay_alpha", "prioritized_replay_beta", "prioritized_replay_eps", "target_network_update_freq",
    "n_step", "double_q", "dueling", "noisy", "num_atoms", "v_min", "v_max", "hiddens", "exploration_config",
    "exploration_fraction", "exploration_final_eps", "final_prioritized_replay_beta", "per_worker_exploration",
    "worker_side_prioritization", "min_iter_time_s", "timesteps_per_iteration", "optimizer", "adam_epsilon", "input",
    "output", "preprocessor_pref", "num_aggregation_workers", "create_env_on_driver", "vtrace", "broadcast_interval",
    "learner_queue_size", "schedule_max_timesteps", "beta_annealing_fraction", "lambda_", "num_epochs",
    "minibatch_size", "num_rollout_workers", "train_batch_size_per_learner", "num_env_runners",
    "num_envs_per_env_runner", "num_cpus_per_env_runner", "num_gpus_per_env_runner", "create_env_on_local_worker",
    "ignore_env_runner_failures", "framework_str", "num_steps_sampled_before_learning_starts",
    "min_time_s_per_iteration", "min_sample_timesteps_per_iteration", "log_sys_usage", "fake_sampler", "eager_tracing",
    "explore", "in_evaluation", "evaluation_num_workers", "custom_eval_function", "sample_async",
    "_use_trajectory_view_api", "local_tf_session_args", "collect_metrics_timeout", "metrics_smoothing_episodes",
    "remote_worker_envs", "remote_env_batch_wait_ms", "extra_python_environs_for_driver",
    "extra_python_environs_for_worker", "custom_resources_per_worker", "memory", "object_store_memory",
    "memory_per_worker", "object_store_memory_per_worker", "input_evaluation", "postprocess_inputs",
    "shuffle_buffer_size", "output_compress_columns", "output_max_file_size", "logger_config",
    "replay_sequence_length", "no_eager_on_workers", "_fake_gpus", "action_space", "observation_space", "render_env",
    "record_env", "evaluation_parallel_to_training", "use_kl_loss", "num_data_loader_buffers",
    "num_multi_gpu_tower_stacks", "minibatch_buffer_size", "replay_proportion", "replay_buffer_num_slots",
    "learner_queue_timeout", "max_sample_requests_in_flight_per_worker", "opt_type", "decay", "momentum", "epsilon",
    "vtrace_clip_rho_threshold", "vtrace_clip_pg_rho_threshold", "vtrace_drop_last_ts",
    "prioritized_replay_beta_annealing_timesteps", "training_intensity", "store_buffer_in_checkpoints", "sigma0",
    "before_learn_on_batch", "soft_q", "softmax_temp", "parameter_noise", "twin_q", "use_state_preprocessor", "policy",
    "tau", "initial_alpha", "target_entropy", "optimization", "Q_model", "policy_model", "_deterministic_loss",
    "_use_beta_distribution", "use_huber", "huber_threshold", "action_noise_std", "l2_coeff", "noise_stdev",
    "episodes_per_batch", "eval_prob", "return_proc_mode", "stepsize", "noise_size", "report_length",
)  # fmt: skip
"""Words of RLlib's configuration, `rl.training.config.WORD` (Ray 0.5 to 1.6, and what Ray 2 calls the same)."""
OWN_KEYS = (
    "sagemaker_program", "sagemaker_submit_directory", "sagemaker_job_name", "sagemaker_region",
    "sagemaker_container_log_level", "sagemaker_estimator",
)  # fmt: skip
"""What the SDK adds for its containers; a script is not told."""


def check_overrides(hyperparameters: Mapping[str, Any]) -> tuple[str, ...]:
    """Look at every `rl.…` name; return what is worth saying, a sentence each.

    Raises:
        SettingError: A name that no launcher would find; the nearest known one is told.

    >>> check_overrides({"rl.training.config.lr": 1e-4, "num_agents": 5})
    ()
    >>> check_overrides({"rl.training.config.num_sgd_itr": 3})
    Traceback (most recent call last):
    racecraft.contract.errors.SettingError: hyperparameter 'rl.training.config.num_sgd_itr': RLlib's configuration has \
no 'num_sgd_itr'. Did you mean 'num_sgd_iter'?
    """
    notes = []
    for name in hyperparameters:
        if not name.startswith(PREFIX):
            continue
        steps = name.removeprefix(PREFIX).split(".")
        if any("__" in step for step in steps):
            raise SettingError(
                "hyperparameter '{name}': names with '__' are refused, here as by the launcher.", name=name
            )
        if steps[0] != "training":
            continue  # Coach presets have names of their own: rl.agent_params.…
        if steps == ["training", "config", "num_cpus"]:
            notes.append(
                "rl.training.config.num_cpus means nothing to RLlib, though the AWS blog prints it; how many workers "
                "there are is rl.training.config.num_workers, and it is taken as that."
            )
            continue
        _require(name, steps, 1, EXPERIMENT_WORDS, "an experiment")
        if steps[1:2] == ["stop"]:
            _require(name, steps, 2, STOP_WORDS, "RLlib's stop")
        if steps[1:2] == ["config"]:
            _require(name, steps, 2, CONFIG_WORDS, "RLlib's configuration")
    return tuple(notes)


def as_arguments(hyperparameters: Mapping[str, Any]) -> list[str]:
    """Return the words a script is started with, as SageMaker's toolkit makes them.

    >>> as_arguments({"num_iters": 10, "e": 0.5, "greedy": True, "sagemaker_program": "x.py"})
    ['-e', '0.5', '--greedy', 'True', '--num_iters', '10']
    """
    words: list[str] = []
    for name in sorted(hyperparameters):
        if name not in OWN_KEYS:
            words += [f"-{name}" if len(name) == 1 else f"--{name}", _text(hyperparameters[name])]
    return words


def encoded(hyperparameters: Mapping[str, Any]) -> dict[str, str]:
    """Return hyperparameters as `hyperparameters.json` holds them: every value as JSON in a text.

    Raises:
        SettingError: A value that JSON cannot hold.
    """
    try:
        return {str(name): json.dumps(value) for name, value in hyperparameters.items()}
    except (TypeError, ValueError) as error:
        raise SettingError(
            "hyperparameters: {error}; expected numbers, words, lists and objects.", error=error
        ) from None


def decoded(hyperparameters: Mapping[str, str]) -> dict[str, Any]:
    """Return what `encoded` was given; a text that is no JSON stands for itself."""
    values: dict[str, Any] = {}
    for name, text in hyperparameters.items():
        try:
            values[name] = json.loads(text)
        except ValueError:
            values[name] = text
    return values


def _require(name: str, steps: list[str], at: int, known: tuple[str, ...], whose: str) -> None:
    if len(steps) <= at:
        raise SettingError(
            "hyperparameter '{name}' stops too early; expected a word behind it: {known}.",
            name=name,
            known=", ".join(known),
        )
    if steps[at] not in known:
        raise SettingError(
            "hyperparameter '{name}': {whose} has no '{steps}'. {hint}",
            name=name,
            whose=whose,
            steps=steps[at],
            hint=nearest(steps[at], known),
        )


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value) if isinstance(value, dict | list) else str(value)
