"""Environments of several agents, masks and networks of a launcher script's own."""

import re
import sys
import textwrap

import gymnasium
import numpy as np
import pytest
from tests import forked
from tests.compat.guessing import GUESS, KERAS_MODEL, MASKED, PLAIN, TORCH_MODEL, TWO_POLICIES, script

from racecraft.compat import script_worlds
from racecraft.compat.script_worlds import Described, PolicyWords, ScriptWorld, SoleAgent
from racecraft.compat.shims import foreign_names, run_script
from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import SettingError
from racecraft.contract.world import POLICY_ID, allocate
from racecraft.evaluation.evaluate_run import evaluate_run
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import load_policy


def world_of(num_worlds, env, policies, horizon=1000, still=frozenset()):
    names = {}
    with foreign_names():
        exec(compile(GUESS + MASKED, "guess", "exec"), names)
    make = names[env] if env == "Guess" else lambda: SoleAgent(names[env]())
    policy_of = (lambda agent: f"policy_{agent[-1]}") if len(policies) > 1 else (lambda agent: next(iter(policies)))
    described = Described("guess", make, horizon, {name: PolicyWords() for name in policies}, policy_of, still)
    return type("Guessing", (ScriptWorld,), {"described": described, "worlds_made": 0})(num_worlds)


class TestAPolicyForEach(WorldConformance):
    def make_world(self, num_worlds):
        return world_of(num_worlds, "Guess", ["policy_0", "policy_1"])


class TestEpisodesThatAreCut(WorldConformance):
    def make_world(self, num_worlds):
        return world_of(num_worlds, "Guess", ["policy_0", "policy_1"], horizon=5)


class TestAMask(WorldConformance):
    def make_world(self, num_worlds):
        return world_of(num_worlds, "Masked", ["shared"])


def test_one_that_leaves_rests_until_the_others_are_done():
    world = world_of(1, "Guess", ["policy_0", "policy_1"])
    buffers = allocate(world.spec)
    world.reset(buffers, 1)
    assert buffers.observations[POLICY_ID][0].tolist() == [0, 1]
    story = []
    for _ in range(9):
        world.step(np.zeros((1, 2, 1), np.float32), buffers)
        story.append((buffers.active[0].tolist(), buffers.terminated[0].tolist()))
        if len(story) == 3:
            assert buffers.final_observations["policy_1/observation"][0, 1].tolist() == [0.5, 0.5]
    both, one = [True, True], [True, False]
    assert [active for active, _ in story] == [both, both, one, one, one, one, one, both, both]
    assert [ended for _, ended in story] == [
        [False, False], [False, False], [False, True], *[[False, False]] * 4, [True, False], [False, False],
    ]  # fmt: skip


def test_a_cut_is_no_end_and_only_the_living_are_cut():
    world = world_of(1, "Guess", ["policy_0", "policy_1"], horizon=5)
    buffers = allocate(world.spec)
    world.reset(buffers, 1)
    for _ in range(5):
        world.step(np.zeros((1, 2, 1), np.float32), buffers)
    assert buffers.truncated[0].tolist() == [True, False]
    assert not buffers.terminated.any()


