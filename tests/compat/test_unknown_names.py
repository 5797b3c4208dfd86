"""A script that asks for what nobody has ends in a letter with its own line; its own mistakes are told by Python."""

import json
from pathlib import Path

import pytest
from tests.forked import ran

from racecraft.compat.shims import run_script
from racecraft.compat.unknown_names import UnknownNameError
from racecraft.contract.errors import SettingError

LENDS = "`racecraft run` lends no "
UNKNOWN = [
    ("from sagemaker.rl import RLEstimater", LENDS + "sagemaker.rl.RLEstimater. Did you mean 'RLEstimator'?"),
    ("import ray.rllib.agents.dream", LENDS + "module ray.rllib.agents.dream. Of ray.rllib.agents: Known: cal"),
    ("import sagemaker.rl.deeper.still", LENDS + "module sagemaker.rl.deeper. sagemaker.rl is no package here."),
    ("from ray import tune\ntune.runn('PPO')", LENDS + "ray.tune.runn. Did you mean 'run'?"),
    ("import sagemaker\nsagemaker.session.Session().default_buckett()", "Did you mean 'default_bucket'?"),
    ("import racecraft\nracecraft.trian()", "racecraft has no trian. Did you mean 'train'?"),
    ("import rayy", "Did you mean 'ray'? If not, install it beside racecraft: pip install rayy"),
    ("import nieghbour", "none stands beside the script and none is installed. Did you mean 'neighbour'?"),
    ("import numpy.nothing", "the numpy that is installed has no module numpy.nothing"),
    ("\nprint(primary_max_run_time)", "nothing sets primary_max_run_time. Set it, in seconds."),
    ("import gym\ngym.make('CartPole-v99')", "Environment version `v99` for environment `CartPole` doesn't exist"),
]
GETS = "def __getattr__(self, name): return self.of(name)"
RAISES = "def of(self, name): raise AttributeError(name)"
OWN = [
    ("print(nobody)", NameError),
    ("from json import nothing", ImportError),
    (f"class A:\n    {GETS}\n    {RAISES}\nA().x", AttributeError),
    ("import shutil, sagemaker\nshutil.copyfileobj(sagemaker, sagemaker)", AttributeError),
]


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "neighbour.py").touch()


@pytest.mark.parametrize(("code", "said"), UNKNOWN)
def test_what_nobody_has_is_named_with_the_script_s_line(code, said):
    Path("train.py").write_text(code)
    with pytest.raises(UnknownNameError) as told:
        run_script("train.py")
    letter = str(told.value)
    assert letter.startswith(f"train.py:{code.count(chr(10)) + 1}: ")
    assert said in letter
    assert "racecraft.compat" not in letter, "our own names are nobody's business"


@pytest.mark.parametrize(("code", "raised"), OWN)
def test_a_mistake_of_the_script_s_own_is_left_as_python_tells_it(code, raised):
    Path("train.py").write_text(code)
    with pytest.raises(raised) as told:
        run_script("train.py")
    assert not isinstance(told.value, UnknownNameError)


def test_a_name_asked_for_in_a_module_beside_the_script_is_told_by_that_module_s_line():
    Path("helper.py").write_text("import json\nfrom ray.tune import nothing\n")
    Path("train.py").write_text("import helper\n")
    with pytest.raises(UnknownNameError, match=r"^helper\.py:2: "):
        run_script("train.py")


def test_a_script_that_expects_an_unknown_name_goes_on():
    Path("train.py").write_text(
        "import pathlib, sagemaker\n"
        "try:\n    import ray.nothing\nexcept ImportError as error:\n    pathlib.Path('said').write_text(error.name)\n"
        "assert not hasattr(sagemaker, 'nothing')\n"
    )
    run_script("train.py")
    assert Path("said").read_text() == "ray.nothing"


@pytest.mark.parametrize("words", [(), ("--allow-errors",)])
def test_a_notebook_names_the_cell(words, capsys):
    cells = [
        {"cell_type": "code", "source": source} for source in ("print(1)", "import sagemaker\nsagemaker.roll", "2 + 2")
    ]
    Path("n.ipynb").write_text(json.dumps({"cells": cells}))
    letter = "n.ipynb, cell 2:2: `racecraft run` lends no sagemaker.roll. "
    with pytest.raises((UnknownNameError, SettingError)) as told:
        run_script("n.ipynb", goes_on=bool(words))
    assert (f"- {letter}" in capsys.readouterr().out) if words else str(told.value).startswith(letter)


@pytest.mark.parametrize(("code", "status", "said"), [("import rayy", 2, ""), ("1 / 0", 1, "Traceback")])
def test_the_command_ends_with_a_letter_or_with_the_script_s_own_traceback(code, status, said):
    Path("train.py").write_text(code)
    done = ran(["run", "train.py"], Path.cwd())
    assert done.returncode == status
    assert done.stderr.startswith(said or "racecraft: train.py:1: there is no module rayy: ")
    assert ("Traceback" in done.stderr) is bool(said)
    assert "racecraft/" not in done.stderr, "no line of ours"
