"""Launcher scripts of SageMaker RL run unchanged, AWS's own article among them; their words are translated."""

import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from tests.compat.articles import unity_script
from tests.forked import ran

from racecraft.compat import script_models
from racecraft.compat.old_gym import FromOldGym
from racecraft.compat.rllib_config import translated
from racecraft.compat.rllib_defaults import MODEL, MULTIAGENT, defaults_of
from racecraft.compat.rllib_words import words_of
from racecraft.compat.secondary_jobs import PrimaryMissingError, primary_lock, wait_for_primary
from racecraft.compat.shims import run_script
from racecraft.contract.errors import EnvironmentFailedError, SettingError
from racecraft.formats.run_folder import RunFolder
from racecraft.jobs.hyperparameters import CONFIG_WORDS
from racecraft.training.worlds import training_in

CART = """
import gym
from ray.tune.registry import register_env
from sagemaker_rl.ray_launcher import SageMakerRayLauncher
import gymnasium

class Cart(gym.Env):
    def __init__(self, env_config):
        self.cart = gymnasium.make("CartPole-v1")
        self.action_space, self.observation_space = self.cart.action_space, self.cart.observation_space
        print(f"cart {env_config.worker_index} {env_config['size']}\\n", end="")

    def seed(self, seed=None):
        self.next_seed = seed

    def reset(self):
        seen, _ = self.cart.reset(seed=self.next_seed)
        self.next_seed = None
        return seen

    def step(self, action):
        seen, reward, terminated, truncated, info = self.cart.step(action)
        return seen, reward, terminated or truncated, info

class MyLauncher(SageMakerRayLauncher):
    def register_env_creator(self):
        register_env("cart", lambda config: Cart(config))

    def get_experiment_config(self):
        return {"training": {
            "env": "cart", "run": "PPO", "stop": {"training_iteration": 9},
            "config": {"gamma": 0.99, "kl_coeff": 1.0, "num_sgd_iter": 2, "lr": 1e-3, "sgd_minibatch_size": 32,
                       "train_batch_size": 64, "num_workers": 2, "env_config": {"size": 3},
                       "model": {"fcnet_hiddens": [16], "vf_share_layers": False}},
        }}

if __name__ == "__main__":
    MyLauncher().train_main()
"""


