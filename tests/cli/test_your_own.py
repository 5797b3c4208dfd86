"""A user's own algorithm, network and environment by name, recorded episodes, and the list of algorithms."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from tests.forked import ran

from racecraft.players.trained import load_policy

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SHORT = ("--no-pictures", "--stop=iterations=2", "--set=evaluation.episodes=2", "--set=rollout.horizon=32", "--json")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Lay the examples into an empty present folder; what is imported from it is forgotten afterwards."""
    before, path = set(sys.modules), list(sys.path)
    for script in EXAMPLES.glob("your_own_*.py"):
        shutil.copy(script, tmp_path)
    yield tmp_path
    sys.path[:] = path
    for name in set(sys.modules) - before:
        if name.startswith(("your_own", "my_")):
            del sys.modules[name]


def told(said):
    assert said.code == 0, said.err
    return json.loads(said.out)


@pytest.mark.parametrize("algorithm", ["reinforce", "es"])
def test_a_broken_run_goes_on_bit_for_bit(racecraft, folder, algorithm):
    short = ("--set", "evaluation.episodes=2", "--set", "evaluation.every=2", "--json", "--algorithm", algorithm)
    short += ("--no-pictures",)
    told(racecraft("gym", "train", "CartPole-v1", "--run", "whole", "--stop", "iterations=4", *short))
    told(racecraft("gym", "train", "CartPole-v1", "--run", "parts", "--stop", "iterations=2", *short))
    told(racecraft("gym", "train", "--run", "parts", "--resume", "--stop", "iterations=4", "--no-pictures", "--json"))
    whole, parts = (
        [json.loads(line) for line in (folder / run / "metrics.jsonl").read_text().splitlines()]
        for run in ("whole", "parts")
    )
    assert len(whole) == len(parts) == 4
    for one, other in zip(whole, parts, strict=True):
        assert "grad_norm" in one
        assert {name: one[name] for name in one if "second" not in name} == {
            name: other[name] for name in other if "second" not in name
        }


def test_recorded_episodes_are_cloned_and_gone_on_from(racecraft, folder, monkeypatch):
    more = ("--set", "evaluation.episodes=2", "--set", "evaluation.every=100", "--no-pictures", "--json")
    told(racecraft("gym", "train", "CartPole-v1", "--run", "expert", "--stop", "steps=6000", *more))
    shown = told(racecraft("record", "expert", "-o", "demos.safetensors", "--episodes", "10", "--json"))
    assert shown["episodes"] == 10
    assert shown["mean_return"] > 40
    demos = ("--set", f"bc.demonstrations={folder / 'demos.safetensors'}", "--set", "bc.learning_rate=1e-2")
    clone = ("--algorithm", "bc", "--run", "clone", "--stop", "iterations=10")
    cloned = told(racecraft("gym", "train", "CartPole-v1", *clone, *demos, *more))
    assert cloned["evaluation"]["mean_return"] > 40  # a pole left to chance falls after 22
    figures = [json.loads(line) for line in (folder / "clone" / "metrics.jsonl").read_text().splitlines()]
    assert figures[-1]["held_out_agreement"] > 0.8
    assert figures[-1]["held_out_loss"] < 0.8 * figures[0]["held_out_loss"]
    assert load_policy("clone").spec.algorithm == "bc"
    (folder / "demos.safetensors").unlink()  # what it learns from went along
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    on = told(
        racecraft("gym", "train", "--run", "../clone", "--resume", "--stop", "iterations=11", "--no-pictures", "--json")
    )
    assert on["iterations"] == 11
    assert str(folder) not in (folder / "clone" / "job.json").read_text()
    monkeypatch.chdir(folder)
    went_on = told(
        racecraft("gym", "train", "CartPole-v1", "--from", "clone:last", "--run", "on", "--stop", "iterations=1", *more)
    )
    first, last = load_policy("on:0").policy.network, load_policy("clone:last").policy.network
    assert all((one == two).all() for one, two in zip(first.parameters(), last.parameters(), strict=True))
    assert went_on["run"] == "on"


def test_cloning_without_a_file_or_with_a_wrong_one_is_refused_before_anything_is_made(racecraft, folder):
    said = racecraft("gym", "train", "CartPole-v1", "--algorithm", "bc")
    assert said.code == 2
    assert "bc.demonstrations" in said.err
    said = racecraft(
        "gym", "train", "CartPole-v1", "--algorithm", "bc", "--set", "bc.demonstrations=your_own_network.py"
    )
    assert said.code == 2
    assert "your_own_network.py" in said.err
    assert not (folder / "runs").exists()


def test_an_own_algorithm_trains_by_name_and_its_policy_needs_it_not(racecraft, folder):
    name = "your_own_algorithm:HillClimbing"
    summary = told(racecraft("gym", "train", "CartPole-v1", "--algorithm", name, *SHORT))
    assert json.loads((folder / summary["run"] / "job.json").read_text())["algorithm"] == name
    told(
        racecraft(
            "gym", "train", "--run", summary["run"], "--resume", "--stop", "iterations=3", "--no-pictures", "--json"
        )
    )
    assert load_policy(summary["run"]).spec.algorithm == "reinforce"


