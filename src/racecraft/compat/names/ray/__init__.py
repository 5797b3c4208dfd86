"""`ray`, as launcher scripts of SageMaker RL import it: what they ask for, `sagemaker_rl` does."""

from __future__ import annotations

from typing import Any

from racecraft.compat.names.ray import tune
from racecraft.contract.arguments import require_arguments

INIT_ARGUMENTS = (
    "address", "num_cpus", "num_gpus", "resources", "labels", "object_store_memory", "local_mode",
    "ignore_reinit_error", "include_dashboard", "dashboard_host", "dashboard_port", "job_config",
    "configure_logging", "logging_level", "logging_format", "logging_config", "log_to_driver", "namespace",
    "runtime_env", "storage", "enable_resource_isolation", "cgroup_path", "system_reserved_cpu",
    "system_reserved_memory", "proxy_server_url", "redis_address", "redis_port", "redis_password",
    "redis_max_memory", "redis_max_clients", "redis_shard_ports", "num_redis_shards", "memory",
    "driver_object_store_memory", "plasma_directory", "huge_pages", "include_java", "include_webui", "webui_host",
    "use_pickle", "lru_evict", "load_code_from_local", "java_worker_options", "raylet_socket_name",
    "plasma_store_socket_name", "temp_dir", "node_ip_address", "object_id_seed", "driver_id", "job_id",
    "redirect_worker_output", "redirect_output", "enable_object_reconstruction",
)  # fmt: skip
"""What any Ray from 0.5 to 2.60 takes; on one machine nothing of it is needed."""


def init(address: str | None = None, **recorded: Any) -> None:
    """Begin nothing, for there is nothing to be begun on one machine.

    Raises:
        SettingError: An argument that no Ray has.
    """
    require_arguments("ray.init", recorded, INIT_ARGUMENTS)
    target = address or recorded.get("redis_address")
    if target not in (None, "local"):
        print(f"- ray.init: no cluster is joined at {target}; inside `racecraft run` all is done on this machine")


def shutdown(_exiting_interpreter: bool = False) -> None:
    """Nothing is to be ended."""


__all__ = ["init", "shutdown", "tune"]
