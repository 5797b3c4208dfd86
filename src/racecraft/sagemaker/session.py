"""What notebooks ask of a SageMaker session, on this machine: buckets are folders, and a role is a word."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.arguments import require_arguments
from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.atomic import make_folder
from racecraft.jobs.job_paths import JobPaths
from racecraft.sagemaker.container import local_path
from racecraft.sagemaker.estimator_config import SESSION_ARGUMENTS

BUCKET = "racecraft-local"
REGION = "local"
ACCOUNT = "000000000000"
ROLE = f"arn:aws:iam::{ACCOUNT}:role/racecraft-local"
"""Has the shape of a role; nobody is asked for it."""


class UploadError(InputFileError):
    """A file to be uploaded is not there."""


def buckets_of(home: JobPaths) -> Path:
    """Return the folder whose folders stand for buckets."""
    return home.path / "buckets"


@dataclass(frozen=True)
class TrainingInput:
    """One channel of `fit(inputs)`, as `sagemaker.inputs.TrainingInput` and `sagemaker.s3_input` name it."""

    s3_data: str
    distribution: str | None = None
    content_type: str | None = None
    input_mode: str | None = None

    @property
    def address(self) -> str:
        """Where the data lies."""
        return self.s3_data


class Session:
    """A session that stays on this machine; whatever cloud session it is given is not asked."""

    boto_region_name = REGION

    def __init__(self, boto_session: Any = None, default_bucket: str | None = None, **recorded: Any) -> None:
        require_arguments("Session", recorded, ("boto_session", "default_bucket", *SESSION_ARGUMENTS))
        self._bucket = default_bucket or BUCKET
        self.boto_session, self.recorded = boto_session, recorded
        self.config: dict[str, Any] = {}
        self._home = JobPaths.of_user()

    def default_bucket(self) -> str:
        """Return the name of the bucket, and make its folder."""
        make_folder(buckets_of(self._home) / self._bucket)
        return self._bucket

    def upload_data(self, path: str, bucket: str | None = None, key_prefix: str = "data", **recorded: Any) -> str:
        """Copy a file, or what a folder holds, into a bucket's folder; return its address.

        Raises:
            UploadError: There is no such file or folder.
        """
        require_arguments("upload_data", recorded, ("path", "bucket", "key_prefix", "extra_args", "callback"))
        source = Path(path)
        address = f"s3://{bucket or self.default_bucket()}/{key_prefix}"
        target = local_path(address, buckets_of(self._home))
        if not source.exists():
            raise UploadError(path, "there is no such file or folder", "what is to be uploaded")
        make_folder(target)
        if source.is_dir():
            shutil.copytree(source, target, dirs_exist_ok=True)
            return address
        shutil.copy2(source, target)
        return f"{address}/{source.name}"

    def download_data(self, path: str, bucket: str, key_prefix: str = "", **recorded: Any) -> None:
        """Copy what a bucket's folder holds to a path.

        Raises:
            UploadError: There is no such thing in the bucket.
        """
        require_arguments("download_data", recorded, ("path", "bucket", "key_prefix", "extra_args"))
        source = local_path(f"s3://{bucket}/{key_prefix}", buckets_of(self._home))
        if not source.exists():
            raise UploadError(
                f"s3://{bucket}/{key_prefix}", Message("there is no {source}", source=source), "what was uploaded"
            )
        make_folder(path)
        if source.is_dir():
            shutil.copytree(source, path, dirs_exist_ok=True)
        else:
            shutil.copy2(source, path)


def get_execution_role(sagemaker_session: Session | None = None) -> str:
    """Return a word in the shape of a role."""
    return ROLE
