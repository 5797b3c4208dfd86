"""boto3's S3 client over folders that stand for buckets, as far as notebooks use it. Begin with `Buckets`."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError, SettingError, nearest
from racecraft.formats.whole import make_folder, whole_file


class Buckets:
    """The buckets of this account, with AWS's own names of calls and arguments.

    Args:
        folder: Holds a folder for each.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

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
        with whole_file(target) as part:
            shutil.copyfile(Filename, part)

    def download_file(self, Bucket: str, Key: str, Filename: str) -> None:  # noqa: N803 - AWS's own names
        """Copy a file out of a bucket.

        Raises:
            InputFileError: There is no such file in it.
            SettingError: There is no such bucket, or the key leads out of it.
        """
        source = self._place(Bucket, Key)
        if not source.is_file():
            raise InputFileError(f"s3://{Bucket}/{Key}", f"there is no {source}", "what was uploaded")
        with whole_file(Filename) as part:
            shutil.copyfile(source, part)

    def _bucket(self, name: str) -> Path:
        known = [one["Name"] for one in self.list_buckets()["Buckets"]]
        if name not in known:
            cure = nearest(name, known) if known else "`racecraft sandbox` and Session().default_bucket() make some."
            raise SettingError(f"s3://{name}: there is no such bucket on this machine. {cure}")
        return self._folder / name

    def _place(self, bucket: str, key: str) -> Path:
        folder = self._bucket(bucket).resolve()
        place = (folder / key).resolve()
        if place == folder or not place.is_relative_to(folder):
            raise SettingError(f"s3://{bucket}/{key}: the key leads out of the bucket; expected a name in it.")
        return place