@pytest.fixture(autouse=True)
def _away(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("SM_MODEL_DIR", "SM_CHANNEL_TRAIN", "SM_NUM_CPUS"):
        monkeypatch.delenv(name, raising=False)


def test_a_launcher_script_trains_with_its_overrides(tmp_path, monkeypatch, capsys):
    (tmp_path / "train.py").write_text(CART)
    monkeypatch.setenv("SM_MODEL_DIR", str(tmp_path / "model"))
    run_script("train.py", ["--num_agents", "5", "--rl.training.stop.training_iteration", "2"])
    said = capsys.readouterr().out
    assert "- kl_coeff: this PPO clips and has no KL penalty beside it" in said
    assert "cart 1 3" in said
    assert "training_iteration: 2" in said
    assert "training_iteration: 3" not in said
    job = RunFolder.open(tmp_path / "model" / "run").read_job()
    settings = job["settings"]
    assert (settings["ppo"]["discount"], settings["ppo"]["epochs"], settings["ppo"]["batch_size"]) == (0.99, 2, 32)
    assert (settings["rollout"]["num_worlds"], settings["rollout"]["horizon"]) == (2, 32)
    assert settings["network"]["hidden_units"] == [16]
    assert settings["network"]["separate_networks"] is True


def test_an_interrupted_script_goes_on_in_its_model(tmp_path, monkeypatch, capsys):
    (tmp_path / "train.py").write_text(CART)
    monkeypatch.setenv("SM_MODEL_DIR", str(tmp_path / "model"))
    run_script("train.py", ["--rl.training.stop.training_iteration", "1"])
    run_script("train.py", ["--rl.training.stop.training_iteration", "2"])
    assert "goes on after iteration 1" in capsys.readouterr().out
    assert [row["iteration"] for row in RunFolder.open(tmp_path / "model" / "run").read_metrics()] == [1, 2]


PAIR = ("--s3_bucket", "b", "--s3_prefix", "dist/../snake 1")


def run_beside(threads, tmp_path, *words, **variables):
    """Begin `racecraft run train.py` as a process of its own."""
    (tmp_path / "train.py").write_text(CART)
    home = {"RACECRAFT_JOBS": str(tmp_path / "jobs"), **variables}
    return threads.submit(ran, ["run", "train.py", *words], tmp_path, **home)


@pytest.mark.parametrize("first", [pytest.param("primary", marks=pytest.mark.long), "secondary"])
def test_a_secondary_waits_until_its_primary_ends(tmp_path, first):
    model, words = tmp_path / "model", {"secondary": ("--rl_cluster_type", "secondary")}
    words["primary"] = ("--rl_cluster_type", "primary", "--rl_num_instances_secondary", "2")
    words["primary"] += ("--rl.training.stop.training_iteration", "2")
    second = {"primary": "secondary", "secondary": "primary"}[first]
    with ThreadPoolExecutor() as threads:
        jobs = {}
        for role in (first, second):
            jobs[role] = run_beside(threads, tmp_path, *PAIR, *words[role], SM_MODEL_DIR=str(model))
            if role == "primary" and first == "primary":
                assert jobs[role].result().returncode == 0, "a primary needs nobody"
        done = {role: job.result() for role, job in jobs.items()}
    said = {role: one.stdout + one.stderr for role, one in done.items()}
    assert {role: one.returncode for role, one in done.items()} == {"primary": 0, "secondary": 0}, said
    assert "training_iteration: 2" in said["primary"]
    assert "- the primary trained with all cores and ended at" in said["secondary"]
    assert "training_iteration" not in said["secondary"]
    assert "cluster" not in RunFolder.open(model / "run").read_job()
    assert list((tmp_path / "jobs" / "primaries").iterdir()) == [], "the next pair starts anew"


def test_a_secondary_waits_while_its_primary_trains(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))
    words, ended = {"s3_bucket": "b", "s3_prefix": "p"}, []
    lock = primary_lock(words)
    with pytest.raises(SettingError, match="s3_prefix is 'p', and another primary trains with it"):
        primary_lock(words)
    waiting = threading.Thread(target=lambda: ended.append(wait_for_primary(words)))
    waiting.start()
    waiting.join(1.0)
    assert waiting.is_alive()
    lock.release()
    waiting.join(60.0)
    assert ended == [None]
    primary_lock(words).release()
    wait_for_primary(words)  # of one that has ended before: it returns


def test_a_primary_that_never_starts_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))
    with pytest.raises(PrimaryMissingError, match="b-p.lock: no primary started within 0 s"):
        wait_for_primary({"s3_bucket": "b", "s3_prefix": "p"}, seconds=0.0)


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        ({"rl_cluster_type": "tertiary"}, "rl_cluster_type is 'tertiary'; expected primary or secondary"),
        ({"rl_cluster_type": "secondary"}, "expected the same s3_prefix for the primary and the secondary"),
    ],
)
def test_two_jobs_that_could_never_find_each_other_are_refused(tmp_path, words, letter):
    (tmp_path / "train.py").write_text(CART)
    told = [part for name, value in words.items() for part in (f"--{name}", str(value))]
    with pytest.raises(SettingError, match=letter):
        run_script("train.py", told)


def test_a_primary_without_secondaries_trains_alone(tmp_path, capsys):
    (tmp_path / "train.py").write_text(CART)
    alone = ("--rl_cluster_type", "primary", "--rl_num_instances_secondary", "0")
    run_script("train.py", [*alone, "--rl.training.stop.training_iteration", "1"])
    assert "training_iteration: 1" in capsys.readouterr().out


