"""A reward function in a process of its own: it pays as ever, and can do nothing else."""

import builtins
import contextlib
import io
import os
import re
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest

from racecraft.contract.errors import RewardError, RewardFileError
from racecraft.contract.world import allocate
from racecraft.formats import run_folder
from racecraft.isolation.layers import can_isolate
from racecraft.worlds.deepracer.adapter import race_world
from racecraft.worlds.deepracer.env import reward_process
from racecraft.worlds.deepracer.env.reward_process import open_reward
from racecraft.worlds.deepracer.env.settings import BotsConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.reward_file import example_situations, load_reward_function, validate

PARAMS = example_situations()["on the way"]
isolated = pytest.mark.skipif(not can_isolate(), reason="this system isolates no code")


@pytest.fixture
def opened(tmp_path):
    """Opens a reward function of some text; its process is ended afterwards."""
    processes = []

    def open_text(text, **options):
        path = tmp_path / "reward_function.py"
        path.write_text(text, encoding="utf-8")
        processes.append(open_reward(path, **options))
        return processes[-1]

    yield open_text
    for process in processes:
        process.close()


def body(statement, before=""):
    return f"{before}\ndef reward_function(params):\n    {statement}\n    return 1.0\n"


# What a reward rightly does

STATEFUL = """\
import random
import numpy as np
from helper import twice
LINE = np.load("{line}")
random.seed(3)
calls = 0

class Reward:
    def __init__(self):
        self.sum = 0.0

    def reward_function(self, params):
        global calls
        calls += 1
        self.sum += params["speed"]
        nearest = params["waypoints"][params["closest_waypoints"][0]]
        seen = sum(params["objects_distance"]) + sum(map(sum, params["objects_location"]))
        drawn = random.random() + np.random.default_rng(1).random()
        return twice(calls) + self.sum / 7 + nearest[0] + LINE.sum() + drawn + seen

reward = Reward()
"""


def driven(world, reward, ticks=40):
    world.reward = reward
    buffers = allocate(world.spec)
    world.reset(buffers, 5)
    paid = []
    actions = np.random.default_rng(0).integers(0, 10, (ticks, *buffers.reward.shape))
    for tick in range(ticks):
        world.step(actions[tick], buffers)
        paid.append(buffers.reward.copy())
    return np.array(paid)


@pytest.mark.parametrize("race", [None, "HEAD_TO_BOT", "several cars"])
def test_it_pays_to_the_bit_what_the_function_pays_in_this_process(tmp_path, race):
    (tmp_path / "helper.py").write_text("def twice(x):\n    return 2 * x\n")
    np.save(tmp_path / "line.npy", np.arange(6.0))
    path = tmp_path / "reward_function.py"
    path.write_text(STATEFUL.format(line=tmp_path / "line.npy"))
    plain = race_world(num_cars=3, width=40, height=30)
    extra = {"cars_per_world": 2} if race == "several cars" else {}
    objects = None if race is None else BotsConfig(number=2)
    config = RaceConfig(max_episode_seconds=1.5)
    world = RaceWorld(plain.track, plain.actions, race_config=config, num_cars=3, objects=objects, **extra)
    here = [copy.call for copy in load_reward_function(path).copies(world.cars.size)]
    expected = driven(world, here)
    process = open_reward(path)
    found = driven(world, process.copies(world.cars.size))
    process.close()
    assert len(np.unique(expected)) > 20
    np.testing.assert_array_equal(found, expected)


def test_single_dictionaries_are_paid_as_in_this_process(tmp_path):
    path = tmp_path / "reward_function.py"
    path.write_text("n = 0\ndef reward_function(p):\n    global n\n    n += 1\n    return n + p['waypoints'][1][0]\n")
    process = open_reward(path)
    assert validate(process) == validate(load_reward_function(path))
    process.close()


LAZY = """\
def reward_function(params):
    import csv, json, math, os.path
    import numpy.linalg
    import scipy.interpolate, scipy.spatial
    from shapely.geometry import Point
    here = os.path.dirname(os.path.abspath(__file__))
    with open(os.path.join(here, "line.csv"), encoding="utf-8") as file:
        (row,) = csv.reader(file)
    curve = scipy.interpolate.CubicSpline([0.0, 1.0, 2.0], [float(cell) for cell in row])
    return float(curve(1.5)) + Point(0, 0).distance(Point(3, 4)) + numpy.linalg.norm([3.0, 4.0])
"""


def test_files_beside_it_are_read_and_packages_are_imported_late(tmp_path, opened):
    (tmp_path / "line.csv").write_text("0.0,1.0,2.0\n")
    assert opened(LAZY).call(PARAMS) == pytest.approx(11.5)


