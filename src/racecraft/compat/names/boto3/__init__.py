"""`boto3`, as far as the notebooks of SageMaker RL use it: to ask where they are, and after their jobs."""

from __future__ import annotations

from typing import Any

from racecraft.compat.local_buckets import Buckets, Resource
from racecraft.contract.errors import SettingError, nearest
from racecraft.jobs.estimator import TrainingJob
from racecraft.jobs.home import JobHome
from racecraft.jobs.sandbox.making import recorded_stacks
from racecraft.jobs.session import ACCOUNT, REGION, ROLE, buckets_of

SERVICES = ("sagemaker", "sts", "s3", "cloudformation")


class Session:
    """Says where we are: on this machine."""

    def __init__(self, region_name: str = REGION, **recorded: Any) -> None:
        self.region_name = region_name

    def client(self, service: str, **recorded: Any) -> Any:
        """Return the client of a service."""
        return client(service, **recorded)

    def resource(self, service: str, **recorded: Any) -> Resource:
        """Return the resources of a service."""
        return resource(service, **recorded)


def resource(service: str, **recorded: Any) -> Resource:
    """Return the resources of a service.

    Raises:
        SettingError: Of a service that is not here.
    """
    if service != "s3":
        raise SettingError(
            f"boto3.resource('{service}'): `racecraft run` offers s3 of AWS's. Where AWS itself is meant, install "
            "boto3 and give it credentials."
        )
    return Resource(client(service))


def client(service: str, **recorded: Any) -> Any:
    """Return the client of a service.

    Raises:
        SettingError: Of a service that is not here.
    """
    if service not in SERVICES:
        raise SettingError(
            f"boto3.client('{service}'): `racecraft run` offers {', '.join(SERVICES)} of AWS's services. "
            f"{nearest(service, SERVICES)} Where AWS itself is meant, install boto3 and give it credentials."
        )
    if service == "s3":
        home = JobHome.of_user()
        return Buckets(buckets_of(home), home.path)
    return {"sagemaker": _SageMaker, "sts": _Sts, "cloudformation": _CloudFormation}[service]()


class _SageMaker:
    def describe_training_job(self, *, TrainingJobName: str) -> dict[str, Any]:  # noqa: N803 - AWS's own name
        """Return what is known of a job."""
        return TrainingJob(TrainingJobName, JobHome.of_user()).describe()

    def stop_training_job(self, *, TrainingJobName: str) -> None:  # noqa: N803 - AWS's own name
        """Ask a job to end."""
        TrainingJob(TrainingJobName, JobHome.of_user()).stop()


class _CloudFormation:
    def describe_stacks(self, *, StackName: str | None = None) -> dict[str, Any]:  # noqa: N803 - AWS's own name
        """Return what `racecraft sandbox` made.

        Raises:
            SettingError: There is no such stack.
        """
        stacks = {told["stack"]: told for told in recorded_stacks(JobHome.of_user())}
        if StackName is not None and StackName not in stacks:
            raise SettingError(
                f"describe_stacks: there is no stack '{StackName}'. `racecraft sandbox TEMPLATE.yaml` makes one. "
                + (nearest(StackName, stacks) if stacks else "")
            )
        chosen = stacks.values() if StackName is None else [stacks[StackName]]
        return {"Stacks": [_described(told) for told in chosen]}


def _described(told: dict[str, Any]) -> dict[str, Any]:
    outputs = [
        {"OutputKey": one["name"], "OutputValue": one["value"], "Description": one["description"]}
        for one in told["outputs"]
        if one["value"] is not None
    ]
    parameters = [{"ParameterKey": key, "ParameterValue": value} for key, value in told["parameters"].items()]
    return {
        "StackName": told["stack"], "StackStatus": "CREATE_COMPLETE", "Description": told["description"],
        "Outputs": outputs, "Parameters": parameters,
    }  # fmt: skip


class _Sts:
    def get_caller_identity(self) -> dict[str, str]:
        """Return who asks: nobody of AWS's."""
        return {"Account": ACCOUNT, "Arn": ROLE, "UserId": "local"}
