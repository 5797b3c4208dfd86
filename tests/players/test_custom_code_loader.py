"""A user's own network travels with its run: judged from elsewhere, as it was when the training began."""

import sys

from tests.forked import ran

from racecraft.contract.loading import add_cwd_to_path
from racecraft.formats.run_folder import RunFolder
from racecraft.players.custom_code_loader import own_code_of

NETWORK = """
import torch
from wide import WIDTH

class Net(torch.nn.Module):
    def __init__(self, observations, actions, outputs):
        super().__init__()
        self.layer = torch.nn.Linear(4, WIDTH)
        self.decides, self.values = torch.nn.Linear(WIDTH, outputs), torch.nn.Linear(WIDTH, 1)

    def forward(self, observations):
        seen = torch.tanh(self.layer(observations["observation"]))
        return self.decides(seen), self.values(seen).squeeze(1)
"""
TINY = ("--stop=iterations=1", "--no-pictures", "--set=rollout.horizon=16", "--set=evaluation.episodes=1")


def racecraft(folder, *words):
    return ran(words, folder)


def test_a_run_with_a_network_of_ones_own_is_judged_and_gone_on_with_from_elsewhere(tmp_path):
    here, away = tmp_path / "here", tmp_path / "away"
    here.mkdir()
    away.mkdir()
    (here / "mine.py").write_text(NETWORK)
    (here / "wide.py").write_text("WIDTH = 8\n")
    (here / "other.py").write_text("nobody imports it")
    trained = racecraft(here, "gym", "train", "CartPole-v1", "--run=run", "--set=network.policy=mine:Net", *TINY)
    assert trained.returncode == 0, trained.stderr
    assert sorted(path.name for path in (here / "run" / "code").iterdir()) == ["mine.py", "wide.py"]
    (here / "run").rename(away / "run")
    (away / "wide.py").write_text("WIDTH = 3  # another one, of the folder one stands in\n")
    judged = racecraft(away, "evaluate", "run", "--json")
    assert judged.returncode == 0, judged.stderr
    assert sorted(path.name for path in (away / "run" / "code").iterdir()) == ["mine.py", "wide.py"]
    on = racecraft(away, "gym", "train", "--run=run", "--resume", "--stop=iterations=2")
    assert on.returncode == 0, on.stderr
    assert [row["iteration"] for row in RunFolder.open(away / "run").read_metrics()] == [1, 2]


def test_other_modules_of_the_same_names_are_there_again_afterwards(tmp_path, monkeypatch):
    run = RunFolder.create(tmp_path / "run")
    (run.path / "code").mkdir()
    (run.path / "code" / "wide.py").write_text("WIDTH = 8")
    (tmp_path / "wide.py").write_text("WIDTH = 3")
    monkeypatch.syspath_prepend(tmp_path)
    import wide

    add_cwd_to_path()
    path = list(sys.path)
    with own_code_of(run):
        import wide as carried

        assert carried.WIDTH == 8
    import wide as again

    assert (again is wide, again.WIDTH, sys.path) == (True, 3, path)
    del sys.modules["wide"]