def test_prints_arrive_with_the_tick_and_are_bounded(opened, monkeypatch):
    log = io.StringIO()
    reward = opened(body("print('at', params['steps']); import sys; sys.stderr.write('and so\\n')", "print('once')"))
    reward.output = log
    reward.call(PARAMS)
    assert log.getvalue() == "at 80.0\nand so\n"
    loud, log = opened(body("print('x' * 10_000_000)")), io.StringIO()
    loud.output = log
    loud.call(PARAMS)
    assert len(log.getvalue()) < 70_000
    assert "more characters are dropped" in log.getvalue()
    monkeypatch.setattr(loud, "_room", 1000)
    loud.call(PARAMS)
    size = len(log.getvalue())
    assert "what follows is dropped" in log.getvalue()
    loud.call(PARAMS)
    assert len(log.getvalue()) == size


# What ends it


def test_a_car_that_fails_is_told_with_its_line_and_cars_before_it_are_paid(tmp_path):
    path = tmp_path / "reward_function.py"
    path.write_text("n = 0\ndef reward_function(p):\n    global n\n    n += 1\n    return 1 / (n - 3)\n")
    world = race_world(num_cars=2, width=40, height=30)
    process = open_reward(path)
    with pytest.raises(RewardError, match=r"reward_function\.py:5: reward_function raised ZeroDivisionError"):
        driven(world, process.copies(2))
    assert process.call(PARAMS) == -0.5, "the process goes on"
    process.close()


ENDS = [
    "__import__('os')._exit(0)",
    "getattr(__import__('posix'), '_ex' + 'it')(7)",
    "import ctypes; ctypes.string_at(0)",
]


@pytest.mark.parametrize("statement", ENDS)
def test_a_process_that_ends_is_an_error_with_file_and_line(opened, statement):
    reward = opened(body(statement))
    with pytest.raises(RewardError, match=r"reward_function\.py:[23]: reward_function's process ended \((exit|SIG)"):
        reward.call(PARAMS)
    with pytest.raises(RewardError, match="ended before"):
        reward.call(PARAMS)


@pytest.mark.parametrize(
    ("statement", "found"),
    [
        ("raise RuntimeError('none')", "3: reward_function raised RuntimeError: none"),
        ("__import__('os')._exit(0)", r"4: reward_function's process ended \(exit code 0\)"),
        ("while True: pass", r"3: reward_function had not returned after 0\.3 s"),
    ],
)
def test_an_object_that_fails_as_a_number_is_an_error_with_file_and_line(opened, statement, found):
    text = f"class Pay:\n    def __float__(self):\n        {statement}\ndef reward_function(p):\n    return Pay()\n"
    reward = opened(text, seconds=0.3)
    with pytest.raises(RewardError, match=rf"reward_function\.py:{found}"):
        reward.call(PARAMS)


def test_a_file_that_ends_its_process_or_hangs_while_it_is_imported_is_refused(opened, monkeypatch):
    with pytest.raises(RewardFileError, match=r"its process ended \(exit code 0\) while it was imported"):
        opened("import os\nos._exit(0)\n")
    monkeypatch.setattr(reward_process, "IMPORT_SECONDS", 3.0)
    with pytest.raises(RewardFileError, match=r"reward_function\.py:[23]: had not returned after 3 s while"):
        opened("x = 1\nwhile True:\n    pass\n")


STUCK = [
    "__import__('time').sleep(60)",
    "pow(7, 7**9)",
]


@pytest.mark.parametrize("statement", STUCK)
def test_a_call_that_does_not_return_is_ended_with_its_line(opened, statement):
    reward = opened(body(statement), seconds=0.3)
    began = time.monotonic()
    with pytest.raises(RewardError, match=r"reward_function\.py:3: reward_function had not returned after 0\.3 s"):
        reward.call(PARAMS)
    assert time.monotonic() - began < 30.0


