"""A pytest plugin for `test_official_suite`: ML-Agents' own tests, as they lie unpacked, under our names.

What their suite takes for granted and does not bring: ports of its own, the two scenes that it downloads (a manifest in
the environment leads to stand-ins), and the trainers' settings, which its helper `dummy_config` imports.
"""

import contextlib
import socket
import sys
from unittest import mock

import pytest

from racecraft.compat.shims import foreign_names

_lent = contextlib.ExitStack()
TRAINERS = (
    "mlagents", "mlagents.trainers", "mlagents.trainers.settings", "mlagents.trainers.ppo", "mlagents.trainers.sac",
    "mlagents.trainers.poca", "mlagents.trainers.ppo.trainer", "mlagents.trainers.sac.trainer",
    "mlagents.trainers.poca.trainer",
)  # fmt: skip


def pytest_configure(config):
    _lent.enter_context(foreign_names())
    _lent.enter_context(mock.patch.dict(sys.modules, {name: mock.MagicMock() for name in TRAINERS}))


def pytest_unconfigure(config):
    _lent.close()


@pytest.fixture
def base_port(n_ports):
    """The first of so many free ports in a row."""
    while True:
        with contextlib.ExitStack() as held, contextlib.suppress(OSError):
            probes = [held.enter_context(socket.socket()) for _ in range(n_ports)]
            probes[0].bind(("127.0.0.1", 0))
            first = probes[0].getsockname()[1]
            for offset, probe in enumerate(probes[1:], 1):
                probe.bind(("127.0.0.1", first + offset))
            return first
