"""The notebooks of AWS's two articles, cell by cell: what a reader types, what is said to him, and where it ends."""

import os
import re
import subprocess
import sys

import pytest
from tests.compat.articles import snake_cells, unity_cells, unity_script, write_notebook
from tests.compat.guessing import TWO_POLICIES, script
from tests.jobs.conftest import home  # noqa: F401

from racecraft.compat.undefined_names import HINTS, unset_names

GIVEN = """import sagemaker, boto3
from sagemaker.rl import RLEstimator, RLToolkit
sage_session = sagemaker.session.Session()
s3_output_path = "s3://" + sage_session.default_bucket()
role, job_name_prefix = sagemaker.get_execution_role(), "snake"
image_name = gpu_image_name = cpu_image_name = "any"
default_subnets, default_security_groups = [], []"""
ENDED = """primary_estimator.latest_training_job.wait()
jobs = [estimator, primary_estimator, secondary_estimator]
[job.latest_training_job.describe()["TrainingJobStatus"] for job in jobs]"""
ASKED = """predictor = primary_estimator.deploy(initial_instance_count=1, instance_type="ml.c5.xlarge")
predictor.predict({"instances": [[1.0, 0.0]]})"""
SMALL = """
import json, os
config["num_workers"] = 1
said = json.loads(os.environ["SM_HPS"])
assert said["num_agents"] == 5
"""


@pytest.fixture
def reader(tmp_path, home, monkeypatch):  # noqa: F811
    """Runs a notebook of cells in a folder with a script for snakes; returns its code and what it said."""
    for folder in ("rllib_src", "battlesnake_gym", "src"):
        (tmp_path / folder).mkdir()
    (tmp_path / "rllib_src" / "train-mabs.py").write_text(script(more=TWO_POLICIES + SMALL))

    def read(*cells, **variables):
        write_notebook(tmp_path / "article.ipynb", cells)
        ran = subprocess.run(
            [sys.executable, "-m", "racecraft", "run", "article.ipynb"], cwd=tmp_path, timeout=900, check=False,
            env={**os.environ, **variables}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        return ran.returncode, ran.stdout

    return read


def test_what_an_article_leaves_out_is_said_before_the_first_cell_and_where_it_ends(reader):
    single = "estimator = RLEstimator(entry_point='train-mabs.py', train_instance_count=1)"
    second = "secondary_estimator = RLEstimator(entry_point='train-mabs.py', train_max_run=secondary_max_run_tim)"
    code, said = reader("print('begun')", single, second)
    assert code == 2
    before, _, behind = said.partition("begun")
    named = re.findall(r"cell (\d): nothing sets (\w+)\. ", before)
    assert ("2", "RLEstimator") in named
    assert ("3", "secondary_max_run_tim") in named
    assert {name for _, name in named} <= set(HINTS)
    letter = r"\nracecraft: article\.ipynb, cell 2:\d+: nothing sets RLEstimator\. Write: from sagemaker\.rl import "
    assert re.match(letter, behind), "a letter, and no traceback"


def test_names_are_told_where_they_stand_and_only_those_that_nothing_sets():
    cells = (
        "import os as system\ndef f(x):\n    global late\n    late = x",
        "[a for a in late]\nprint(missing, system)",
        "try:\n    pass\nexcept OSError as error:\n    error\nmissing",
        "class A:\n    def g(self): return gone",
    )
    assert list(unset_names(cells)) == [(1, "missing"), (3, "gone")]
    assert list(unset_names(["from os import *", "path, nothing"])) == []
    assert list(unset_names(["!ls", "x"])) == [(1, "x")]


@pytest.mark.long
def test_the_article_on_snakes_runs_once_its_names_are_set(reader):
    """Its cells as printed, with 2 iterations and not 5000; the script is ours, for theirs is TensorFlow's."""
    printed = [cell.replace("NUM_ITERATION = 5000", "NUM_ITERATION = 2") for cell in snake_cells()]
    code, said = reader(*printed)
    assert code == 2
    assert "nothing sets RLEstimator. Write:" in said
    before = said.partition("\nracecraft: ")[0]
    assert set(re.findall(r"nothing sets (\w+)\. ", before)) == {*re.findall(r"nothing sets (\w+)", before)}, (
        "all hinted"
    )
    figures = "primary_max_run_time = secondary_max_run_tim = 600\n"
    figures += "secondary_cluster_instance_count = secondary_instance_count"
    code, said = reader(GIVEN, *printed[:3], figures, printed[3], ENDED, ASKED, "predictor.delete_endpoint()")
    assert code == 0, said
    assert "['Completed', 'Completed', 'Completed']" in said


@pytest.mark.long
def test_the_article_on_unity_runs_to_a_policy_that_answers(reader, tmp_path):
    """As printed, with the two names that it does not set; then what it tells of in words: curve, endpoint, its end."""
    pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")
    (tmp_path / "src" / "train-unity.py").write_text(unity_script())
    away = {"RACECRAFT_UNITY_MANIFEST": str(tmp_path / "no-manifest.yaml")}
    code, said = reader(*unity_cells(), **away)
    assert code == 2
    assert "nothing sets RLEstimator. Write: from sagemaker.rl import RLEstimator, RLToolkit" in said
    set_up, job = unity_cells()
    own = "from sagemaker.rl import RLEstimator, RLToolkit\ncustom_image_name = 'unity'"
    wait = "estimator.latest_training_job.wait()\nestimator.latest_training_job.describe()['TrainingJobStatus']"
    curve = "estimator.training_job_analytics.dataframe().plot(x='timestamp', y='value')"
    asked = "predictor = estimator.deploy(1, 'local')\npredictor.predict({'instances': [[0.0] * 20]})"
    code, said = reader(set_up, own, job, wait, curve, asked, "predictor.delete_endpoint()", **away)
    assert code == 0, said
    assert "\n'Completed'\n" in said
    assert float(re.findall(r"episode_reward_mean: (\S+)", said)[-1]) > 0.9
    assert "'probabilities'" in said
    assert (tmp_path / "article-cell-5.png").is_file()