def run_article(tmp_path, *overrides):
    """Run AWS's script; the player is our stand-in over the real wire.

    In a process of its own: the script closes no player, so they stay for as long as its process does.
    """
    pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")
    (tmp_path / "train-unity.py").write_text(unity_script())
    rooms = {"RACECRAFT_UNITY_MANIFEST": str(tmp_path / "no-manifest.yaml"), "SM_NUM_CPUS": "2"}
    done = ran(["run", "train-unity.py", *overrides], tmp_path, **rooms)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    return lines, [float(line.split()[1]) for line in lines if "episode_reward_mean:" in line]


def test_the_article_on_unity_runs(tmp_path):
    lines, means = run_article(tmp_path, "--rl.training.stop.timesteps_total", "1000")
    assert "  timesteps_total: 1000" in lines
    assert len(means) == 2


@pytest.mark.long
def test_the_article_on_unity_learns_its_basic(tmp_path):
    """10,000 steps as printed, to the 0.9 that the article tells of."""
    lines, means = run_article(tmp_path)
    assert "  timesteps_total: 10000" in lines
    assert means[-1] > 0.9


def experiment(**config):
    return {"run": "PPO", "stop": {"timesteps_total": 1000}, "config": {"env": "CartPole-v1", **config}}


@pytest.mark.parametrize(
    ("said", "letter"),
    [
        (experiment(num_sgd_itr=3), "no 'num_sgd_itr' that is understood here. Did you mean 'num_sgd_iter'"),
        ({**experiment(), "run": "IMPALA"}, "'IMPALA'; `racecraft run` understands PPO, APPO, DQN, APEX, SAC, ES"),
        (experiment(lr_schedule=[[0, 1e-3]]), r"lr_schedule is \[\[0, 0.001\]\]; expected None, RLlib's default"),
        ({**experiment(Q_model={"fcnet_hiddens": [8]}), "run": "SAC"}, "Q_model differs from policy_model"),
        ({**experiment(model={"custom_model": "mine"}), "run": "DQN"}, "expected PPO or APPO with a model"),
        ({**experiment(num_atoms=51), "run": "DQN"}, "num_atoms is 51 and noisy is False; expected 1"),
        ({**experiment(exploration_config={"type": "SoftQ"}), "run": "DQN"}, "expected EpsilonGreedy"),
        ({**experiment(exploration_config={"final_epsilon": 1}), "run": "APEX"}, "each in their own degree"),
        ({"run": "PPO", "config": {}}, "config.env is None"),
        ({**experiment(), "stopp": {"training_iteration": 3}}, "an experiment has no 'stopp' .* mean 'stop'"),
        ({**experiment(), "num_samples": 4}, "'num_samples' is 4, which is refused .* `racecraft tune`"),
        ({**experiment(), "stop": 3}, "'stop' is 3; expected words and their values"),
        (experiment(num_workers=1.5), "'num_workers' is 1.5; expected a whole number"),
        (experiment(train_batch_size=-5), "'train_batch_size' is -5; expected a whole number, 1 or more"),
        (experiment(model={"custom_model": "mine"}), "'mine', which nobody gave to .* There is none"),
        (experiment(num_sgd_iter=3, num_epochs=4), "'num_epochs' and num_sgd_iter, which are one word"),
    ],
)
def test_what_is_not_understood_is_said(said, letter, monkeypatch):
    monkeypatch.setattr(script_models, "_registered", {})  # scripts of other tests left theirs
    with pytest.raises(SettingError, match=letter):
        translated(said)


@pytest.mark.parametrize("algorithm", ["ppo", "dqn", "apex", "sac", "es"])
def test_every_word_is_one_that_an_estimator_lets_through_and_every_setting_is_ours(algorithm):
    assert set(words_of(algorithm)) - set(CONFIG_WORDS) == set()
    from racecraft.algorithms.registry import find_algorithm

    groups = training_in("gymnasium").default_settings(find_algorithm(algorithm))
    for word in words_of(algorithm).values():
        group, dot, name = word.setting.partition(".")
        assert not dot or hasattr(getattr(groups, group), name), word