def test_an_own_network_is_remembered_and_travels_with_its_run(racecraft, folder, tmp_path_factory):
    own = ("--set", "network.encoder=your_own_network:Waves")
    first, second = (told(racecraft("gym", "train", "CartPole-v1", *own, *SHORT)) for _ in range(2))
    one, two = load_policy(first["run"]), load_policy(second["run"])
    same = [
        (a == b).all() for a, b in zip(one.policy.network.parameters(), two.policy.network.parameters(), strict=True)
    ]
    assert all(same)
    assert type(one.policy.network.policy_body.own).__name__ == "Waves"
    script = tmp_path_factory.mktemp("elsewhere") / "look.py"
    script.write_text(
        f"from racecraft.players.trained import load_policy; run = load_policy({str(folder / first['run'])!r});"
        "print(type(run.policy.network.policy_body.own).__name__)"
    )
    there = ran([script], script.parent)
    assert there.stdout.strip() == "Waves", there.stderr
    (folder / first["run"] / "code" / "your_own_network.py").unlink()
    assert "there is no module 'your_own_network'" in ran([script], script.parent).stderr


WHOLE = """
import torch

class Whole(torch.nn.Module):
    def __init__(self, observations, actions, outputs):
        super().__init__()
        assert actions.count == outputs == 2
        (self.name, part), = observations.items()
        self.both = torch.nn.Linear(*part.shape, outputs + {extra})

    def forward(self, seen):
        both = self.both(seen[self.name])
        return both[:, :-1], both[:, -1]
"""


def test_an_own_network_decides_and_values_by_itself(racecraft, folder):
    (folder / "whole.py").write_text(WHOLE.format(extra=1))
    summary = told(racecraft("gym", "train", "CartPole-v1", "--set", "network.policy=whole:Whole", *SHORT))
    network = load_policy(summary["run"]).policy.network
    own = [f"policy_body.own.both.{part}" for part in ("weight", "bias")]
    assert [name for name, _ in network.named_parameters()] == own
    first = network.policy_body.own.both.weight.clone()
    on = ("--run", summary["run"], "--resume", "--stop", "iterations=3", "--no-pictures", "--json")
    told(racecraft("gym", "train", *on))
    assert not (load_policy(f"{summary['run']}:last").policy.network.policy_body.own.both.weight == first).all()


@pytest.mark.parametrize(
    ("extra", "more", "letter"),
    [
        (2, (), "gives (2, 3) and (2,) for two rows; expected (2, 2) numbers that decide"),
        (1, ("network.encoder=your_own_network:Waves",), "network.encoder and network.policy are both given"),
    ],
)
def test_an_own_network_of_another_shape_or_beside_another_is_refused(racecraft, folder, extra, more, letter):
    module = f"whole_{extra}"
    (folder / f"{module}.py").write_text(WHOLE.format(extra=extra))
    sets = [word for one in (f"network.policy={module}:Whole", *more) for word in ("--set", one)]
    said = racecraft("gym", "train", "CartPole-v1", *sets, *SHORT)
    assert said.code == 2
    assert letter in said.err.replace("\n", " ")
    assert not (folder / "runs").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import torch\nclass Eye(torch.nn.Module):\n    def __init__(self, specs): super().__init__()", "width"),
        (
            "import torch\nclass Eye(torch.nn.Module):\n    width = 3\n    def __init__(self, specs): "
            "super().__init__()\n    def forward(self, seen): return seen['observation']",
            r"(2, 4) for two rows; expected (2, 3)",
        ),
    ],
    ids=["no width", "another width"],
)
def test_a_network_of_another_shape_is_named(racecraft, folder, text, said, request):
    module = f"my_eye_{abs(hash(text)) % 10**6}"
    (folder / f"{module}.py").write_text(text)
    found = racecraft("gym", "train", "CartPole-v1", "--set", f"network.encoder={module}:Eye", *SHORT)
    assert found.code == 2
    assert said in found.err
    assert f"{module}:Eye" in found.err
    assert not (folder / "runs").exists()


def test_an_own_environment_trains_by_class_and_by_id(racecraft, folder):
    summary = told(racecraft("gym", "train", "your_own_environment:Room", *SHORT))
    assert summary["evaluation"]["threshold"] == 27.0
    assert summary["run"] == "runs/your_own_environment-Room-1"
    told(racecraft("record", summary["run"], "--episodes", "2", "--json"))
    (folder / "my_registering.py").write_text(
        "import gymnasium\nfrom your_own_environment import Room\n"
        "gymnasium.register('MyRoom-v0', entry_point=Room, reward_threshold=25.0)\n"
    )
    summary = told(racecraft("gym", "train", "my_registering:MyRoom-v0", *SHORT))
    assert summary["evaluation"]["threshold"] == 25.0


def test_an_own_world_trains_by_class(racecraft, folder):
    (folder / "my_world.py").write_text(
        "from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld\n"
        "class Poles(GymnasiumWorld):\n"
        "    def __init__(self, num_worlds): super().__init__('CartPole-v1', num_worlds)\n"
        "class Hole:\n    def __init__(self, num_worlds): pass\n"
        "class Stubborn: pass\nthing = 3\n"
    )
    assert told(racecraft("gym", "train", "my_world:Poles", *SHORT))["iterations"] == 2
    for name, said in (("Hole", "lacks spec, reset"), ("Stubborn", "num_worlds"), ("thing", "no class")):
        found = racecraft("gym", "train", f"my_world:{name}", *SHORT)
        assert found.code == 2
        assert said in found.err
    found = racecraft("gym", "train", "my_world:Polse", *SHORT)
    assert found.code == 2
    assert "Did you mean 'Poles'" in found.err
    found = racecraft("gym", "train", "my_absent:Poles-v0", *SHORT)
    assert found.code == 2
    assert "my_absent" in found.err
