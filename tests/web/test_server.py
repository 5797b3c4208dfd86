"""Serving: a taken port is named with its remedy, Ctrl-C and SIGTERM end a server with exit code 0."""

import signal
import socket
import subprocess
import sys
import urllib.request

import pytest

from racecraft.web.application import make_application
from racecraft.web.ports import PortError
from racecraft.web.server import ServerThread

SERVES = """
from racecraft.web.application import make_application
from racecraft.web.server import serve
serve(make_application([]), "127.0.0.1", 0, lambda port: print(port, flush=True))
print("ended")
"""


def test_a_taken_port_is_named():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(PortError, match=f"127.0.0.1:{port}.*choose another --port"):
            ServerThread(make_application([]), "test").start("127.0.0.1", port)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it(number):
    server = subprocess.Popen([sys.executable, "-c", SERVES], stdout=subprocess.PIPE, text=True)
    port = int(server.stdout.readline())
    with pytest.raises(urllib.error.HTTPError, match="404") as refused:
        urllib.request.urlopen(f"http://127.0.0.1:{port}/")
    refused.value.close()
    server.send_signal(number)
    assert server.communicate(timeout=60)[0] == "ended\n"
    assert server.returncode == 0
