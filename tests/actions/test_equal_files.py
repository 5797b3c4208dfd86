"""A command and the same action from Python leave equal files and tell equal figures."""

import importlib
import json
import re
import sys

import pytest

import racecraft as rc
from racecraft.cli.app import main
from racecraft.cli.output import print_json

CAR = "racecraft.worlds.deepracer.actions"
SNAKE = "racecraft.worlds.battlesnake.actions"
TINY_CAR = {
    "camera.width": 16, "camera.height": 12, "rollout.num_worlds": 4, "rollout.horizon": 16, "evaluation.episodes": 2,
    "race.max_episode_seconds": 2.0, "network.conv_filters": (4,), "network.conv_kernels": (4,),
    "network.conv_strides": (2,), "network.hidden_units": (8,), "runtime.threads": 1,
}  # fmt: skip
TINY_GYM = {"rollout.num_worlds": 2, "rollout.horizon": 16, "network.hidden_units": (8,), "ppo.epochs": 1}

GYM_SET = " ".join(
    f"--set {name}={value[0] if isinstance(value, tuple) else value}" for name, value in TINY_GYM.items()
)

CASES = {
    "gym train": (f"gym train CartPole-v1 {GYM_SET} --stop iterations=2 --seed 3 --no-pictures --run run",
                  "racecraft.worlds.gymnasium.actions.train:train", ["CartPole-v1"],
                  {"set_": [word for word in GYM_SET.split() if word != "--set"], "stop": "iterations=2", "seed": 3,
                   "run": "run", "pictures": False}),
    "record": ("record {gym} --episodes 2 -o demos.safetensors", "racecraft.actions.record:record", ["{gym}"],
               {"episodes": 2, "output": "demos.safetensors"}),
    "checkpoints": ("checkpoints {gym} --by reward --keep best,last", "racecraft.actions.checkpoints:checkpoints",
                    ["{gym}"], {"by": "reward", "keep": "best,last"}),
    "export": ("export {car} --to onnx --output policy.onnx", "racecraft.actions.export:export_run", ["{car}"],
               {"to": "onnx", "output": "policy.onnx"}),
    "evaluate a car": ("evaluate {car} --laps 1 --picture path.png", f"{CAR}.evaluate:evaluate", ["{car}"],
                       {"laps": 1, "picture": "path.png"}),
    "actions": ("actions Oval_track --table 7x1.5,2.5 --out table.json", f"{CAR}.action_table:action_table",
                ["Oval_track"], {"table": "7x1.5,2.5", "out": "table.json"}),
    "explain": ("explain learning rate", f"{CAR}.explain:explain", [["learning", "rate"]], {}),
    "new": ("new my-car", f"{CAR}.new:new", ["my-car"], {}),
    "logs": ("logs {car} --csv steps.csv", f"{CAR}.logs:logs", [["{car}"]], {"csv": "steps.csv"}),
    "snakes play": ("snakes play flood_fill hungry -W 7 -H 7 --seed 3 -o game.jsonl", f"{SNAKE}.play:play",
                    [["flood_fill", "hungry"]], {"width": 7, "height": 7, "seed": 3, "output": "game.jsonl"}),
    "snakes tournament": ("snakes tournament hungry random_safe --rounds 1 -W 7 -H 7 --file games.jsonl",
                          f"{SNAKE}.tournament:tournament", [["hungry", "random_safe"]],
                          {"rounds": 1, "width": 7, "height": 7, "file": "games.jsonl"}),
}  # fmt: skip
"""What is typed, the action, its arguments, and its options by name."""


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    """Paths that the commands read: a run of an environment, one of a car, a racer's folder, a game."""
    base = tmp_path_factory.mktemp("read")
    gym, car = base / "gym", base / "car"
    rc.train("gymnasium", environment="CartPole-v1", settings=TINY_GYM, stops="iterations=1", run=gym, quiet=True)
    rc.train("deepracer", settings=TINY_CAR, preset="fast", stops="iterations=1", run=car, quiet=True)
    _action(f"{CAR}.new:new")(base / "folder")
    _action(f"{SNAKE}.play:play")(["flood_fill", "hungry"], width=7, height=7, seed=3, output=base / "game.jsonl")
    return {"gym": str(gym), "car": str(car), "folder": str(base / "folder"), "game": str(base / "game.jsonl")}


@pytest.mark.parametrize("name", CASES)
def test_a_command_and_its_action_leave_equal_files(name, places, tmp_path, monkeypatch, capsys):
    typed, target, arguments, options = CASES[name]
    left = {}
    for way in ("typed", "called"):
        folder = tmp_path / way
        folder.mkdir()
        monkeypatch.chdir(folder)
        if way == "typed":
            monkeypatch.setattr(
                sys, "argv", ["racecraft", *(word.format(**places) for word in typed.split()), "--json"]
            )
            main()
        else:
            print_json(_action(target)(*(_filled(one, places) for one in arguments), **options))
        figures = json.loads(capsys.readouterr().out.splitlines()[-1])
        left[way] = (_without_times(figures), _files(folder))
    assert left["typed"] == left["called"]


def _action(target):
    module, _, name = target.partition(":")
    return getattr(importlib.import_module(module), name)


def _filled(argument, places):
    return [one.format(**places) for one in argument] if isinstance(argument, list) else argument.format(**places)


def _files(folder):
    """Return the files by name, without the folder's own name, times and the random ids of drawings in them."""
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    here = str(folder).encode()
    plain = {name: TIMES.sub(b"", read.replace(here, b"HERE")) for name, read in files.items()}
    return {name: b"" if "state." in name else DRAWN.sub(b"ID", read) for name, read in plain.items()}


TIMES = re.compile(rb'"(seconds\w*|\w*steps_per_second|started)": ("[^"]*"|[\d.]+)')
"""A training's state keeps times as numbers of its tensors: only its name is compared."""
DRAWN = re.compile(rb"[mp][0-9a-f]{10}")


def _without_times(figures):
    """AWS's files of an evaluation are named by the moment."""
    return json.loads(TIMES.sub(b'"": 0', json.dumps({**figures, "aws_files": 0}).encode()))
