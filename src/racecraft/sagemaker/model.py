"""`sagemaker.model.Model`: a job's model behind HTTP; what serves it is ours, whatever the framework was."""

from __future__ import annotations

import ast
import time
from pathlib import Path
from typing import Any

from racecraft.contract.arguments import names_of, require_arguments
from racecraft.contract.errors import SettingError
from racecraft.jobs.job_paths import JobPaths
from racecraft.sagemaker.container import local_path
from racecraft.sagemaker.endpoint import EndpointError, Predictor, deploy, trained_run_in, unpacked_model
from racecraft.sagemaker.estimator_config import DEPLOY_ARGUMENTS, MODEL_ARGUMENTS
from racecraft.sagemaker.session import buckets_of

NAME = "model"
HANDLERS = ("model_fn", "input_fn", "predict_fn", "output_fn", "transform_fn", "input_handler", "output_handler")
"""Functions by which a file of one's own serves a model."""


class Model:
    """What a job left in its model.

    Args:
        model_data: Its model.tar.gz: a path, file://…, or s3://bucket/… among the folders that stand for buckets.
        role: Recorded.
        name: Of its endpoint, where deploy names none.
        recorded: framework_version, env and others; what serves a policy here needs none of them.

    Raises:
        SettingError: `entry_point` has handlers of its own, which no endpoint here would call.
    """

    def __init__(
        self, model_data: str | Path, role: str | None = None, name: str | None = None, **recorded: Any
    ) -> None:
        require_arguments(type(self).__name__, recorded, (*MODEL_ARGUMENTS, "model_data", "role", "name"))
        self.model_data, self.name = str(model_data), name
        refuse_handlers(recorded.get("entry_point"), recorded.get("source_dir"))

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
        home = JobPaths.of_user()
        archive = local_path(self.model_data, buckets_of(home))
        if not archive.is_file():
            raise EndpointError(
                "model_data is {address}, and there is no {archive}; expected a job's model.tar.gz. "
                "Session().upload_data puts a file into a bucket's folder.",
                address=self.model_data,
                archive=archive,
            )
        run = trained_run_in(unpacked_model(archive))
        name = endpoint_name or self.name or f"{NAME}-{time.strftime('%Y-%m-%d-%H-%M-%S')}"
        return deploy(home, run, name, serializer, deserializer, wait, policy)


def refuse_handlers(entry_point: str | None, source_dir: str | None) -> None:
    """Refuse a file whose functions are to serve a model.

    Raises:
        SettingError: It defines one of `HANDLERS`.
    """
    path = Path(source_dir or ".", entry_point or "")
    if not path.is_file():
        return
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):
        return
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name in HANDLERS:
            raise SettingError(
                "{path}:{line}: {name} is to serve the model, and no endpoint here calls it; expected no entry_point: "
                "the policy is served as it was trained.",
                path=path,
                line=node.lineno,
                name=node.name,
            )


__all__ = ["Model"]