def test_an_endless_loop_that_catches_everything_is_ended(opened):
    loop = "    while True:\n        try:\n            pass\n        except:\n            pass\n"
    with pytest.raises(RewardError, match=r"reward_function\.py:\d: reward_function had not returned"):
        opened(f"def reward_function(p):\n{loop}", seconds=0.2).call(PARAMS)


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="nothing can be paused here")
def test_a_call_during_which_everything_is_paused_for_longer_than_it_may_take_is_not_late(tmp_path):
    path = tmp_path / "reward_function.py"
    path.write_text(body("[__import__('time').sleep(0.02) for _ in range(20)]"))
    code = (
        "from racecraft.worlds.deepracer.env.reward_process import open_reward\n"
        "from racecraft.worlds.deepracer.files.reward_file import example_situations\n"
        f"reward = open_reward({str(path)!r}, seconds=1.0)\n"
        "print('asks', flush=True)\n"
        "print([reward.call(example_situations()['on the way']) for _ in range(10)])\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as asks:
        assert asks.stdout.readline() == "asks\n"
        everybody = [psutil.Process(asks.pid), *psutil.Process(asks.pid).children()]
        time.sleep(0.2)
        for one in everybody:
            one.suspend()
        time.sleep(2.5)
        for one in everybody:
            one.resume()
        assert asks.communicate(timeout=60)[0] == f"{[1.0] * 10}\n"


def test_many_slow_cars_together_may_take_longer_than_one_call(tmp_path):
    path = tmp_path / "reward_function.py"
    path.write_text(body("__import__('time').sleep(0.2)"))
    world = race_world(num_cars=6, width=40, height=30)
    process = open_reward(path, seconds=0.5)
    assert driven(world, process.copies(6), ticks=3)[2].sum() == 6.0
    process.close()


def test_a_library_is_looked_for_without_a_compiler(opened):
    """As `import torch` does where it was built for CUDA."""
    assert opened(body("ctypes.util.find_library('dl')", before="import ctypes.util")).call(PARAMS) == 1.0


THE_PIPE = """\
import os, stat, struct
def is_pipe(number):
    try:
        return stat.S_ISFIFO(os.fstat(number).st_mode)
    except OSError:
        return False
answers = next(number for number in range(3, 32) if is_pipe(number))
"""
LIES = [  # written to the pipe that answers leave by
    ("b'no message at all'", "answered with a message of"),
    ("struct.pack('<II', 0, 16) + bytes(16)", "answered 16 bytes; expected 1 numbers"),
    ("struct.pack('<IId', 0, 8, 1e9)", "answered 8 bytes; expected 1 numbers"),
    ("struct.pack('<IId', 0, 8, float('nan'))", "answered 8 bytes; expected 1 numbers"),
    ("struct.pack('<II', 100000, 0) + b'[' * 100000", "answered with a head that is no"),
    ("struct.pack('<II', 2, 0) + b'[]'", "answered with a head that is no"),
    ("struct.pack('<II', 4000000000, 0)", "answered with a message of"),
]


@pytest.mark.parametrize(("lie", "found"), LIES)
def test_what_is_no_answer_is_an_error(opened, lie, found):
    reward = opened(body(f"os.write(answers, {lie})", before=THE_PIPE))
    with pytest.raises(RewardError, match=found):
        reward.call(PARAMS)


def test_its_process_ends_with_its_owner(opened):
    reward = opened(body("pass"))
    process = reward._process._process
    reward.close()
    assert process.poll() is not None
    other = opened(body("pass"))
    process = other._process._process
    os.close(other._process._process.stdin.fileno())  # as when its owner is killed
    assert process.wait(60.0) == 0
    with pytest.raises(RewardError):
        other.call(PARAMS)
    other._process._process.stdin = None


# What it cannot do

ATTACKS = {
    "reads the system's accounts": "open('/etc/passwd').read()",
    "lists the home folder": "os.listdir(os.path.expanduser('~root') if os.getuid() == 0 else '/home')",
    "reads a file elsewhere": "open('{elsewhere}/secret.txt').read()",
    "reads keys beside it": "open('{folder}/system.env').read()",
    "follows a link out of its folder": "open('{folder}/link/secret.txt').read()",
    "writes elsewhere": "open('{elsewhere}/new.txt', 'w')",
    "writes beside itself": "open('{folder}/new.txt', 'w')",
    "appends to a file beside it": "open('{folder}/beside.txt', 'a')",
    "cuts a file": "os.truncate('{folder}/beside.txt', 0)",
    "deletes a file": "os.remove('{folder}/beside.txt')",
    "moves a file": "os.rename('{folder}/beside.txt', '{folder}/gone.txt')",
    "locks a file away": "os.chmod('{folder}/beside.txt', 0)",
    "makes a folder": "os.mkdir('{folder}/new')",
    "makes a link": "os.symlink('/etc', '{folder}/new')",
    "connects to this machine": "socket.create_connection(('127.0.0.1', {port}), 1)",
    "binds a port": "socket.socket().bind(('127.0.0.1', 0))",
    "opens a datagram socket": "socket.socket(socket.AF_INET, socket.SOCK_DGRAM)",
    "opens a local socket": "socket.socketpair()",
    "forks": "os.fork()",
    "starts a program": "subprocess.run(['/bin/true'])",
    "becomes a program": "os.execv('/bin/true', ['true'])",
    "starts a thread": "threading.Thread(target=print).start()",
    "takes 1 GB": "bytearray(1 << 30)",
    "takes 1 GB that is shared": "mmap.mmap(-1, 1 << 30)",
    "kills itself": "os.kill(os.getpid(), 9)",
    "signals its owner": "os.kill(os.getppid(), 0)",
    "has its owner signalled": "fcntl.fcntl(0, fcntl.F_SETOWN, os.getppid())",
    "limits its owner": "resource.prlimit(os.getppid(), resource.RLIMIT_CPU, (1, 1))",
    "moves its owner to one core": "os.sched_setaffinity(os.getppid(), {{0}})",
    "reads its owner's memory": "open(f'/proc/{{os.getppid()}}/mem', 'rb')",
    "reads its owner's environment": "open(f'/proc/{{os.getppid()}}/environ', 'rb').read()",
    "reads its owner by ptrace": "_called('ptrace', 16, os.getppid(), 0, 0)",
    "reads its owner's pages": "_called('process_vm_readv', os.getppid(), 0, 0, 0, 0, 0)",
    "lifts its limits": "resource.setrlimit(resource.RLIMIT_DATA, (1 << 40, 1 << 40))",
}
"""Each must raise where it stands."""

HEAD = """\
import ctypes, fcntl, mmap, os, resource, socket, subprocess, threading

def _called(name, *arguments):
    libc = ctypes.CDLL(None, use_errno=True)
    if getattr(libc, name)(*arguments) < 0:
        raise OSError(ctypes.get_errno(), name)

def reward_function(params):
    ATTACKS[params["steps"]]()
    return 1.0

ATTACKS = [
    lambda: None,
"""


@pytest.fixture(scope="module")
def attacker(tmp_path_factory):
    """A reward function that holds every attack, numbered from 1, with something to be attacked."""
    folder, elsewhere = tmp_path_factory.mktemp("attacker"), tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "secret.txt").write_text("secret")
    (folder / "link").symlink_to(elsewhere)
    (folder / "system.env").write_text("AWS_SECRET_ACCESS_KEY=secret")
    (folder / "beside.txt").write_text("beside")
    path = folder / "reward_function.py"
    with socket.create_server(("127.0.0.1", 0)) as server:
        places = {"folder": folder, "elsewhere": elsewhere, "port": server.getsockname()[1]}
        lines = [f"    lambda: {statement.format(**places)},\n" for statement in ATTACKS.values()]
        path.write_text(HEAD + "".join(lines) + "]\n")
        with contextlib.closing(open_reward(path)) as process:
            yield process
    assert (folder / "beside.txt").read_text() == "beside"
    assert not list(folder.glob("new*"))


