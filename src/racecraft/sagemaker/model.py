"""`sagemaker.model.Model`: a job's model behind HTTP; what serves it is ours, whatever the framework was."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from racecraft.contract.arguments import names_of, require_arguments
from racecraft.jobs.job_paths import JobPaths
from racecraft.sagemaker.container import local_path
from racecraft.sagemaker.endpoint import EndpointError, Predictor, deploy, trained_run_in, unpacked_model
from racecraft.sagemaker.estimator_config import DEPLOY_ARGUMENTS, MODEL_ARGUMENTS
from racecraft.sagemaker.model_code import model_code
from racecraft.sagemaker.session import buckets_of

NAME = "model"


class Model:
    """What a job left in its model.

    Args:
        model_data: Its model.tar.gz: a path, file://…, or s3://bucket/… among the folders that stand for buckets.
        role: Recorded.
        name: Of its endpoint, where deploy names none.
        recorded: Of `entry_point` the functions serve the model (`serving/model_functions.py`), with what lies in
            `source_dir` and `dependencies` and the variables of `env`; framework_version and others change nothing.

    Raises:
        SettingError: `entry_point` serves by functions that no endpoint here would call.
    """

    def __init__(
        self, model_data: str | Path, role: str | None = None, name: str | None = None, **recorded: Any
    ) -> None:
        require_arguments(type(self).__name__, recorded, (*MODEL_ARGUMENTS, "model_data", "role", "name"))
        self.model_data, self.name = str(model_data), name
        self._code = model_code(recorded)

    def deploy(
        self,
        initial_instance_count: int = 1,
        instance_type: str = "local",
        serializer: Any = None,
        deserializer: Any = None,
        endpoint_name: str | None = None,
        wait: bool = True,
        policy: str = "",
        trust_model: bool = False,
        **recorded: Any,
    ) -> Predictor:
        """Put the policy that was trained, or what the model's own functions make of it, behind HTTP; return who asks.

        `trust_model` gives such functions all rights of this account; without it their process is limited.

        Raises:
            EndpointError: Nothing that racecraft trained lies in the model, or its functions cannot be loaded.
            NameTakenError: There is an endpoint, or a job, of that name.
            SettingError: An argument that no version of the SDK has.
        """
        require_arguments("deploy", recorded, (*DEPLOY_ARGUMENTS, *names_of(self.deploy)))
        home = JobPaths.of_user()
        archive = local_path(self.model_data, buckets_of(home))
        if not archive.is_file():
            raise EndpointError(
                "model_data is {address}, and there is no {archive}; expected a job's model.tar.gz. "
                "Session().upload_data puts a file into a bucket's folder.",
                address=self.model_data,
                archive=archive,
            )
        model = unpacked_model(archive)
        served = model if self._code else trained_run_in(model)
        name = endpoint_name or self.name or f"{NAME}-{time.strftime('%Y-%m-%d-%H-%M-%S')}"
        return deploy(home, served, name, serializer, deserializer, wait, policy, self._code, trust_model)


__all__ = ["Model"]
