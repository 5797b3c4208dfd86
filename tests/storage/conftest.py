"""Two stores: ours, which serves a folder and looks at signatures, and moto's, which is somebody else's work."""

import pytest
from tests.storage import servers
from tests.storage.servers import Store, empty


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


@pytest.fixture(params=["ours", "moto"])
def store(request):
    """Each of the two stores in turn."""
    if request.param == "ours":
        yield request.getfixturevalue("our_store")
        return
    store = Store(request.getfixturevalue("moto_url"), "bucket", None)
    store.boto.create_bucket(Bucket="bucket")
    yield store
    empty(store)