@isolated
@pytest.mark.parametrize("what", ATTACKS)
def test_an_attack_is_denied_at_its_line(attacker, what):
    number = 1 + list(ATTACKS).index(what)
    line = HEAD.count("\n") + number
    with pytest.raises(RewardError, match=rf"reward_function\.py:({line}|6): .* raised ") as denied:
        attacker.call({"steps": number})
    assert re.search("PermissionError|MemoryError|start new thread|not allowed to raise", str(denied.value))
    assert attacker.call({"steps": 0}) == 1.0, "the process goes on"


@isolated
def test_secrets_of_the_environment_are_not_there(opened, monkeypatch):
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
    text = body("assert 'secret' not in str(dict(__import__('os').environ))")
    assert opened(text).call(PARAMS) == 1.0
    with pytest.raises(RewardError, match="AssertionError"):
        opened(text, is_trusted=True).call(PARAMS)


FORGERIES = [
    "import racecraft.formats.run_folder as m; m.METRICS = 'forged'",
    "import builtins as m; m.METRICS = 'forged'",
]


@pytest.mark.parametrize("statement", FORGERIES)
def test_modules_of_the_training_are_out_of_reach(opened, statement):
    """Whoever reaches them writes what metrics say; those of the process are its own."""
    assert opened(body(statement), is_trusted=True).call(PARAMS) == 1.0
    assert getattr(run_folder, "METRICS", "") != "forged"
    assert not hasattr(builtins, "METRICS")


def test_a_limit_that_the_function_lifts_for_itself_still_holds(opened):
    lifted = "import racecraft.worlds.deepracer.files.reward_file as m; m.MAX_REWARD = 1e12; return 1e9"
    with pytest.raises(RewardError, match="expected 1 numbers from -1e5 to 1e5"):
        opened(body(lifted)).call(PARAMS)


def test_whoever_is_trusted_may_write(opened, tmp_path):
    reward = opened(body(f"open({str(tmp_path / 'new.txt')!r}, 'w').write('mine')"), is_trusted=True)
    assert (reward.call(PARAMS), reward.layers) == (1.0, ())
    assert (tmp_path / "new.txt").read_text() == "mine"


@isolated
def test_what_was_denied_is_said_with_the_way_out(opened):
    with pytest.raises(RewardError, match=r"PermissionError.* `racecraft train --trust-reward` gives it"):
        opened(body("open('/etc/passwd')")).call(PARAMS)
