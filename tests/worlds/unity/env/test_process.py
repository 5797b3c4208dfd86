"""The process: deaths are noticed and told with the log, and nothing is left behind."""

import gc
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import racecraft
from racecraft.worlds.unity.env.builds import Build
from racecraft.worlds.unity.env.errors import BuildError, PlayerDiedError, PlayerTimeoutError
from racecraft.worlds.unity.env.process import PlayerProcess, wait_until_gone
from racecraft.worlds.unity.env.session import Choice, Session

STAY = {"Basic?team=0": Choice(discrete=[[0]])}

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="process groups are told apart differently on Windows")


def test_a_crash_is_noticed_long_before_patience_ends_and_told_with_the_log(program):
    session = Session(program("crash"))
    session.reset()
    for _ in range(8):
        session.step(STAY)
    begun = time.monotonic()
    with pytest.raises(PlayerDiedError, match=r"SIGABRT(.|\n)*out of neutrons"):
        session.step(STAY)
    assert time.monotonic() - begun < 20
    assert wait_until_gone(session.pid)


def test_a_killed_player_is_noticed_long_before_patience_ends(program):
    session = Session(program("basic"))
    session.reset()
    os.kill(session.pid, signal.SIGKILL)
    begun = time.monotonic()
    with pytest.raises(PlayerDiedError, match="SIGKILL"):
        session.step(STAY)
    assert time.monotonic() - begun < 20


def test_a_player_that_ends_before_it_connects_is_told_with_its_log(program):
    begun = time.monotonic()
    with pytest.raises(PlayerDiedError, match=r"exit code 3(.|\n)*no display"):
        Session(program("early"))
    assert time.monotonic() - begun < 20


def test_a_player_that_never_connects_is_ended_after_the_timeout(program):
    with pytest.raises(PlayerTimeoutError, match=r"silent for 4 s(.|\n)*loading shaders"):
        Session(program("silent"), timeout_seconds=4.0)


def test_a_player_that_falls_asleep_is_ended_after_the_timeout(program):
    session = Session(program("sleep"), timeout_seconds=60.0)
    session.reset()
    session._timeout_seconds = 0.5  # its start had all the time a crowded machine wants
    session.step(STAY)
    session.step(STAY)
    with pytest.raises(PlayerTimeoutError, match="Zzz"):
        session.step(STAY)
    assert wait_until_gone(session.pid)


def test_a_stubborn_player_and_its_helpers_are_ended(program, tmp_path):
    session = Session(program("stubborn"), log_folder=tmp_path)
    session.reset()
    helper = int((tmp_path / "output-0.txt").read_text().split()[1])
    session.close(patience_seconds=0.2)
    assert wait_until_gone(session.pid)
    assert wait_until_gone(os.getpgid(helper) if _exists(helper) else helper)


@pytest.mark.parametrize("times", [8, pytest.param(1000, marks=pytest.mark.long)])
def test_opening_and_closing_again_and_again_leaves_nothing_behind(times):
    """Two at a time, on as many cores."""
    Session("builtin:Basic").close()  # what is imported at first use stays
    gc.collect()
    threads, files = set(threading.enumerate()), open_files()
    with ThreadPoolExecutor(2) as pool:
        pids = list(pool.map(lambda _: open_step_close(), range(times)))
    gc.collect()
    assert all(wait_until_gone(pid) for pid in pids)
    end = time.monotonic() + 60
    while set(threading.enumerate()) - threads and time.monotonic() < end:
        time.sleep(0.02)
    assert set(threading.enumerate()) - threads == set()
    assert open_files() <= files + 2


def open_step_close():
    with Session("builtin:Basic") as session:
        session.reset()
        session.step(STAY)
        return session.pid


