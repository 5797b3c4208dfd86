"""`sagemaker.tensorflow.model`: a job's model behind HTTP; what serves it is ours, whatever the framework was."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from racecraft.contract.arguments import names_of, require_arguments
from racecraft.jobs.job_paths import JobPaths
from racecraft.sagemaker.endpoint import Predictor, deploy, trained_run_in, unpacked_model
from racecraft.sagemaker.estimator_config import DEPLOY_ARGUMENTS, MODEL_ARGUMENTS

NAME = "model"


class TensorFlowModel:
    """What a job left in its model.

    Args:
        model_data: The estimator's `model_data`.
        name: Of its endpoint, where deploy names none.
        recorded: Role, framework_version, entry_point and others; what serves a policy here needs none of them.
    """

    def __init__(self, model_data: str, role: str | None = None, name: str | None = None, **recorded: Any) -> None:
        require_arguments("TensorFlowModel", recorded, (*MODEL_ARGUMENTS, "model_data", "role", "name"))
        self.model_data, self.name = model_data, name

    def deploy(
        self,
        initial_instance_count: int = 1,
        instance_type: str = "local",
        serializer: Any = None,
        deserializer: Any = None,
        endpoint_name: str | None = None,
        wait: bool = True,
        policy: str = "",
        **recorded: Any,
    ) -> Predictor:
        """Put the policy that was trained behind HTTP; return who asks it.

        Raises:
            EndpointError: Nothing that racecraft trained lies in the model, or the name is taken.
            SettingError: An argument that no version of the SDK has.
        """
        require_arguments("deploy", recorded, (*DEPLOY_ARGUMENTS, *names_of(self.deploy)))
        run = trained_run_in(unpacked_model(Path(self.model_data.removeprefix("file://"))))
        name = endpoint_name or self.name or f"{NAME}-{time.strftime('%Y-%m-%d-%H-%M-%S')}"
        return deploy(JobPaths.of_user(), run, name, serializer, deserializer, wait, policy)


__all__ = ["TensorFlowModel"]
