"""Two stores: moto's, and rclone's where it is installed, which serves a folder and checks signatures."""

import contextlib
import importlib.util

import pytest
from tests.storage import servers
from tests.storage.servers import Store, empty


@pytest.fixture(autouse=True)
def _asked_again_at_once(monkeypatch):
    """Wait for nothing before a request is sent again; boto3 and we wait for seconds."""
    if importlib.util.find_spec("botocore"):
        monkeypatch.setattr("botocore.retries.standard.ExponentialBackoff.delay_amount", lambda *_: 0.0)
    monkeypatch.setattr("racecraft.storage.object_store.MAX_WAIT_SECONDS", 0.01)


@pytest.fixture(scope="session")
def moto_url():
    with servers.moto() as url:
        yield url


@pytest.fixture(scope="session")
def rclone_server(tmp_path_factory):
    folder = tmp_path_factory.mktemp("served") / "bucket"
    folder.mkdir()
    with servers.rclone(folder) as url:
        yield url


@pytest.fixture
def moto_store(moto_url):
    store = Store(moto_url, "bucket")
    with contextlib.suppress(store.boto.exceptions.BucketAlreadyExists, store.boto.exceptions.BucketAlreadyOwnedByYou):
        store.boto.create_bucket(Bucket="bucket")
    yield store
    empty(store)


@pytest.fixture
def rclone_store(rclone_server):
    store = Store(rclone_server, "bucket")
    yield store
    empty(store)


@pytest.fixture(params=["moto", pytest.param("rclone", marks=servers.needs_rclone)])
def store(request):
    """Each of the stores in turn."""
    return request.getfixturevalue(f"{request.param}_store")
