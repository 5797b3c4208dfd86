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
FIGURES = "primary_max_run_time = secondary_max_run_tim = 600\nsecondary_cluster_instance_count = 2"
ENDED = """primary_estimator.latest_training_job.wait()
jobs = [estimator, primary_estimator, secondary_estimator]
[job.latest_training_job.describe()["TrainingJobStatus"] for job in jobs]"""
CURVE = """%matplotlib inline
from sagemaker.analytics import TrainingJobAnalytics
name = primary_estimator.latest_training_job.job_name
TrainingJobAnalytics(name, ["episode_reward_mean"]).dataframe().plot(x="timestamp", y="value")"""
ASKED = """predictor = primary_estimator.deploy(initial_instance_count=1, instance_type="ml.c5.xlarge")
predictor.predict({"instances": [[1.0, 0.0]]})"""
SMALL = """
import json, os
config["num_workers"] = 1
said = json.loads(os.environ["SM_HPS"])
assert said["num_agents"] == 5
"""
COMMON = """
shared = dict(
    entry_point="train-mabs.py", source_dir="rllib_src", dependencies=["rllib_common/sagemaker_rl", "battlesnake_gym/"],
    role=role, output_path=s3_output_path, base_job_name=job_name_prefix,
    metric_definitions=RLEstimator.default_metric_definitions(RLToolkit.RAY),
)
size = {"num_iters": 2, "num_agents": 5}
"""
SINGLE = """
estimator = RLEstimator(
    image_name=image_name, train_instance_type="ml.m5.xlarge", train_instance_count=1, **shared,
    hyperparameters={**size, "rl.training.config.num_gpus": 0, "rl.training.config.num_cpus": 3},
)
estimator.fit()
"""
PAIR = """
meeting = {"s3_prefix": "<a prefix>", "s3_bucket": sage_session.default_bucket(),
           "aws_region": boto3.Session().region_name}
vpc = {"subnets": default_subnets, "security_group_ids": default_security_groups}
primary_estimator = RLEstimator(
    image_name=gpu_image_name, train_instance_type="ml.p2.xlarge", train_instance_count=1, **shared, **vpc,
    train_max_run=primary_max_run_time,
    hyperparameters={**size, **meeting, "rl_cluster_type": "primary",
                     "rl_num_instances_secondary": secondary_cluster_instance_count,
                     "rl.training.config.num_workers": 3, "rl.training.config.num_gpus": 1},
)
primary_estimator.fit()
secondary_estimator = RLEstimator(
    image_name=cpu_image_name, train_instance_type="ml.m5.xlarge", train_instance_count=2, **shared, **vpc,
    train_max_run=secondary_max_run_tim, hyperparameters={**size, **meeting, "rl_cluster_type": "secondary"},
)
secondary_estimator.fit()
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
    code, said = reader("print('begun')", SINGLE, PAIR)
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
def test_snakes_of_one_machine_and_of_two_clusters_end_with_a_policy_that_answers(reader, tmp_path):
    code, said = reader(GIVEN, COMMON, SINGLE, FIGURES, PAIR, ENDED, CURVE, ASKED, "predictor.delete_endpoint()")
    assert code == 0, said
    assert "num_cpus means nothing to RLlib" in said
    assert "['Completed', 'Completed', 'Completed']" in said
    assert "'predictions'" in said
    assert (tmp_path / "article-cell-7.png").is_file()


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
