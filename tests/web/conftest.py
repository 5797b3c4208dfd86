import http.client
from contextlib import contextmanager

import pytest

from racecraft.web.application import make_application
from racecraft.web.server import ServerThread


class Client:
    """Asks a server as a program would, with the headers given and no others."""

    def __init__(self, port):
        self.port = port

    def ask(self, path="/", method="GET", body=None, **headers):
        """Return (status, headers, body); a header is named with _ for -."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(method, path, body, named, encode_chunked="Transfer-Encoding" in named)
        answer = connection.getresponse()
        found = answer.status, dict(answer.getheaders()), answer.read()
        connection.close()
        return found


@pytest.fixture
def served():
    """Serve routes; yield a function that returns a client."""

    @contextmanager
    def serve(routes, *values, **named):
        thread = ServerThread(make_application(routes, *values, **named), "test")
        try:
            yield Client(thread.start("127.0.0.1", 0))
        finally:
            thread.close()

    return serve