@pytest.mark.parametrize("run", ["PPO", "APPO", "DQN", "APEX", "SAC", "ES"])
def test_every_key_at_rllibs_default_value_passes_and_changes_nothing(run):
    written_out = {**defaults_of(run), "model": dict(MODEL), "multiagent": dict(MULTIAGENT), "env": "CartPole-v1"}
    stop = {"training_iteration": 3}
    silent = translated({"run": run, "stop": stop, "config": {"env": "CartPole-v1"}})
    assert translated({"run": run, "stop": stop, "config": written_out}) == silent
    assert set(written_out) <= set(CONFIG_WORDS)


def test_where_a_script_says_nothing_rllibs_defaults_hold():
    told = translated(experiment())
    assert {"ppo.learning_rate=5e-05", "ppo.epochs=30", "ppo.batch_size=128", "ppo.clip=0.3", "ppo.gae_lambda=1.0",
            "ppo.value_weight=1.0", "ppo.entropy_weight=0.0", "ppo.max_grad_norm=none", "rollout.horizon=2000",
            "network.hidden_units=256,256", "network.activation=tanh",
            "network.separate_networks=true"} <= set(told.settings)  # fmt: skip
    assert told.horizon is None
    assert translated(experiment(lr=1e-3)).settings.index("ppo.learning_rate=0.001") > 0


@pytest.mark.parametrize(("run", "algorithm"), [("DQN", "dqn"), ("APEX", "apex")])
def test_a_script_that_asks_for_values_learns_them(tmp_path, monkeypatch, capsys, run, algorithm):
    words = {"gamma": 0.9, "train_batch_size": 16, "learning_starts": 32, "target_network_update_freq": 64,
             "rollout_fragment_length": 16, "buffer_size": 500, "n_step": 2, "hiddens": [8], "num_workers": 2,
             "timesteps_per_iteration": 64,
             "model": {"fcnet_hiddens": [16]}, "env_config": {"size": 3}}  # fmt: skip
    before, _, rest = CART.replace('"run": "PPO"', f'"run": "{run}"').partition('"config": ')
    text = f'{before}"config": {words!r}}}}}\n{rest[rest.index("if __name__") :]}'
    (tmp_path / "train.py").write_text(text)
    monkeypatch.setenv("SM_MODEL_DIR", str(tmp_path / "model"))
    run_script("train.py", ["--rl.training.stop.training_iteration", "4"])
    assert "episode_reward_mean: " in capsys.readouterr().out
    trained = RunFolder.open(tmp_path / "model" / "run")
    job = trained.read_job()
    own, settings = job["settings"][algorithm], job["settings"]
    every = {"dqn": 32, "apex": 16}[algorithm]
    assert job["algorithm"] == algorithm
    assert (own["discount"], own["batch_size"], own["n_step"], own["train_every"]) == (0.9, 16, 2, every)
    assert own["target_every"] == 64 // every
    assert (own["double"], own["dueling"], settings["replay"]["prioritised"]) == (True, True, True)
    assert settings["network"]["hidden_units"] == [16, 8]
    assert sum(row.get("gradient_steps", 0) for row in trained.read_metrics()) >= 2


def test_stops_are_ours_in_our_units():
    told = translated({**experiment(), "stop": {"time_total_s": 90, "episode_reward_mean": 195}})
    assert told.stops == ("minutes=1.5", "score=195")


class Cut:
    observation_space = action_space = None

    def reset(self):
        return 1

    def step(self, action):
        return 2, 1, True, {"TimeLimit.truncated": action}


def test_an_old_episode_that_a_limit_cut_is_truncated_and_no_other():
    env = FromOldGym(Cut())
    assert env.reset(seed=1) == (1, {})
    assert env.step(True)[2:4] == (False, True)
    assert env.step(False)[2:4] == (True, False)


NOTEBOOK = """
import sagemaker, boto3
from sagemaker.rl import RLEstimator, RLToolkit, RLFramework
from sagemaker.session import Session
from sagemaker.inputs import TrainingInput
from sagemaker.predictor import RealTimePredictor, json_serializer
from sagemaker.serializers import JSONSerializer
from sagemaker.analytics import TrainingJobAnalytics
session = sagemaker.session.Session()
print("s3://{}/".format(session.default_bucket()), sagemaker.get_execution_role())
print(RLEstimator.default_metric_definitions(RLToolkit.RAY)[0]["Name"])
"""


