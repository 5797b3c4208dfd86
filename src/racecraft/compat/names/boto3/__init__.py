"""`boto3`, as far as the notebooks of SageMaker RL use it: to ask where they are, and after their jobs."""

from __future__ import annotations

from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.jobs.estimator import TrainingJob
from racecraft.jobs.home import JobHome
from racecraft.jobs.session import ACCOUNT, REGION, ROLE

SERVICES = ("sagemaker", "sts")


class Session:
    """Says where we are: on this machine."""

    def __init__(self, region_name: str = REGION, **recorded: Any) -> None:
        self.region_name = region_name

    def client(self, service: str, **recorded: Any) -> Any:
        """Return the client of a service."""
        return client(service, **recorded)


def client(service: str, **recorded: Any) -> Any:
    """Return the client of a service.

    Raises:
        SettingError: Of a service that is not here.
    """
    if service not in SERVICES:
        raise SettingError(
            f"boto3.client('{service}'): `racecraft run` offers {', '.join(SERVICES)} of AWS's services. "
            f"{nearest(service, SERVICES)} Install boto3 where AWS itself is meant."
        )
    return _SageMaker() if service == "sagemaker" else _Sts()


class _SageMaker:
    def describe_training_job(self, *, TrainingJobName: str) -> dict[str, Any]:  # noqa: N803 - AWS's own name
        """Return what is known of a job."""
        return TrainingJob(TrainingJobName, JobHome.of_user()).describe()

    def stop_training_job(self, *, TrainingJobName: str) -> None:  # noqa: N803 - AWS's own name
        """Ask a job to end."""
        TrainingJob(TrainingJobName, JobHome.of_user()).stop()


class _Sts:
    def get_caller_identity(self) -> dict[str, str]:
        """Return who asks: nobody of AWS's."""
        return {"Account": ACCOUNT, "Arn": ROLE, "UserId": "local"}
