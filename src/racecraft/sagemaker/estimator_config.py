"""The words of SageMaker's `RLEstimator`: old names and new ones, toolkits and frameworks, and what is only recorded.

Facts: battlesnake-and-sagemaker-rl.md C.1.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from enum import Enum
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.formats.job_spec import EXPERIMENT_VARIABLES


class RLToolkit(Enum):
    """Toolkits that scripts were written for."""

    COACH = "coach"
    RAY = "ray"


class RLFramework(Enum):
    """Frameworks that scripts were written for."""

    TENSORFLOW = "tensorflow"
    MXNET = "mxnet"
    PYTORCH = "pytorch"


TOOLKIT_VERSIONS: Mapping[str, tuple[str, ...]] = {
    "coach": ("0.10.1", "0.10", "0.11.0", "0.11.1", "0.11", "1.0.0"),
    "ray": ("0.5.3", "0.5", "0.6.5", "0.6", "0.8.2", "0.8.5", "1.6.0"),
}
FIRST_NAMES: Mapping[str, str] = {
    "train_instance_count": "instance_count",
    "train_instance_type": "instance_type",
    "train_max_run": "max_run",
    "train_max_wait": "max_wait",
    "train_use_spot_instances": "use_spot_instances",
    "train_volume_size": "volume_size",
    "train_volume_kms_key": "volume_kms_key",
    "image_name": "image_uri",
}
"""Names of the SDK's first version, and what its second calls them."""
ONLY_RECORDED = (
    "role", "instance_count", "instance_type", "volume_size", "volume_kms_key", "input_mode", "output_path",
    "output_kms_key", "tags", "subnets", "security_group_ids", "model_uri", "model_channel_name",
    "encrypt_inter_container_traffic", "checkpoint_s3_uri", "checkpoint_local_path", "enable_network_isolation",
    "instance_groups", "keep_alive_period_in_seconds", "code_location", "git_config", "sagemaker_session",
    "container_log_level", "py_version", "debugger_hook_config", "rules", "enable_sagemaker_metrics",
    "profiler_config", "disable_profiler", "max_retry_attempts",
)  # fmt: skip
"""Words that are accepted and written down; on one machine they change nothing."""
DEPLOY_ARGUMENTS = (
    "accelerator_type", "use_compiled_model", "model_name", "kms_key", "data_capture_config", "tags", "volume_size",
    "async_inference_config", "serverless_inference_config", "model_data_download_timeout", "explainer_config",
    "container_startup_health_check_timeout", "inference_recommendation_id", "update_endpoint", "role", "image",
    "image_uri", "entry_point", "source_dir", "dependencies", "code_location", "model_server_workers", "env", "name",
    "enable_network_isolation", "predictor_cls", "vpc_config", "vpc_config_override", "container_log_level",
    "framework_version", "py_version", "managed_instance_scaling", "inference_component_name", "routing_config",
    "resources", "endpoint_type", "endpoint_logging", "accept_eula", "model_reference_arn",
)  # fmt: skip
"""What any version of the SDK's `deploy` takes beside ours; written down nowhere, for a policy is served as it is."""
MODEL_ARGUMENTS = (
    "image", "image_uri", "entry_point", "source_dir", "dependencies", "framework_version", "py_version", "env",
    "container_log_level", "predictor_cls", "vpc_config", "sagemaker_session", "code_location", "git_config",
    "model_kms_key", "enable_network_isolation", "image_config", "model_server_workers",
)  # fmt: skip
"""The same of its models."""
ANALYTICS_ARGUMENTS = ("sagemaker_session", "start_time", "end_time", "period")
PREDICT_ARGUMENTS = ("target_model", "target_variant", "inference_id", "custom_attributes", "component_name")
SESSION_ARGUMENTS = (
    "sagemaker_client", "sagemaker_runtime_client", "sagemaker_featurestore_runtime_client", "settings",
    "sagemaker_metrics_client", "sagemaker_config", "default_bucket_prefix",
)  # fmt: skip
TUNER_ARGUMENTS = (
    "tags", "completion_criteria_config", "strategy_config", "estimator_name", "autotune",
    "max_runtime_in_seconds", "hyperparameters_to_keep_static", "training_input_mode",
)  # fmt: skip
FLOAT = r"[-+]?[0-9]*[.]?[0-9]+(?:[eE][-+]?[0-9]+)?"