def test_the_first_cells_of_the_notebooks_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))
    (tmp_path / "cells.py").write_text(NOTEBOOK)
    run_script("cells.py")
    assert capsys.readouterr().out.splitlines() == [
        "s3://racecraft-local/ arn:aws:iam::000000000000:role/racecraft-local",
        "episode_reward_mean",
    ]
    assert "sagemaker" not in sys.modules, "lent for the script only"


def test_what_ray_2_calls_otherwise_means_the_same():
    first = experiment(num_workers=3, num_sgd_iter=4, sgd_minibatch_size=50, train_batch_size=600, **{"lambda": 0.9})
    later = experiment(
        num_env_runners=3, num_epochs=4, minibatch_size=50, train_batch_size_per_learner=600, lambda_=0.9
    )
    assert translated(later) == translated(first)
    first["stop"], later["stop"] = {"episode_reward_mean": 90}, {"env_runners/episode_return_mean": 90}
    assert translated(later).stops == translated(first).stops == ("score=90",)


def test_fractions_of_a_schedule_are_steps():
    said = {"schedule_max_timesteps": 2000, "exploration_fraction": 0.1, "beta_annealing_fraction": 0.5,
            "final_prioritized_replay_beta": 1.0}  # fmt: skip
    steps = {"dqn.epsilon_steps=200", "replay.importance_steps=1000"}
    assert steps <= set(translated({**experiment(**said), "run": "DQN"}).settings)
    apex = translated({**experiment(**said), "run": "APEX"})
    assert "replay.importance_steps=1000" in apex.settings
    assert "exploration_fraction: Ape-X's worlds explore each in their own degree" in apex.notes


def test_an_environment_of_gymnasium_s_is_told_its_env_config(tmp_path, monkeypatch, capsys):
    (tmp_path / "train.py").write_text(
        "from ray import tune\n"
        "config = dict(env='CartPole-v1', env_config={'sutton_barto_reward': True}, train_batch_size=128)\n"
        "trained = tune.run('PPO', stop={'training_iteration': 1}, config=config, checkpoint_freq=5)\n"
        "print(trained.run)\n"
    )
    monkeypatch.setenv("SM_MODEL_DIR", str(tmp_path / "model"))
    run_script("train.py")
    said = capsys.readouterr().out
    assert "- checkpoint_freq: weights of 200 iterations" in said
    assert "episode_reward_mean: -1\n" in said, "Sutton's and Barto's CartPole pays -1 where it ends, and else nothing"
    assert "episodes_total: " in said


def test_an_episode_that_a_limit_of_ticks_cut_is_told_of(tmp_path, capsys):
    (tmp_path / "train.py").write_text(CART.replace('"num_workers": 2,', '"num_workers": 2, "horizon": 4,'))
    run_script("train.py", ["--rl.training.stop.training_iteration", "1"])
    said = capsys.readouterr().out
    assert "episode_len_mean: 4\n" in said
    assert "episodes_this_iter: 16\n" in said


@pytest.mark.parametrize(
    ("before", "after", "letter"),
    [
        ("self.action_space, ", "_, ", r"Cart has no action_space; expected one of gym's spaces"),
        (
            "terminated or truncated, info",
            "terminated or truncated",
            r"Cart\.step gave .* \(3 things\); expected \(obs",
        ),
        ("return seen, reward", "return seen, 'much'", r"Cart\.step gave 'much' as reward .* expected a number"),
    ],
)
def test_an_environment_that_is_not_whole_is_told_by_its_line(tmp_path, before, after, letter):
    (tmp_path / "train.py").write_text(CART.replace(before, after))
    with pytest.raises(EnvironmentFailedError, match=rf"^train\.py:\d+: {letter}"):
        run_script("train.py")


