"""A world in a package of its own does what ours do, without an edit here: examples/fifth_world, installed and used."""

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from strangers import Stranger, install, run_python  # noqa: E402

EXAMPLE = Path(__file__).parents[1] / "examples" / "fifth_world"
SHORT = ["--stop", "iterations=2", "--set", "rollout.num_worlds=4", "--set", "evaluation.every=2", "--no-pictures"]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """The folder of whoever has installed it, and where it is installed."""
    folder = tmp_path_factory.mktemp("stranger")
    install(EXAMPLE, folder / "site")
    return folder, [folder / "site", EXAMPLE]


@pytest.fixture(scope="module")
def stranger(place):
    folder, path = place
    one = Stranger(path, folder)
    yield one
    one.close()


@pytest.fixture(scope="module")
def run(stranger):
    """A run of it, as its command trains it."""
    stranger("corridor", "train", "--run", "runs/one", *SHORT)
    return "runs/one"


def test_it_stands_in_the_command_line(stranger):
    assert "corridor" in stranger("--help")
    assert "--length" in stranger("corridor", "train", "--help")


def test_it_is_stepped_by_hand(stranger):
    code = """
import numpy as np, racecraft as rc
from racecraft.contract.world import allocate
world = rc.make_world("corridor", num_worlds=2, length=5)
buffers = allocate(world.spec)
world.reset(buffers, seed=1)
for _ in range(2):
    world.step(np.array([[1], [0]]), buffers)
print(buffers.reward[:, 0].tolist(), buffers.observations["place"].ravel().tolist())
"""
    assert stranger(code=code).split("\n")[0] == "[1.0, -0.009999999776482582] [0.5, 0.0]"


def test_it_goes_on_where_it_was(stranger, run):
    told = stranger("corridor", "train", "--run", run, "--resume", "--stop", "iterations=3", "--no-pictures")
    assert "goes on after iteration 2" in told
    refused = stranger("gym", "train", "--run", run, "--resume", expected=2)
    assert "the run is one of `racecraft corridor train`; expected one of `racecraft gym train`" in refused


def test_it_is_trained_and_judged_from_python(stranger, tmp_path):
    code = f"""
import racecraft as rc
trained = rc.train("corridor", length=3, stops="iterations=8", settings={{"evaluation.every": 8}}, quiet=True,
                   run={str(tmp_path / "two")!r})
told = rc.evaluate(trained.run.path, episodes=4)
print(told["episodes"], told["mean_steps"], round(told["mean_return"], 2))
"""
    assert stranger(code=code).split("\n")[0] == "4 1.0 1.0", "the exit is the next cell"


def test_it_is_judged_reported_and_listed(stranger, run):
    judged = json.loads(stranger("evaluate", run, "--episodes", "3", "--json").splitlines()[0])
    assert judged["episodes"] == 3
    assert "report.html" in stranger("report", run)
    assert "num_worlds" in stranger("settings", "--world", "corridor")


def test_it_is_exported(stranger, run, place):
    told = json.loads(stranger("export", run, "--to", "table", "--json").splitlines()[0])
    assert told["file"] == "runs/one/export/table.json"
    assert set(json.loads((place[0] / told["file"]).read_text())) <= {"left", "right"}


def test_it_is_watched(stranger, run):
    code = f"""
import json, urllib.request
from racecraft.formats.run_folder import RunFolder
from racecraft.serving.watch_server import WatchServer
server = WatchServer(RunFolder.open({run!r}))
address = server.start()
told = [json.loads(urllib.request.urlopen(address + "api/" + name).read()) for name in ("run", "curves")]
print(len(told[1]["rows"]) >= 2, told[0])
server.close()
"""
    assert stranger(code=code).startswith("True")


def test_without_its_package_its_runs_are_refused_by_name(place, run):
    code = f"""
import sys
sys.path[:] = [part for part in sys.path if "fifth_world" not in part]
import racecraft as rc
rc.evaluate({run!r})
"""
    folder, path = place
    told = run_python(code, path=path, folder=folder, expected=1)
    assert "found a Corridor run; the package fifth_world is not installed" in told


def test_it_may_be_a_job(stranger):
    code = """
from racecraft.formats.job_spec import _is_command
print([_is_command([word]) for word in ("corridor", "train", "gym", "dr", "serve", "tracks")])
"""
    assert stranger(code=code).splitlines()[0] == "[True, True, True, True, True, False]"
