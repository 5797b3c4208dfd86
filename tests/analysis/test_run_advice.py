"""Every command that advice gives can be typed: verbs, options and settings are there, of the run's own kind."""

import inspect
import re
import shlex
from types import SimpleNamespace

import pytest
import typer

from racecraft.analysis import learning_advice, run_advice
from racecraft.analysis.advice import GO_ON, Advice
from racecraft.analysis.learner import Learner
from racecraft.analysis.run_advice import advice_of, typed_command
from racecraft.cli.app import app
from racecraft.settings.overrides import apply_overrides
from racecraft.worlds.deepracer.analysis.logs import advice
from racecraft.worlds.deepracer.training.presets import default_settings

LEARNER = Learner("ppo", {"ppo": {"learning_rate": 5e-4, "entropy_weight": 0.01}, "rollout": {"horizon": 64}})
OPTIONS = {
    "{learner.smaller_steps()}": LEARNER.smaller_steps(), "{more}": LEARNER.more_exploration(),
    "{learner.more_experience()}": LEARNER.more_experience(), "{GO_ON}": GO_ON,
}  # fmt: skip
"""What stands in advice's commands for an option of the run's own algorithm."""


def with_options(command):
    for name, option in OPTIONS.items():
        command = command.replace(name, option)
    return command


COMMANDS = sorted({
    with_options(found) for module in (learning_advice, advice)
    for found in re.findall(r'"(racecraft [^"]+)"', inspect.getsource(module))
})  # fmt: skip
GAME = {"width": 7, "height": 7, "players": 2, "ruleset": "wrapped", "map": "standard"}
JOBS = {
    "deepracer": ({"folder": "my car", "track": "Oval_track"}, "racecraft train 'my car' --track Oval_track"),
    "gymnasium": ({"environment": "CartPole-v1"}, "racecraft gym train CartPole-v1"),
    "battlesnake": ({"game": GAME}, "racecraft snakes train -W 7 -H 7 --snakes 2 -g wrapped -m standard"),
    "unity": ({"build": "builtin:Basic"}, "racecraft unity train builtin:Basic"),
}


def parsed(command):
    """Return the values of a command's parameters, by the command line's own parser."""
    node, words = typer.main.get_command(app), shlex.split(command)[1:]
    while hasattr(node, "commands"):
        node = node.commands[words.pop(0)]
    return node.make_context(node.name, words, resilient_parsing=False).params


def test_there_are_commands():
    assert len(COMMANDS) >= 8
    assert any("--set ppo.learning_rate=0.00025" in command for command in COMMANDS)
    assert all(OPTIONS.values())


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_can_be_typed(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = parsed(command)
    apply_overrides(default_settings(), told.get("set_") or ())


@pytest.mark.parametrize("kind", JOBS)
def test_a_command_is_of_the_run_s_own_kind(kind):
    asked, begins = JOBS[kind]
    job = {"kind": kind, "asked": asked}
    anew = typed_command("racecraft train --from RUN:best --set ppo.learning_rate=1e-4", job)
    assert anew == f"{begins} --from RUN:best --set ppo.learning_rate=1e-4"
    assert parsed(anew)["from_"] == "RUN:best"
    other = typed_command("racecraft train --from RUN:best --set dqn.learning_rate=1e-4", {**job, "algorithm": "dqn"})
    assert other == f"{begins} --algorithm dqn --from RUN:best --set dqn.learning_rate=1e-4"
    assert parsed(other)["algorithm"] == "dqn"
    goes_on = typed_command("racecraft train --run RUN --resume --stop minutes=10", job)
    assert (
        goes_on == f"{' '.join(begins.split()[: 2 if kind == 'deepracer' else 3])} --run RUN --resume --stop minutes=10"
    )
    assert parsed(goes_on)["resume"] is True
    assert typed_command("racecraft why RUN", job) == "racecraft why RUN"


def test_who_goes_on_is_told_to_for_ten_minutes_after_what_the_run_has_had(monkeypatch):
    found = [Advice("", "", command=f"racecraft train --run RUN {GO_ON}")]
    monkeypatch.setattr(run_advice, "learning_advice", lambda *given: found)
    job = {"kind": "gymnasium", "asked": {"environment": "CartPole-v1"}}
    run = SimpleNamespace(path="r", read_job=lambda: job, read_metrics=lambda: [{"seconds": 1.0}, {"seconds": 754.0}])
    assert [one.command for one in advice_of(run)] == ["racecraft gym train --run RUN --resume --stop minutes=23"]
