"""The extra is optional: importing needs nothing of it, and its absence is announced by name."""

import subprocess
import sys

import pytest

from racecraft.contract.errors import MissingExtraError
from racecraft.worlds.unity.env.wire import Wire

IMPORT_ALL = """
import sys
import racecraft.worlds.unity.env
from racecraft.worlds.unity.env import (
    actions, basic_scene, behaviors, builds, parallel, player, process, session, side_channels, wire, world,
)
print(*[name for name in ("grpc", "google.protobuf", "yaml", "PIL", "torch", "pettingzoo") if name in sys.modules])
"""


def test_importing_brings_no_guest_along():
    found = subprocess.run([sys.executable, "-c", IMPORT_ALL], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == ""


def test_an_absent_package_is_announced_with_the_command_that_installs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "grpc", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'racecraft\[unity\]'"):
        Wire()
