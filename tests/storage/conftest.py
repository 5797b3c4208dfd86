"""Two stores: ours, which serves a folder and looks at signatures, and moto's, which is somebody else's work.

A third is asked where it is installed: rclone's (1.65 or newer), if RACECRAFT_RCLONE names the program.
"""

import contextlib
import os

import pytest
from tests.storage import servers
from tests.storage.servers import Store, empty

RCLONE = os.environ.get("RACECRAFT_RCLONE", "")


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
    empty(store)


@pytest.fixture(scope="session")
def rclone_url(tmp_path_factory):
    with servers.rclone(RCLONE, tmp_path_factory.mktemp("rclone")) as url:
        yield url


@pytest.fixture(params=["ours", "moto", *(["rclone"] if RCLONE else [])])
def store(request):
    """Each of the stores in turn."""
    if request.param == "ours":
        yield request.getfixturevalue("our_store")
        return
    store = Store(request.getfixturevalue(f"{request.param}_url"), "bucket", None)
    with contextlib.suppress(store.boto.exceptions.BucketAlreadyExists):
        store.boto.create_bucket(Bucket="bucket")
    yield store
    empty(store)
