"""What a lent function is given and nobody knows is refused with the nearest name and the script's line."""

import inspect
from pathlib import Path

import pytest
from tests.jobs.conftest import home  # noqa: F401

from racecraft.compat.shims import foreign_names, run_script
from racecraft.compat.source_lines import line_of_word
from racecraft.contract.errors import UserInputError

ESTIMATOR = """from sagemaker.rl import RLEstimator
words = dict(
    toolkit="ray",
    toolkit_version="1.6.0",
    framework="pytorch",
)
e = RLEstimator("train.py", **words)
"""
TYPED_WRONG = [
    ("import ray\nray.init(num_cpuss=2)", 2, "ray.init has no argument 'num_cpuss'. Did you mean 'num_cpus'?"),
    ("from ray.tune import run_experiments\nrun_experiments(['PPO'])", 2, "is given a list; expected {name: {'run'"),
    ("import boto3\nboto3.client('s3', region='x')", 2, "Did you mean 'region_name'?"),
    (
        "import boto3\nc = boto3.client(service_name='sagemaker')\nc.describe_training_job(\n  JobName='x')",
        3,
        "describe_training_job has no argument 'JobName' here. Did you mean 'TrainingJobName'?",
    ),
    ("import sagemaker\nsagemaker.Session().upload_data(bukket='x')", 2, "upload_data missing 1 required positional"),
    (ESTIMATOR + "e.fit(waits=False)", 8, "fit has no argument 'waits' here. Did you mean 'wait'?"),
    (ESTIMATOR.replace("toolkit=", "tolkit="), 3, "RLEstimator has no 'tolkit'. Did you mean 'toolkit'?"),
    (ESTIMATOR.replace("1.6.0", "1.6.1"), 7, "there was no ray 1.6.1 at SageMaker; expected 0.5.3"),
    (
        ESTIMATOR.replace(")\ne", "    hyperparameters={\n        'rl.training.config.lrr': 1},\n)\ne"),
        7,
        "hyperparameter 'rl.training.config.lrr': RLlib's configuration has no 'lrr'. Did you mean 'lr'?",
    ),
]
NOT_THERE = "from sagemaker.rl import RLEstimator\nmeant = 'toolkit'\n" + "RLEstimator('train.py', tolkitt=1)"
TYPED_WRONG += [
    (NOT_THERE, 3, "RLEstimator has no 'tolkitt'. Did you mean 'toolkit'?"),
    ("from ray import tune\ntune.grid_search([1])", 2, "ray.tune.grid_search searches, and a script"),
    ("import tf_slim as slim\nslim.fully_connected(1)", 2, "tf_slim.fully_connected: its networks are TensorFlow's"),
    (ESTIMATOR.replace('    framework="pytorch",\n', ""), 6, "RLEstimator: framework missing; expected them all"),
    (
        ESTIMATOR.replace(")\ne", "    max_run=3,\n    train_max_run=4,\n)\ne"),
        9,
        "max_run and train_max_run are one word",
    ),
]
OWN = [
    ("def init(a): pass\ninit(b=1)", TypeError),
    ("class A:\n    def f(self): pass\nA().f(x=1)", TypeError),
    ("import sagemaker\nlen(sagemaker)", TypeError),
]


@pytest.fixture(autouse=True)
def here(tmp_path, home, monkeypatch):  # noqa: F811
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(("code", "line", "said"), TYPED_WRONG)
def test_an_argument_typed_wrong_is_told_with_the_nearest_and_the_script_s_line(code, line, said):
    Path("train.py").write_text(code)
    with pytest.raises(UserInputError) as told:
        run_script("train.py")
    assert str(told.value).startswith(f"train.py:{line}: "), str(told.value)
    assert said in str(told.value)


@pytest.mark.parametrize(("code", "raised"), OWN)
def test_a_call_of_the_script_s_own_is_left_as_python_tells_it(code, raised):
    Path("train.py").write_text(code)
    with pytest.raises(raised):
        run_script("train.py")


def test_what_the_original_takes_is_taken_and_what_it_would_have_changed_is_said(capsys):
    Path("train.py").write_text(
        "import boto3, ray, sagemaker\n"
        "ray.init(address='10.0.0.5:6379', num_cpus=2, include_webui=False, _memory=3)\nray.init('local')\n"
        "s = sagemaker.Session(boto3.Session(region_name='eu-west-1'), default_bucket='snakes')\n"
        "print(s.default_bucket(), boto3.client('s3', verify=False).list_buckets()['Buckets'])\n"
    )
    run_script("train.py")
    said = capsys.readouterr().out
    assert said.count("- ray.init: no cluster is joined at 10.0.0.5:6379") == 1
    assert "at local" not in said
    assert "snakes [{'Name': 'snakes'}]" in said


def test_no_lent_function_swallows_what_it_does_not_know():
    """Whoever takes any argument refuses by a table; `gym.make` hands them on, and what is shown is shown anyhow."""
    with foreign_names():
        import boto3
        import ray
        import sagemaker.tensorflow
        import sagemaker.tuner

        modules = (boto3, ray, ray.tune, sagemaker, sagemaker.analytics, sagemaker.tensorflow, sagemaker.tuner)
        takers = {
            name: one
            for module in modules
            for name, one in vars(module).items()
            if getattr(one, "__module__", "").startswith(("racecraft.compat.names", "racecraft.jobs"))
            and callable(one)
            and not (isinstance(one, type) and issubclass(one, Exception))
            and any(part.kind is part.VAR_KEYWORD for part in inspect.signature(one).parameters.values())
        }
        for one in takers.values():
            asks = inspect.signature(one).parameters.values()
            needed = [part for part in asks if part.default is part.empty and part.kind is not part.VAR_KEYWORD]
            with pytest.raises(UserInputError, match="has no argument 'nobody_knows'"):
                one(*["s3"] * len(needed), nobody_knows=1)
    assert set(takers) >= {"init", "run", "run_experiments", "client", "resource", "Session", "TensorFlowModel"}


def test_a_word_s_line_is_told_only_where_it_stands_once(tmp_path):
    file = tmp_path / "words.py"
    file.write_text("a = 'lr'\nb = dict(gamma=1)\nc = 'twice'\nd = 'twice'\n")
    assert [line_of_word(str(file), word) for word in ("lr", "gamma", "twice", "none")] == [1, 2, None, None]
