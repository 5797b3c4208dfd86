"""`boto3`, as far as the notebooks of SageMaker RL use it: to ask where they are, and after their jobs."""

from __future__ import annotations

from typing import Any

from racecraft.compat.local_buckets import Buckets, Resource
from racecraft.contract.arguments import require_arguments
from racecraft.contract.errors import SettingError, nearest
from racecraft.jobs.job_paths import JobPaths
from racecraft.sagemaker.estimator import TrainingJob
from racecraft.sagemaker.sandbox.create import recorded_stacks
from racecraft.sagemaker.session import ACCOUNT, REGION, ROLE, buckets_of

ACCOUNT_ARGUMENTS = ("aws_access_key_id", "aws_secret_access_key", "aws_session_token", "region_name")
SESSION_ARGUMENTS = (*ACCOUNT_ARGUMENTS, "botocore_session", "profile_name", "aws_account_id")
CLIENT_ARGUMENTS = (*ACCOUNT_ARGUMENTS, "api_version", "use_ssl", "verify", "endpoint_url", "config", "aws_account_id")
"""What boto3 takes to know whom to ask; here nobody is asked."""
SERVICES = ("sagemaker", "sts", "s3", "cloudformation")


class Session:
    """Says where we are: on this machine."""

    def __init__(self, region_name: str = REGION, **recorded: Any) -> None:
        require_arguments("boto3.Session", recorded, SESSION_ARGUMENTS)
        self.region_name = region_name

    def client(self, service_name: str, **recorded: Any) -> Any:
        """Return the client of a service."""
        return client(service_name, **recorded)

    def resource(self, service_name: str, **recorded: Any) -> Resource:
        """Return the resources of a service."""
        return resource(service_name, **recorded)


def resource(service_name: str, **recorded: Any) -> Resource:
    """Return the resources of a service.

    Raises:
        SettingError: Of a service that is not here, or an argument that boto3 has not.
    """
    require_arguments("boto3.resource", recorded, CLIENT_ARGUMENTS)
    if service_name != "s3":
        raise SettingError(
            f"boto3.resource('{service_name}'): `racecraft run` offers s3 of AWS's. Where AWS itself is meant, install "
            "boto3 and give it credentials."
        )
    return Resource(client(service_name))


def client(service_name: str, **recorded: Any) -> Any:
    """Return the client of a service.

    Raises:
        SettingError: Of a service that is not here, or an argument that boto3 has not.
    """
    require_arguments("boto3.client", recorded, CLIENT_ARGUMENTS)
    if service_name not in SERVICES:
        raise SettingError(
            f"boto3.client('{service_name}'): `racecraft run` offers {', '.join(SERVICES)} of AWS's services. "
            f"{nearest(service_name, SERVICES)} Where AWS itself is meant, install boto3 and give it credentials."
        )
    if service_name == "s3":
        home = JobPaths.of_user()
        return Buckets(buckets_of(home), home.path)
    return {"sagemaker": _SageMaker, "sts": _Sts, "cloudformation": _CloudFormation}[service_name]()


class _SageMaker:
    def describe_training_job(self, *, TrainingJobName: str) -> dict[str, Any]:  # noqa: N803 - AWS's own name
        """Return what is known of a job."""
        return TrainingJob(TrainingJobName, JobPaths.of_user()).describe()

    def stop_training_job(self, *, TrainingJobName: str) -> None:  # noqa: N803 - AWS's own name
        """Ask a job to end."""
        TrainingJob(TrainingJobName, JobPaths.of_user()).stop()


class _CloudFormation:
    def describe_stacks(self, *, StackName: str | None = None) -> dict[str, Any]:  # noqa: N803 - AWS's own name
        """Return what `racecraft sandbox` made.

        Raises:
            SettingError: There is no such stack.
        """
        stacks = {stack["stack"]: stack for stack in recorded_stacks(JobPaths.of_user())}
        if StackName is not None and StackName not in stacks:
            raise SettingError(
                f"describe_stacks: there is no stack '{StackName}'. `racecraft sandbox TEMPLATE.yaml` makes one. "
                + (nearest(StackName, stacks) if stacks else "")
            )
        chosen = stacks.values() if StackName is None else [stacks[StackName]]
        return {"Stacks": [_described(stack) for stack in chosen]}


def _described(stack: dict[str, Any]) -> dict[str, Any]:
    outputs = [
        {"OutputKey": one["name"], "OutputValue": one["value"], "Description": one["description"]}
        for one in stack["outputs"]
        if one["value"] is not None
    ]
    parameters = [{"ParameterKey": key, "ParameterValue": value} for key, value in stack["parameters"].items()]
    return {
        "StackName": stack["stack"], "StackStatus": "CREATE_COMPLETE", "Description": stack["description"],
        "Outputs": outputs, "Parameters": parameters,
    }  # fmt: skip


class _Sts:
    def get_caller_identity(self) -> dict[str, str]:
        """Return who asks: nobody of AWS's."""
        return {"Account": ACCOUNT, "Arn": ROLE, "UserId": "local"}
