"""`sagemaker_rl.coach_launcher`: a preset beside the script says what is trained; we train it."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path
from typing import Any

from racecraft.compat.coach_config import EPISODES, STEPS, TRAININGS, Amount, Part
from racecraft.compat.coach_training import train_preset
from racecraft.contract.errors import InputFileError, SettingError

OWN_WORDS = ("RLCOACH_PRESET", "num_workers", "save_model")
AMOUNTS = (STEPS, EPISODES, TRAININGS)


class SageMakerCoachPresetLauncher:
    """Trains the preset that a script names; a script derives its own from it."""

    def __init__(self) -> None:
        self._laid: list[tuple[str, Any]] = []

    def default_preset_name(self) -> str:
        """Return the name of a Python file beside the script, without .py; a script's own."""
        name = getattr(self, "DEFAULT_PRESET", None)
        if isinstance(name, str):
            return name
        raise NotImplementedError("Sub-classes must specify the name of the default preset")

    def map_hyperparameter(self, name: str, value: Any) -> None:
        """Take one hyperparameter; a script may give short names to some."""
        if not name.startswith("rl."):
            raise SettingError(
                f"hyperparameter '{name}': the launcher knows {', '.join(OWN_WORDS)}, what starts with rl., and what "
                "the script's map_hyperparameter takes."
            )
        self.apply_hyperparameter(name, value)

    def apply_hyperparameter(self, name: str, value: Any) -> None:
        """Lay a value into the preset later: rl.agent_params.algorithm.discount, rl.improve_steps:TrainingSteps."""
        print(f"Applying RL hyperparameter {name}={value}")
        self._laid.append((name, value))

    def launch(self) -> None:
        """Train."""
        words = _pairs(sys.argv[1:])
        preset = str(words.pop("RLCOACH_PRESET", None) or self.default_preset_name())
        for name, reason in (("num_workers", "worlds stand side by side in one process"),
                           ("save_model", "the run folder in the model is what was trained")):  # fmt: skip
            if words.pop(name, None) is not None:
                print(f"- {name}: {reason}")
        for name, value in words.items():
            self.map_hyperparameter(name, value)
        graph = _preset(preset)
        for name, value in self._laid:
            _apply_override(graph, name, value)
        train_preset(graph)

    @classmethod
    def train_main(cls) -> None:
        """Train what the preset describes."""
        cls().launch()


def _preset(name: str) -> Part:
    path = Path(sys.argv[0]).absolute().parent / f"{name}.py"
    if not path.is_file():
        beside = sorted(one.stem for one in path.parent.glob("preset*.py"))
        raise InputFileError(path, "there is no such preset", f"one of {', '.join(beside) or 'none stands there'}")
    print(f"Loading preset {name} from {path.parent}")
    graph = runpy.run_path(str(path)).get("graph_manager")
    if not isinstance(graph, Part):
        raise InputFileError(path, "it has no graph_manager", "graph_manager = BasicRLGraphManager(…)")
    return graph


def _apply_override(graph: Part, name: str, value: Any) -> None:
    """Lay one override into a preset; a word with :TYPE behind it is an amount."""
    path, _, kind = name.removeprefix("rl.").partition(":")
    if kind and kind not in AMOUNTS:
        raise SettingError(f"hyperparameter '{name}': no amount '{kind}'; expected one of {', '.join(AMOUNTS)}.")
    *before, last = path.split(".")
    place = graph
    for step in before:
        place = place[step]
    place[last] = Amount(kind, float(value)) if kind else value


def _pairs(words: list[str]) -> dict[str, Any]:
    """Return `--name value` pairs; a value that is JSON is read as such."""
    if len(words) % 2:
        raise SettingError(f"{' '.join(words)}: a name without a value; expected --name value in pairs.")
    found: dict[str, Any] = {}
    for name, value in zip(words[::2], words[1::2], strict=True):
        try:
            found[name.lstrip("-")] = json.loads(value)
        except ValueError:
            found[name.lstrip("-")] = value
    return found


__all__ = ["SageMakerCoachPresetLauncher"]
