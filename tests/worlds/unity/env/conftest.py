"""Players for tests: in a thread (fast) or as a process (genuine)."""

import contextlib
import importlib.util
import socket
import sys
import threading
import time
from pathlib import Path

import pytest

pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")

import racecraft
from racecraft.worlds.unity.env.builds import Build
from racecraft.worlds.unity.env.player import Player
from racecraft.worlds.unity.env.session import Session

HERE = Path(__file__).parent


def _load_scenes():
    spec = importlib.util.spec_from_file_location("racecraft_test_scenes", HERE / "scenes.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def scenes():
    return _load_scenes()


@pytest.fixture(scope="session")
def program():
    """Return a build that runs one of the scenes as a process."""

    def build(scene):
        home = str(Path(racecraft.__file__).parent.parent)
        command = (sys.executable, "-P", str(HERE / "scenes.py"), "--scene", scene)
        return Build(scene, command, False, {"PYTHONPATH": home})

    return build


@pytest.fixture
def talk():
    """Open a session with a player that lives in a thread; everything is closed after the test."""
    opened = []

    def open_session(scene, player=Player, claims=None, **options):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        living = player(scene, port, **(claims or {}))
        thread = threading.Thread(target=_live, args=(living,), daemon=True)
        thread.start()
        opened.append((living, thread))
        options.setdefault("timeout_seconds", 5.0)
        session = Session(Build("editor", None), port=port, **options)
        opened.append((session, None))
        session.player = living
        return session

    yield open_session
    for thing, _ in opened:
        if isinstance(thing, Session):
            thing.close()
    for _, thread in opened:
        if thread is not None:
            thread.join(60)


def _live(player):
    for _ in range(1000):  # gRPC itself would wait longer before it tries again
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", player.port), 1):
            break
        time.sleep(0.001)
    with contextlib.suppress(ConnectionError):
        player.live()
