"""`RLEstimator` as notebooks use it: real jobs of scripts that take no time, and one that trains and is deployed."""

import json
import os
import tarfile

import numpy as np
import pytest
from tests.compat.test_sagemaker_scripts import CART

from racecraft.contract.errors import SettingError
from racecraft.estimator import RLEstimator, RLFramework, RLToolkit, Session, UnexpectedStatusException
from racecraft.jobs.hyperparameters import as_arguments, check_overrides, decoded, encoded
from racecraft.jobs.store import NameTakenError
from racecraft.sagemaker.container import ChannelError, CodeError
from racecraft.sagemaker.endpoint import EndpointAnswer, EndpointError
from racecraft.sagemaker.model import Model

TOOLKIT = {"toolkit": RLToolkit.RAY, "toolkit_version": "1.6.0", "framework": RLFramework.PYTORCH, "role": "r"}
TELLS = """
import json, os, sys
names = [name for name in os.environ if name.startswith(("SM_", "SAGEMAKER_", "RACECRAFT_TRIAL"))]
told = {"args": sys.argv[1:], "variables": {name: os.environ[name] for name in names}, "here": sorted(os.listdir("."))}
told["inputs"] = sorted(os.listdir(os.environ["SM_CHANNEL_TRAIN"]))
open(os.path.join(os.environ["SM_OUTPUT_DATA_DIR"], "told.json"), "w").write(json.dumps(told))
open(os.path.join(os.environ["SM_MODEL_DIR"], "weights"), "w").write("w")
import neighbour, library
print("episode_reward_mean:", neighbour.REWARD + library.MORE)
"""


@pytest.fixture
def source(tmp_path, home, monkeypatch):
    """A source folder, a dependency, an input; and the test stands beside them."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "train-it.py").write_text(TELLS)
    (tmp_path / "src" / "neighbour.py").write_text("REWARD = 1.5\n")
    (tmp_path / "common" / "library").mkdir(parents=True)
    (tmp_path / "common" / "library" / "__init__.py").write_text("MORE = 2\n")
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "map.json").write_text("{}")
    return tmp_path / "src"


def estimator(**words):
    return RLEstimator(**{"entry_point": "train-it.py", "source_dir": "src", "cores": 1, **TOOLKIT, **words})


def test_a_script_finds_what_it_would_find_at_sagemaker(source, capsys):
    made = estimator(dependencies=["common/library"], hyperparameters={"num_iters": 3, "e": 0.5}, base_job_name="rl_it")
    address = Session().upload_data("data", key_prefix="maps")
    made.fit({"train": address}, experiment_config={"TrialName": "first"})
    job = made.latest_training_job
    assert job.job_name.startswith("rl-it-20")
    assert len(job.job_name) <= 63
    assert "episode_reward_mean: 3.5\n" in capsys.readouterr().out, "fit says what the job says"
    assert [(row["metric_name"], row["value"]) for row in made.training_job_analytics.rows()] == [
        ("episode_reward_mean", 3.5)
    ]
    described = job.describe()
    assert (described["TrainingJobStatus"], described["SecondaryStatus"]) == ("Completed", "Completed")
    assert described["FinalMetricDataList"][0]["Value"] == 3.5
    with tarfile.open(made.model_data) as bundle:
        assert bundle.getnames() == ["weights"]
    with tarfile.open(made.model_data.replace("model.tar", "output.tar")) as bundle:
        told = json.load(bundle.extractfile("data/told.json"))
    assert told["args"] == ["-e", "0.5", "--num_iters", "3"]
    assert told["here"] == ["library", "neighbour.py", "train-it.py"]
    assert told["inputs"] == ["map.json"]
    variables = told["variables"]
    assert json.loads(variables["SM_HPS"]) == {"num_iters": 3, "e": 0.5}
    names = ("SM_HP_NUM_ITERS", "SM_NUM_CPUS", "SM_CURRENT_HOST")
    assert [variables[name] for name in names] == ["3", "1", "algo-1"]
    assert json.loads(variables["SM_CHANNELS"]) == ["train"]
    assert variables["SM_MODEL_DIR"] == os.path.join(variables["SAGEMAKER_BASE_DIR"], "model")
    assert told["variables"]["RACECRAFT_TRIAL"] == "first"


def test_a_script_that_fails_is_told_by_fit_and_in_its_room(source, home):
    (source / "train-it.py").write_text("raise RuntimeError('the env fell over')\n")
    made = estimator()
    with pytest.raises(UnexpectedStatusException, match="Failed. Reason: .*the env fell over"):
        made.fit(logs=False)
    failure = home.folder(made.latest_training_job.name) / "opt" / "ml" / "output" / "failure"
    assert "the env fell over" in failure.read_text()


def test_a_job_goes_on_without_its_notebook_and_is_attached_to(source):
    made = estimator(hyperparameters={"rl.training.config.lr": 1e-4}, max_run=600, dependencies=["common/library"])
    made.fit({"train": "data"}, wait=False, job_name="by-itself")
    with pytest.raises(NameTakenError, match="by-itself"):
        made.fit({"train": "data"}, wait=False, job_name="by-itself")
    again = RLEstimator.attach("by-itself")
    assert again.hyperparameters() == {"rl.training.config.lr": 1e-4, "sagemaker_estimator": "RLEstimator"}
    assert again.max_run == 600
    again.latest_training_job.wait(logs=False)
    assert again.model_data.endswith("by-itself/output/model.tar.gz")


TRAINS = """
import os
import racecraft as rc
rc.train("gymnasium", environment="CartPole-v1", run=os.environ["SM_MODEL_DIR"] + "/run", quiet=True,
         stops="iterations=2", settings={"rollout.horizon": 16, "evaluation.episodes": 1})
