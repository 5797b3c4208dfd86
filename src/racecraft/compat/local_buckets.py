"""boto3's S3 client over folders that stand for buckets, as far as notebooks use it. Begin with `Buckets`."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError, SettingError, nearest
from racecraft.contract.message import Message
from racecraft.formats.atomic import atomic_file, make_folder


class Buckets:
    """The buckets of this account, with AWS's own names of calls and arguments.

    What a job left is found in every bucket, as JOB/output/model.tar.gz and so on, where SageMaker would put it.

    Args:
        folder: Holds a folder for each.
        jobs: Holds a folder for each job; None: what they left is not found.
    """

    def __init__(self, folder: Path, jobs: Path | None = None) -> None:
        self._folder, self._jobs = folder, jobs

    def list_buckets(self) -> dict[str, Any]:
        """Return which there are."""
        found = sorted(path.name for path in self._folder.glob("*") if path.is_dir())
        return {"Buckets": [{"Name": name} for name in found]}

    def head_bucket(self, *, Bucket: str) -> dict[str, Any]:  # noqa: N803 - AWS's own name
        """Return nothing of a bucket that stands.

        Raises:
            SettingError: It does not.
        """
        self._bucket(Bucket)
        return {}

    def list_objects_v2(self, *, Bucket: str, Prefix: str = "") -> dict[str, Any]:  # noqa: N803 - AWS's own names
        """Return key and size (bytes) of every file whose key begins so."""
        folder = self._bucket(Bucket)
        files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
        files |= self._left_by_job(Prefix)
        found = [{"Key": key, "Size": files[key].stat().st_size} for key in sorted(files) if key.startswith(Prefix)]
        return {"KeyCount": len(found), "IsTruncated": False} | ({"Contents": found} if found else {})

    def upload_file(self, Filename: str, Bucket: str, Key: str) -> None:  # noqa: N803 - AWS's own names
        """Copy a file into a bucket.

        Raises:
            InputFileError: There is no such file.
            SettingError: There is no such bucket, or the key leads out of it.
        """
        target = self._place(Bucket, Key)
        if not Path(Filename).is_file():
            raise InputFileError(Filename, "there is no such file", "what is to be uploaded")
        make_folder(target.parent)
        with atomic_file(target) as part:
            shutil.copyfile(Filename, part)

    def download_file(self, Bucket: str, Key: str, Filename: str) -> None:  # noqa: N803 - AWS's own names
        """Copy a file out of a bucket.

        Raises:
            InputFileError: There is no such file in it.
            SettingError: There is no such bucket, or the key leads out of it.
        """
        source = self._place(Bucket, Key)
        source = source if source.is_file() else self._left_by_job(Key).get(Key, source)
        if not source.is_file():
            raise InputFileError(
                f"s3://{Bucket}/{Key}", Message("there is no {source}", source=source), "what was uploaded"
            )
        with atomic_file(Filename) as part:
            shutil.copyfile(source, part)

    def _left_by_job(self, prefix: str) -> dict[str, Path]:
        """Return what the job that a prefix names left, by key."""
        name = prefix.split("/")[0]
        if self._jobs is None or not name or "/" not in prefix:
            return {}
        folder = self._jobs / name
        left = [(path, path.relative_to(folder)) for path in (folder / "output").glob("*")]
        inner = folder / "opt" / "ml"
        left += [(path, path.relative_to(inner)) for path in (inner / "output" / "intermediate").rglob("*")]
        return {f"{name}/{place.as_posix()}": path for path, place in left if path.is_file()}

    def _bucket(self, name: str) -> Path:
        known = [one["Name"] for one in self.list_buckets()["Buckets"]]
        if name not in known:
            hint = nearest(name, known) if known else "`racecraft sandbox` and Session().default_bucket() make some."
            raise SettingError("s3://{name}: there is no such bucket on this machine. {hint}", name=name, hint=hint)
        return self._folder / name

    def _place(self, bucket: str, key: str) -> Path:
        folder = self._bucket(bucket).resolve()
        place = (folder / key).resolve()
        if place == folder or not place.is_relative_to(folder):
            raise SettingError(
                "s3://{bucket}/{key}: the key leads out of the bucket; expected a name in it.", bucket=bucket, key=key
            )
        return place


class Resource:
    """The same, as boto3's resources show them.

    Args:
        buckets: The buckets.
    """

    def __init__(self, buckets: Buckets) -> None:
        self._buckets = buckets

    def Bucket(self, name: str) -> BucketResource:  # noqa: N802 - AWS's own name
        """Return one of them."""
        return BucketResource(self._buckets, name)

    def Object(self, bucket_name: str, key: str) -> ObjectResource:  # noqa: N802 - AWS's own name
        """Return one file."""
        return ObjectResource(self._buckets, bucket_name, key)


class BucketResource:
    """One bucket; `objects` is the bucket itself, asked for its files."""

    def __init__(self, buckets: Buckets, name: str) -> None:
        self._buckets, self.name = buckets, name
        self.objects = self

    def all(self) -> list[ObjectResource]:
        """Return every file."""
        return self.filter()

    def filter(self, Prefix: str = "") -> list[ObjectResource]:  # noqa: N803 - AWS's own name
        """Return every file whose key begins so."""
        found = self._buckets.list_objects_v2(Bucket=self.name, Prefix=Prefix).get("Contents", [])
        return [ObjectResource(self._buckets, self.name, one["Key"]) for one in found]

    def upload_file(self, filename: str, key: str) -> None:
        """Copy a file into it."""
        self._buckets.upload_file(filename, self.name, key)

    def download_file(self, key: str, filename: str) -> None:
        """Copy a file out of it."""
        self._buckets.download_file(self.name, key, filename)


class ObjectResource:
    """One file of a bucket."""

    def __init__(self, buckets: Buckets, bucket_name: str, key: str) -> None:
        self._buckets, self.bucket_name, self.key = buckets, bucket_name, key

    def Object(self) -> ObjectResource:  # noqa: N802 - AWS's own name
        """Return itself: a summary has what there is to know."""
        return self

    def upload_file(self, filename: str) -> None:
        """Copy a file to its place."""
        self._buckets.upload_file(filename, self.bucket_name, self.key)

    def download_file(self, filename: str) -> None:
        """Copy it out."""
        self._buckets.download_file(self.bucket_name, self.key, filename)
