"""Two stores: ours, which serves a folder and looks at signatures, and moto's, which is somebody else's work."""

import importlib.util
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import servers

NEEDED = ("s3fs", "boto3", "moto")
needs_s3 = pytest.mark.skipif(
    any(importlib.util.find_spec(name) is None for name in NEEDED),
    reason="no s3fs or moto here: pip install -e '.[dev]' brings them",
)


@dataclass
class Store:
    """A store with one empty bucket, `bucket`, for each test."""

    url: str
    bucket: str
    folder: Path | None

    @property
    def boto(self):
        """The store as boto3 sees it: what is there is looked at with somebody else's eyes."""
        import boto3

        return boto3.client(
            "s3",
            endpoint_url=self.url,
            aws_access_key_id=servers.KEYS["AWS_ACCESS_KEY_ID"],
            aws_secret_access_key=servers.KEYS["AWS_SECRET_ACCESS_KEY"],
            region_name="us-east-1",
        )

    def access(self, url=None, secret=servers.KEYS["AWS_SECRET_ACCESS_KEY"]):
        from racecraft.storage.access import Access

        return Access(url or self.url, "", "us-east-1", servers.KEYS["AWS_ACCESS_KEY_ID"], secret)

    def open(self, url=None):
        from racecraft.storage.object_store import ObjectStore

        return ObjectStore(self.access(url))

    def contents(self):
        """Return everything in the bucket, by key."""
        boto = self.boto
        keys = [one["Key"] for one in boto.list_objects_v2(Bucket=self.bucket).get("Contents", [])]
        return {key: boto.get_object(Bucket=self.bucket, Key=key)["Body"].read() for key in keys}


@pytest.fixture(scope="session")
def moto_url():
    with servers.moto() as url:
        yield url


@pytest.fixture(scope="session")
def our_server(tmp_path_factory):
    folder = tmp_path_factory.mktemp("served") / "bucket"
    folder.mkdir()
    with servers.ours(folder) as url:
        yield url, folder


@pytest.fixture
def our_store(our_server):
    url, folder = our_server
    store = Store(url, folder.name, folder)
    yield store
    _empty(store)


@pytest.fixture(params=["ours", "moto"])
def store(request):
    """Each of the two stores in turn."""
    if request.param == "ours":
        yield request.getfixturevalue("our_store")
        return
    store = Store(request.getfixturevalue("moto_url"), "bucket", None)
    store.boto.create_bucket(Bucket="bucket")
    yield store
    _empty(store)


def _empty(store):
    boto = store.boto
    for one in boto.list_multipart_uploads(Bucket=store.bucket).get("Uploads", []):
        boto.abort_multipart_upload(Bucket=store.bucket, Key=one["Key"], UploadId=one["UploadId"])
    for one in boto.list_objects_v2(Bucket=store.bucket).get("Contents", []):
        boto.delete_object(Bucket=store.bucket, Key=one["Key"])