@pytest.fixture
def ran(tmp_path, monkeypatch, capsys):
    """Runs a script in a job's folder; returns what it said and its run."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SM_MODEL_DIR", str(tmp_path / "model"))

    def run(text, *words):
        (tmp_path / "train.py").write_text(text)
        run_script("train.py", words)
        return capsys.readouterr().out, RunFolder.open(tmp_path / "model" / "run")

    return run


def test_each_policy_learns_with_words_of_its_own_and_metrics_add_all_agents_up(ran):
    said, run = ran(script(more=TWO_POLICIES))
    total, first, second = (
        float(re.findall(rf"^ +{name}: (\S+)", said, re.MULTILINE)[-1])
        for name in ("episode_reward_mean", "policy_0", "policy_1")
    )
    assert total == pytest.approx(first + second, rel=1e-5)
    assert 0 < first <= 8
    assert 0 < second <= 3
    assert "episode_len_mean: 8" in said
    weights, metadata = Checkpoints(run.checkpoints).load_policy("2")
    assert list(metadata["policy_spec"]["policies"]) == ["policy_0", "policy_1"]
    assert {name.split("/")[0] for name in weights} == {"policy_0", "policy_1"}


@pytest.mark.parametrize(("more", "first"), [(TWO_POLICIES, 1), ("config['train_batch_size'] = 52", 2)])
def test_an_interrupted_script_of_several_agents_goes_on_as_if_it_never_stopped(ran, tmp_path, more, first):
    """52 ticks end within an episode: one of two agents rests, and its row differs from a rollout ago."""
    stop = "--rl.training.stop.training_iteration"
    ran(script(more=more), stop, str(first))
    said, run = ran(script(more=more), stop, str(first + 1))
    assert f"goes on after iteration {first}\n" in said
    broken, _ = Checkpoints(run.checkpoints).load_policy(str(first + 1))
    run.path.rename(tmp_path / "first")
    _, whole = ran(script(more=more), stop, str(first + 1))
    unbroken, _ = Checkpoints(whole.checkpoints).load_policy(str(first + 1))
    assert all(np.array_equal(broken[name], unbroken[name]) for name in unbroken)


def test_a_policy_that_is_not_to_be_trained_stays_as_it_was(ran):
    more = TWO_POLICIES + "config['multiagent']['policies_to_train'] = ['policy_0']\n"
    _, run = ran(script(more=more))
    first, _ = Checkpoints(run.checkpoints).load_policy("1")
    last, _ = Checkpoints(run.checkpoints).load_policy("2")
    changed = {name.split("/")[0] for name in last if not np.array_equal(first[name], last[name])}
    assert changed == {"policy_0"}


def test_without_multiagent_all_share_one_policy(ran):
    said, run = ran(script())
    assert "policy_reward_mean" not in said
    assert run.read_job()["asked"]["environment"] == f"{script_worlds.PLACE}:Script_guess_v1"


def test_a_step_is_a_tick_of_an_environment_however_many_agents_act_in_it(ran, tmp_path):
    words = ("--rl.training.stop.training_iteration", "99", "--rl.training.stop.timesteps_total", "250")
    told, run = ran(script(more=TWO_POLICIES), *words)
    assert re.findall(r"timesteps_total: (\d+)", told) == ["128", "256"]
    run.path.rename(tmp_path / "first")
    by_agent, _ = ran(script(more=TWO_POLICIES + "config['multiagent']['count_steps_by'] = 'agent_steps'\n"), *words)
    assert re.findall(r"timesteps_total: (\d+)", by_agent) == ["256"], "128 ticks of two agents"


def test_a_torch_model_of_the_scripts_own_decides(ran):
    said, run = ran(script("Masked", TORCH_MODEL))
    assert "episode_reward_mean: 9" in said, "its own mask is heeded"
    weights, _ = Checkpoints(run.checkpoints).load_policy("2")
    shapes = {name: part.shape for name, part in weights.items()}
    assert shapes["policy_body.own.model.inner._logits._model.0.weight"] == (3, 8)
    assert not any("policy_head" in name for name in weights)


ELSEWHERE = """
import sys, numpy as np
import racecraft as rc
policy = rc.load_policy(sys.argv[1])
for t in range(3):
    seen = {"action_mask": np.eye(3, dtype=np.float32)[[t]], "real_obs": np.array([[t]], np.float32)}
    assert policy.act(seen).tolist() == [t]
assert not any(name.partition(".")[0] in ("ray", "gym", "train") for name in sys.modules)
"""


@pytest.mark.parametrize("guard", ['if __name__ == "__main__":', "if True:"])
def test_a_model_of_the_scripts_own_travels_with_its_run(ran, tmp_path, guard):
    """The script is gone, and one that trains whenever it is imported does not train again."""
    _, run = ran(script("Masked", TORCH_MODEL).replace('if __name__ == "__main__":', guard))
    (tmp_path / "train.py").unlink()
    away = tmp_path / "elsewhere"
    away.mkdir()
    run.path.rename(away / "run")
    before = (away / "run" / "metrics.jsonl").read_bytes()
    (away / "drive.py").write_text(ELSEWHERE)
    done = forked.ran(["drive.py", "run"], away)
    assert done.returncode == 0, done.stderr
    assert (away / "run" / "metrics.jsonl").read_bytes() == before
    assert any(path.name.startswith("script_model") for path in (away / "run" / "code").iterdir())
    assert load_policy(away / "run").spec.network["policy"].endswith(":Model")


def forget_environments():
    """Know as little of what scripts made as a process that never ran one."""
    gymnasium.registry.pop("from_script/guess-v1-v0", None)
    vars(script_worlds).pop("Script_guess_v1", None)


@pytest.mark.parametrize(
    ("env", "more", "steps"), [("Guess", TWO_POLICIES, 5.5), ("Masked", TORCH_MODEL, 9.0), ("Plain", "", 6.0)]
)
def test_a_scripts_own_environment_travels_with_its_run(ran, tmp_path, env, more, steps):
    """Several agents, a mask and a network, and one that Gymnasium's own way carries; the script is gone."""
    (tmp_path / "plain_world.py").write_text(PLAIN)
    _, run = ran("from plain_world import Plain\n" + script(env, more))
    (tmp_path / "train.py").unlink()
    (tmp_path / "plain_world.py").unlink()
    run.path.rename(tmp_path / "away")
    before = {path.name for path in (tmp_path / "away").rglob("*")}
    forget_environments()
    told = evaluate_run(tmp_path / "away", episodes=4)
    assert (told["episodes"], told["mean_steps"]) == (4, steps)
    assert {path.name for path in (tmp_path / "away").rglob("*")} == before
    assert "script_environment" not in sys.modules