class ImageMissingError(SettingError, AttributeError):
    """Nothing says what a script was written for; at SageMaker it is an AttributeError."""


def second_names(words: Mapping[str, Any]) -> dict[str, Any]:
    """Return an estimator's words in the SDK's second spelling.

    Raises:
        SettingError: Both spellings of one word are given.
    """
    renamed: dict[str, Any] = {}
    given: dict[str, str] = {}
    for name, value in words.items():
        new = FIRST_NAMES.get(name, name)
        if new in given:
            raise SettingError(
                "RLEstimator: {given} and {name} are one word; give it once.", given=given[new], name=name
            )
        renamed[new], given[new] = value, name
    return renamed


def require_known(words: Mapping[str, Any], known: tuple[str, ...]) -> None:
    """Refuse words that no version of the SDK has.

    Raises:
        SettingError: An unknown word; the nearest known one is told.
    """
    for name in words:
        if name not in known:
            raise SettingError(
                "RLEstimator has no '{name}'. {hint}", name=name, hint=nearest(name, [*known, *FIRST_NAMES])
            )


def check_image(image_uri: Any, toolkit: Any, version: Any, framework: Any) -> dict[str, Any]:
    """Return which image a script was written for; it is recorded, no image is run.

    Raises:
        ImageMissingError: Neither an image nor all of toolkit, toolkit_version and framework.
        SettingError: There is no such toolkit, version or framework.
    """
    parts = {"toolkit": _word(toolkit), "toolkit_version": version, "framework": _word(framework)}
    if image_uri is not None:
        if any(value is not None for value in parts.values()):
            warnings.warn("image_uri is given, so toolkit, toolkit_version and framework are passed over", stacklevel=3)
        return {"image_uri": image_uri}
    missing = [name for name, value in parts.items() if value is None]
    if missing:
        raise ImageMissingError(
            "RLEstimator: {missing} missing; expected them all, or image_uri.", missing=", ".join(missing)
        )
    for name, known in (("toolkit", RLToolkit), ("framework", RLFramework)):
        values = [str(one.value) for one in known]
        if parts[name] not in values:
            raise SettingError(
                "RLEstimator: there is no {name} '{told}'. {hint}",
                name=name,
                told=parts[name],
                hint=nearest(parts[name], values),
            )
    versions = TOOLKIT_VERSIONS[parts["toolkit"]]
    if version not in versions:
        raise SettingError(
            "RLEstimator: there was no {told} {version} at SageMaker; expected {versions}.",
            told=parts["toolkit"],
            version=version,
            versions=", ".join(versions),
        )
    return parts


def default_metric_definitions(toolkit: RLToolkit | str) -> list[dict[str, str]]:
    """Return the metrics that a toolkit's log is searched for.

    Raises:
        SettingError: There is no such toolkit.
    """
    name = _word(toolkit)
    if name == RLToolkit.COACH.value:
        return [
            {"Name": "reward-training", "Regex": "(?m)^Training>.*Total reward=(.*?),"},
            {"Name": "reward-testing", "Regex": "(?m)^Testing>.*Total reward=(.*?),"},
        ]
    if name == RLToolkit.RAY.value:
        return [
            {"Name": metric, "Regex": f"{metric}: ({FLOAT})"}
            for metric in ("episode_reward_mean", "episode_reward_max")
        ]
    raise SettingError("There is no toolkit '{name}'. {hint}", name=name, hint=nearest(str(name), ["coach", "ray"]))


def _word(value: Any) -> Any:
    return value.value if isinstance(value, Enum) else value


def experiment_variables(experiment: Mapping[str, str] | None) -> dict[str, str]:
    """Return how a job's training hears of `experiment_config`; words that SageMaker does not know are left out.

    >>> experiment_variables({"TrialName": "snakes-1"})
    {'RACECRAFT_TRIAL': 'snakes-1'}
    """
    given = experiment or {}
    return {variable: str(given[key]) for key, variable in EXPERIMENT_VARIABLES.items() if given.get(key)}