def _exists(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def open_files():
    folder = "/proc/self/fd" if os.path.isdir("/proc/self/fd") else "/dev/fd"
    return len(os.listdir(folder))


def test_a_session_that_is_dropped_ends_its_player():
    session = Session("builtin:Basic")
    pid = session.pid
    del session
    gc.collect()
    assert wait_until_gone(pid)


KILLED = """
import os, signal
from racecraft.worlds.unity.env.session import Session
session = Session("builtin:Basic")
session.reset()
print(session.pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_player_whose_owner_is_killed_leaves_by_itself():
    owner = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, text=True, timeout=60)
    assert owner.returncode == -signal.SIGKILL
    assert wait_until_gone(int(owner.stdout))


def test_a_program_that_cannot_run_is_a_letter(tmp_path):
    plain = tmp_path / "Game.x86_64"
    plain.write_bytes(b"not a program")
    with pytest.raises(BuildError, match="chmod 755"):
        PlayerProcess([str(plain)])
    plain.chmod(0o755)
    with pytest.raises(BuildError, match="operating system"):
        PlayerProcess([str(plain)])


def test_a_launcher_that_leaves_its_player_running_is_no_death(tmp_path):
    """A shell script without `exec` is a launcher; what it started is ended with the session all the same."""
    home = Path(racecraft.__file__).parent.parent
    script = tmp_path / "play.sh"
    script.write_text(
        f'#!/bin/sh\nPYTHONPATH="{home}" "{sys.executable}" -P -m racecraft.worlds.unity.env.basic_scene "$@" &\n'
    )
    script.chmod(0o755)
    session = Session(Build("launched", (str(script),)))
    session.reset()
    time.sleep(0.3)
    session.step(STAY)
    session.close(patience_seconds=0.5)
    assert wait_until_gone(session.pid)


def test_the_log_file_a_user_names_is_the_one_that_is_read(tmp_path):
    code = "import sys, time; open(sys.argv[2], 'w').write('from the engine'); time.sleep(60)"
    log = tmp_path / "unity.log"
    process = PlayerProcess([sys.executable, "-c", code, "-logFile", str(log)])
    for _ in range(3000):
        if "from the engine" in process.log_tail():
            break
        time.sleep(0.02)
    assert "from the engine" in process.log_tail()
    assert "--- the end of unity.log ---" in process.log_tail()
    process.close(patience_seconds=0)


def test_players_get_a_log_file_of_their_own(tmp_path):
    processes = [PlayerProcess([sys.executable, "-c", "import time; time.sleep(60)"], log_folder=tmp_path)
                 for _ in range(2)]  # fmt: skip
    assert [process.command[-2:] for process in processes] == [
        ["-logFile", str(tmp_path / "Player-0.log")],
        ["-logFile", str(tmp_path / "Player-1.log")],
    ]
    for process in processes:
        process.close(patience_seconds=0)
    assert (tmp_path / "Player-0.log").exists()  # a folder that the user named stays


def test_temporary_logs_go_with_the_player(monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    session = Session("builtin:Basic")
    assert list(tmp_path.iterdir())
    session.close()
    assert list(tmp_path.iterdir()) == []


def ran(script, *words, **options):
    """Run a shell script to its end."""
    process = PlayerProcess(["sh", "-c", script, *words], **{"unity_log": False, **options})
    process.wait_for_end(60)
    return process


@pytest.mark.parametrize(
    ("script", "told"),
    [
        ("exit 3", "exit code 3"),
        ("kill -9 $$", "signal SIGKILL"),
    ],
)
def test_how_a_player_ended_is_told_with_its_program(script, told):
    process = ran(script)
    with pytest.raises(
        PlayerDiedError, match=f"^the player ended by itself with {told}: sh\nIt wrote nothing to its log"
    ):
        process.require_alive()
    process.close(patience_seconds=0)


def test_of_a_long_log_the_last_lines_are_told(tmp_path):
    process = ran("seq 1 30")
    assert process.log_tail() == "\n".join(["--- the end of output-0.txt ---", *map(str, range(11, 31))])
    assert process.log_tail(2) == "--- the end of output-0.txt ---\n29\n30"
    process.close(patience_seconds=0)
    short = ran("seq 1 3; echo", environment={"UNUSED": "1"})
    assert short.log_tail() == "--- the end of output-0.txt ---\n1\n2\n3"
    short.close(patience_seconds=0)


def test_a_log_folder_is_made_and_stays_and_variables_are_added(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("KEPT", "kept")
    for name in ("output-0.txt", "output-1.txt"):
        process = ran("echo $KEPT $GREETING", log_folder="a/b", environment={"GREETING": "hello"})
        process.close(patience_seconds=0)
        assert (process.output_file, process.command[0]) == (tmp_path / "a" / "b" / name, "sh")
        assert process.output_file.read_text() == "kept hello\n"


def test_a_player_that_prints_its_log_is_left_to_it():
    """`-logFile -` is Unity's word for it."""
    process = ran("echo said", "x", "-logfile", "-", unity_log=True)
    assert process.command == ["sh", "-c", "echo said", "x", "-logfile", "-"]
    assert process.log_tail() == "--- the end of output-0.txt ---\nsaid"
    process.close(patience_seconds=0)


def test_helpers_that_outlive_their_player_are_ended_with_the_session():
    process = ran("sleep 600 & echo started")
    process.require_alive()  # one that went well and left somebody running
    process.close(patience_seconds=0)
    assert wait_until_gone(process.pid)
    assert not wait_until_gone(os.getpgrp(), 0)


def test_a_program_that_does_not_start_leaves_no_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(BuildError, match="absent: cannot be started"):
        PlayerProcess([str(tmp_path / "absent")])
    assert list(tmp_path.iterdir()) == []