"""


def test_what_a_script_trained_is_deployed_asked_and_taken_away(source, home):
    (source / "train-it.py").write_text(TRAINS)
    made = estimator()
    made.fit(logs=False)
    predictors = [made.deploy(1, "ml.t2.medium", endpoint_name="first")]
    told = predictors[0].predict(
        {"inputs": {"observations": np.ones((2, 4)).tolist(), "prev_action": [0, 0], "is_training": False}}
    )
    assert set(told["outputs"]) == {"actions", "action_prob", "action_dist"}
    assert told["outputs"]["actions"][0] in (0, 1)
    alone = predictors[0].predict(np.ones((1, 4)))
    assert alone["predictions"][0]["actions"] == told["outputs"]["actions"][0]
    with pytest.raises(EndpointAnswer, match=r"shape \(1, 3\); expected \(rows, 4\)"):
        predictors[0].predict([[1, 2, 3]])
    address = Session().upload_data(made.model_data, key_prefix="kept")
    assert address == "s3://racecraft-local/kept/model.tar.gz"
    predictors.append(Model(model_data=address, role="r", name="second").deploy(1, "local"))
    assert predictors[0].url != predictors[1].url, "many endpoints, each at a port of its own"
    assert predictors[1].predict(np.ones((1, 4))) == alone
    (source / "inference.py").write_text(
        "import json, os\n\n"
        "def output_fn(prediction, accept):\n    return json.dumps({os.environ['KEY']: prediction.tolist()})\n"
    )
    words = {"entry_point": "inference.py", "source_dir": str(source), "env": {"KEY": "own"}}
    predictors.append(Model(model_data=address, role="r", name="third", **words).deploy(1, "local"))
    (source / "inference.py").unlink()
    assert predictors[2].predict(np.ones((1, 4))) == {"own": told["outputs"]["actions"][:1]}
    for predictor in predictors:
        predictor.delete_endpoint()
        with pytest.raises(EndpointError, match="no endpoint"):
            predictor.predict([[1, 2, 3, 4]])
    assert home.store().find("first") is None


def test_a_model_that_is_not_there_or_served_by_a_function_that_none_calls_is_refused(source):
    with pytest.raises(EndpointError, match=r"model_data is s3://racecraft-local/none\.tar\.gz, and there is no "):
        Model(model_data="s3://racecraft-local/none.tar.gz").deploy()
    (source / "inference.py").write_text("import json\n\ndef transform_fn(model, data, kind, accept):\n    return 1\n")
    with pytest.raises(SettingError, match=r"inference\.py:3: transform_fn is to serve the model"):
        Model(model_data="m.tar.gz", entry_point="inference.py", source_dir=str(source))
    with pytest.raises(SettingError, match=r"inference\.py:3: transform_fn"):
        estimator().deploy(1, "local", entry_point=str(source / "inference.py"))


def test_what_is_no_policy_of_ours_is_not_deployed(source):
    made = estimator(dependencies=["common/library"])
    made.fit({"train": "data"}, logs=False)
    with pytest.raises(EndpointError, match="holds weights; expected a run folder"):
        made.deploy()


def test_names_of_both_versions_mean_the_same(source):
    first = estimator(train_max_run=60, train_use_spot_instances=True, train_max_wait=120, train_instance_type="local")
    second = estimator(max_run=60, use_spot_instances=True, max_wait=120, instance_type="local")
    assert vars(first)["max_run"] == second.max_run == 60
    assert (first.max_wait, first.use_spot_instances) == (second.max_wait, second.use_spot_instances) == (120, True)
    assert first.recorded["instance_type"] == second.recorded["instance_type"] == "local"


@pytest.mark.parametrize(
    ("words", "error", "letter"),
    [
        ({"source_dirr": "src"}, SettingError, "Did you mean 'source_dir'"),
        ({"max_run": 60, "max_wait": 30}, SettingError, "max_wait 30 is less than max_run 60"),
        ({"toolkit": None}, AttributeError, "toolkit missing"),
        ({"entry_point": "train.py"}, CodeError, "There are: neighbour.py, train-it.py"),
        ({"hyperparameters": {"rl.training.stop.time_totl_s": 1}}, SettingError, "Did you mean 'time_total_s'"),
    ],
)
def test_what_cannot_be_meant_is_said_before_anything_runs(source, words, error, letter):
    with pytest.raises(error, match=letter):
        estimator(**words)


def test_an_input_that_is_not_there_is_told_before_a_job_is_made(source, home):
    with pytest.raises(ChannelError, match="channel 'train' names s3://nobody/data"):
        estimator().fit({"train": "s3://nobody/data"})
    assert home.store().jobs() == []


def test_of_a_dependency_with_a_slash_behind_it_lies_what_it_holds(source, home):
    """As the SDK packs it, and the starter pack's notebook counts on it; a package stays one, as its article has it."""
    (source / "train-it.py").write_text(
        "import library, neighbour, package\nprint('sum', library.MORE + neighbour.REWARD)"
    )
    (source.parent / "package").mkdir()
    for name in ("__init__", "neighbour"):
        (source.parent / "package" / f"{name}.py").touch()
    made = estimator(dependencies=["common/", "package/"])
    assert [one.rpartition("/")[0][-7:] for one in RLEstimator(**made.words()).dependencies] == ["/common", "package"]
    made.fit(job_name="slash")
    assert "sum 3.5" in home.log("slash").read_text()