def test_a_script_that_comes_to_no_training_elsewhere_is_named(ran, tmp_path):
    asks, go = 'if __name__ == "__main__":', tmp_path / "go"
    go.touch()
    _, run = ran(script("Masked").replace(asks, f"import os\nif os.path.exists({str(go)!r}):"))
    go.unlink()
    forget_environments()
    with pytest.raises(SettingError, match="begun again for its environment, it came to no training"):
        evaluate_run(run.path)
    (run.path / "code" / "script_environment.py").unlink()
    with pytest.raises(SettingError, match=r"a script made this environment .* behind its train_main\(\)"):
        evaluate_run(run.path)


def test_a_scripts_own_environment_is_judged_behind_its_training(ran):
    judging = "import os, racecraft as rc\nprint('told', rc.evaluate(os.environ['SM_MODEL_DIR'] + '/run', episodes=3))"
    said, run = ran(script(more=TWO_POLICIES) + textwrap.indent(judging, "    "))
    assert re.search(r"told .*'episodes': 3, 'mean_return': [1-8]", said)


def test_a_model_that_cannot_travel_is_named_with_the_cure(ran):
    before, sign, rest = TORCH_MODEL.partition("class MaskModel")
    whole, register, behind = rest.partition("ModelCatalog.register")
    made = textwrap.indent(sign + whole, "    ") + "    return MaskModel\n\nMaskModel = made()\n"
    within = f"{before}def made():\n{made}{register}{behind}"
    said, run = ran(script("Masked", within))
    assert "MaskModel cannot travel with the run, which is judged in this script only: it is made within" in said
    assert "write its class at the top of train.py" in said
    assert sorted(path.name for path in (run.path / "code").iterdir()) == ["script_environment.py", "train.py"]


def test_a_tensorflow_model_is_refused_by_name_and_may_be_left_out(ran):
    with pytest.raises(SettingError, match='MaskModel is a TensorFlow model.*custom_model=""'):
        ran(script("Masked", KERAS_MODEL))
    said, _ = ran(script("Masked", KERAS_MODEL), "--rl.training.config.model.custom_model", "")
    assert "- model.custom_model_config: there is no custom_model that it would be told" in said
    assert "episode_reward_mean: 9" in said


MULTI = 'config["multiagent"] = '


@pytest.mark.parametrize(
    ("env", "more", "letter"),
    [
        ("Guess", MULTI + "{'policies': {'a', 'b'}}", "no policy_mapping_fn"),
        ("Guess", MULTI + "{'policies': {'a'}, 'policy_mapping_fn': lambda agent: 'b'}", "the policy 'b'; expected"),
        ("Guess", MULTI + "{'policies': {'a'}, 'policies_to_train': []}", "expected a policy that learns"),
        ("Guess", MULTI + "{'policies': {'a': (dict, None, None, {})}}", "of the class dict; expected None"),
        ("Guess", MULTI + "{'policies': {'a'}, 'observation_fn': print}", "what an agent sees"),
        ("Masked", MULTI + "{'policies': {'a'}}", "makes a Masked; expected a MultiAgentEnv"),
        ("Masked", "config['model'] = {'conv_filters': [[16, [5, 4], 2]]}", "expected square kernels"),
    ],
)
def test_what_is_not_understood_is_named_before_anything_is_made(ran, tmp_path, env, more, letter):
    with pytest.raises(SettingError, match=letter):
        ran(script(env, more))
    assert not (tmp_path / "model").exists()


def test_a_mapping_of_newer_rays_is_asked_with_an_episode(ran):
    more = "config['multiagent'] = {'policies': {'a', 'b'}, 'policy_mapping_fn': "
    said, _ = ran(script(more=more + "lambda agent, episode, **words: 'ab'[int(agent[-1])]}"))
    assert "policy_reward_mean" in said


def test_an_agent_that_nobody_spoke_of_is_named(ran):
    text = script().replace('seen["agent_1"] =', 'seen["agent_7"] =')
    with pytest.raises(SettingError, match="shows agent 'agent_7', which the first reset did not"):
        ran(text)