NEW_MANNERS = """
import gymnasium
from ray.tune.registry import register_env
from ray import tune

class Cart(gymnasium.Env):
    seeds = []
    def __init__(self, config):
        self.cart = gymnasium.make("CartPole-v1")
        self.action_space, self.observation_space = self.cart.action_space, self.cart.observation_space
    def reset(self, *, seed=None, options=None):
        self.seeds.append(seed)
        return self.cart.reset(seed=seed, options=options)
    def step(self, action):
        return self.cart.step(action)

register_env("cart", Cart)
tune.run("PPO", stop={"training_iteration": 1}, config=dict(env="cart", num_workers=2, train_batch_size=64))
print("unseeded", sum(seed is None for seed in Cart.seeds), "of", len(Cart.seeds))
"""


def test_an_environment_of_new_manners_is_told_its_seed(tmp_path, capsys):
    """Without it no run would be the same twice, nor go on as it was."""
    (tmp_path / "train.py").write_text(NEW_MANNERS)
    run_script("train.py")
    assert "unseeded 0 of " in capsys.readouterr().out


RUN_BY_TUNE = """
import gym
from gym.envs.registration import register
from ray import tune
from ray.tune.logger import pretty_print

class Line(gym.Env):
    def __init__(self, length=3):
        self.observation_space = gym.spaces.Box(-9, 9, (1,), "float32")
        self.action_space = {space}
        self.length = length

    def reset(self):
        self.ticks = 0
        return self.observation_space.sample()

    def step(self, action):
        self.ticks += 1
        return self.observation_space.sample(), 1.0, self.ticks >= self.length, {{}}

register(id="Line-v7", entry_point=Line, max_episode_steps=50, kwargs={{"length": {length}}})
def tell(said):
    print(pretty_print({{**said["result"], "config": None, "mine": {{"a": 2.0}}}}))
tune.run({run!r}, stop={{"training_iteration": 2}}, config={{"env": "Line-v7", "callbacks": {{"on_train_result": tell}},
         "model": {{"fcnet_hiddens": [8]}}, **{config!r}}})
"""
ES = {"episodes_per_batch": 6}
SAC = {"timesteps_per_iteration": 20, "learning_starts": 8, "policy_model": {"fcnet_hiddens": [8]},
       "Q_model": {"fcnet_hiddens": [8]}}  # fmt: skip


@pytest.mark.parametrize(
    ("run", "space", "config", "steps"),
    [("ES", "gym.spaces.Discrete(2)", ES, 36), ("SAC", 'gym.spaces.Box(-1, 1, (1,), "float32")', SAC, 64)],
)
def test_more_algorithms_train_an_environment_that_gym_registered(
    tmp_path, monkeypatch, capsys, run, space, config, steps
):
    (tmp_path / "train.py").write_text(RUN_BY_TUNE.format(run=run, space=space, config=config, length=3))
    monkeypatch.setenv("SM_MODEL_DIR", str(tmp_path / "model"))
    run_script("train.py")
    told = capsys.readouterr().out
    assert told.count("\nmine:\n  a: 2\n") == 2
    assert "\ntraining_iteration: 2\n" in told
    assert f"\ntimesteps_total: {steps}\n" in told
    assert "\nepisode_reward_mean: 3\n" in told
    job = RunFolder.open(tmp_path / "model" / "run").read_job()
    assert job["algorithm"] == run.lower()


def test_without_a_horizon_an_episode_goes_on_until_the_environment_ends_it(tmp_path, capsys):
    script = RUN_BY_TUNE.format(
        run="PPO", space="gym.spaces.Discrete(2)", config={"train_batch_size": 5000}, length=1200
    )
    words = '"num_sgd_iter": 1, "num_workers": 1, '
    script = script.replace("max_episode_steps=50, ", "").replace('config={"env"', f'config={{{words}"env"')
    (tmp_path / "train.py").write_text(script.replace('"training_iteration": 2', '"training_iteration": 1'))
    run_script("train.py")
    assert "episode_len_mean: 1200\n" in capsys.readouterr().out