def test_hyperparameters_travel_as_sagemakers_toolkit_has_them():
    told = {"num_iters": 10, "greedy": True, "layers": [1, 2], "name": "x", "sagemaker_program": "t.py"}
    assert decoded(encoded(told)) == told
    assert encoded(told)["name"] == '"x"'
    assert as_arguments(told) == ["--greedy", "True", "--layers", "[1, 2]", "--name", "x", "--num_iters", "10"]


def test_overrides_of_the_public_notebooks_are_known():
    seen = ["rl.training.config.num_workers", "rl.training.config.num_gpus", "rl.training.config.kl_coeff"]
    seen += ["rl.training.config.num_sgd_iter", "rl.training.stop.time_total_s", "rl.training.config.env_config.size"]
    seen += ["rl.agent_params.algorithm.discount", "num_agents", "rl_cluster_type"]
    assert check_overrides(dict.fromkeys(seen, 1)) == ()


@pytest.mark.long
def test_a_primary_and_a_secondary_are_two_jobs(source, home):
    """As AWS's article prints it: the primary is waited for, then the secondary begins; both end by themselves."""
    (source / "train-it.py").write_text(CART)
    shared = {"s3_bucket": "b", "s3_prefix": "p", "rl_num_instances_secondary": 2}
    stop = {"rl.training.stop.training_iteration": 3}
    more = {"cores": None, "base_job_name": "one"}
    primary = estimator(hyperparameters={**shared, **stop, "rl_cluster_type": "primary"}, **more)
    secondary = estimator(hyperparameters={**shared, "rl_cluster_type": "secondary"}, **more)
    primary.fit(logs=False)
    secondary.fit(logs=False)
    for made in (primary, secondary):
        assert made.latest_training_job.describe()["TrainingJobStatus"] == "Completed"
    assert "the primary trained with all cores" in home.log(secondary.latest_training_job.name).read_text()
    assert len(primary.training_job_analytics.dataframe()) > 0
