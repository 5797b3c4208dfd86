"""Notebooks run from their first cell to their last; AWS's own too, where somebody has them.

RACECRAFT_SAGEMAKER_EXAMPLES   the folder reinforcement_learning of aws/amazon-sagemaker-examples before June 2024
"""

import json
import os
import re
import shutil
import sys
from pathlib import Path

import pytest

from racecraft.compat import shims
from racecraft.compat.notebooks import cells_of
from racecraft.compat.shims import run_script
from racecraft.contract.errors import InputFileError, SettingError

EXAMPLES = os.environ.get("RACECRAFT_SAGEMAKER_EXAMPLES")


@pytest.fixture
def notebook(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))

    def write(*cells):
        told = [{"cell_type": "markdown", "source": ["# First"]}]
        told += [{"cell_type": "code", "source": cell.splitlines(keepends=True)} for cell in cells]
        (tmp_path / "n.ipynb").write_text(json.dumps({"cells": told}))
        return tmp_path / "n.ipynb"

    return write


def test_cells_share_one_main_and_last_lines_are_shown(notebook, capsys):
    path = notebook(
        "import sys\nclass Kept: pass\nx = 2", "x += 1\nx", "display(x)\nNone", "Kept.__module__, sys.argv[1]"
    )
    main = sys.modules["__main__"]
    run_script(path, ["--own", "words"])
    assert capsys.readouterr().out == "3\n3\n('__main__', '--own')\n"
    assert sys.modules["__main__"] is main


def test_magic_goes_and_what_a_shell_would_be_asked_is_said(notebook, capsys, tmp_path):
    run_script(notebook(
        "%%time\n%matplotlib inline\nif True:\n    !touch made\nprint('ran')",
        "%%bash\ntouch made", "found = !ls\nlen(found)", "%%writefile made.py\nx = '%d' % 3\n",
        "print('''\n!kept\n''')",
    ))  # fmt: skip
    said = capsys.readouterr().out
    assert "- not run: touch made\nran\n- not run: %%bash\n- not run: ls\n0\n" in said
    assert "\n!kept\n" in said, "a text that only looks like it is left alone"
    assert (tmp_path / "made.py").read_text() == "x = '%d' % 3\n"
    assert not (tmp_path / "made").exists()


def test_what_a_cell_draws_is_kept(notebook, tmp_path):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.close("all")  # what another test left open would be drawn into
    run_script(notebook("%matplotlib inline\nimport matplotlib.pyplot as plt\nplt.plot([1, 2])\nplt.figure()"))
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["n-cell-2-2.png", "n-cell-2.png"]


def test_a_cell_that_fails_ends_it_and_is_named_or_is_told_and_gone_on_from(notebook, capsys):
    path = notebook("print(1)", "1 / 0", "print(3)")
    with pytest.raises(ZeroDivisionError) as told:
        run_script(path)
    assert "in cell 3 of n.ipynb" in told.value.__notes__
    assert capsys.readouterr().out == "1\n"
    with pytest.raises(SettingError, match="cell 3 failed, as told above; the others were run"):
        run_script(path, goes_on=True)
    assert "- ZeroDivisionError: division by zero\n  in cell 3 of n.ipynb\n3\n" in capsys.readouterr().out


@pytest.mark.parametrize("text", ['{"cells": [3]}', "import sys"])
def test_what_is_no_notebook_is_refused(tmp_path, text):
    (tmp_path / "n.ipynb").write_text(text)
    with pytest.raises(InputFileError, match="expected a notebook"):
        list(cells_of(tmp_path / "n.ipynb"))


def test_names_of_ipython_are_lent_where_there_is_none(notebook, capsys):
    run_script(notebook("from IPython.display import HTML, display\nfrom IPython import get_ipython\nHTML(data='<b>')"))
    assert "HTML" in capsys.readouterr().out


@pytest.mark.parametrize("named", [None, "AWS_PROFILE"])
def test_a_boto3_without_credentials_is_ours(tmp_path, monkeypatch, named):
    for name in (*shims.CREDENTIALS, "AWS_SHARED_CREDENTIALS_FILE", "AWS_CONFIG_FILE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr(shims.PathFinder, "find_spec", lambda name: type("Spec", (), {"origin": "/else/where.py"}))
    if named:
        monkeypatch.setenv(named, "me")
    assert ("boto3" in shims._lent()) == (named is None)


def test_what_a_job_left_is_found_in_its_bucket(notebook, tmp_path, monkeypatch, capsys):
    for name in shims.CREDENTIALS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "jobs" / "mine" / "output").mkdir(parents=True)
    (tmp_path / "jobs" / "mine" / "output" / "model.tar.gz").write_bytes(b"x")
    (tmp_path / "jobs" / "mine" / "opt" / "ml" / "output" / "intermediate").mkdir(parents=True)
    (tmp_path / "jobs" / "mine" / "opt" / "ml" / "output" / "intermediate" / "rl_out.mp4").write_bytes(b"film")
    cells = (
        "import boto3, sagemaker\nname = sagemaker.session.Session().default_bucket()",
        "s3 = boto3.Session().resource('s3')",
        "sorted(one.key for one in s3.Bucket(name).objects.filter(Prefix='mine/output/'))",
        "for one in s3.Bucket(name).objects.filter(Prefix='mine/output/intermediate'):\n"
        "    one.Object().download_file('film.mp4')",
        "s3.Bucket(name).upload_file('film.mp4', 'up/film.mp4')\nlen(list(s3.Bucket(name).objects.all()))",
    )
    run_script(notebook(*cells))
    assert capsys.readouterr().out == "['mine/output/intermediate/rl_out.mp4', 'mine/output/model.tar.gz']\n1\n"
    assert (tmp_path / "film.mp4").read_bytes() == b"film"
    with pytest.raises(SettingError, match=r"boto3.resource\('ec2'\)"):
        run_script(notebook("import boto3\nboto3.resource('ec2')"))


@pytest.mark.long
@pytest.mark.skipif(not EXAMPLES, reason="RACECRAFT_SAGEMAKER_EXAMPLES names no copy of the examples")
def test_awss_notebook_of_cartpole_runs_but_for_its_evaluation(notebook, tmp_path, monkeypatch, capsys):
    """Its evaluation asks the command line of AWS for a copy, and RLlib itself to play."""
    for name in shims.CREDENTIALS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    shutil.copytree(Path(EXAMPLES) / "rl_cartpole_ray", tmp_path / "there")
    shutil.copytree(Path(EXAMPLES) / "common", tmp_path / "there" / "common", dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path / "there")
    script = tmp_path / "there" / "src" / "train-rl-cartpole-ray.py"
    script.write_text(script.read_text().replace('"training_iteration": 40', '"training_iteration": 1'))
    with pytest.raises(SettingError, match="cell 26 failed"):
        run_script("rl_cartpole_ray_gymEnv.ipynb", goes_on=True)
    said = capsys.readouterr().out
    assert re.search(r"'action_prob': \[0\.\d", said), "what was trained answers at its endpoint"
