"""A script's own network, given to RLlib's `ModelCatalog`, as `network.policy`. Begin with `offered_model`.

A `TorchModelV2` is made as RLlib makes it: spaces, how many numbers it shall give, its configuration, its name. Spaces
are told from what the world promises: what is chosen is one-hot, and a dictionary also stands flattened
(`obs_flat`), with `original_space` beside. Numbers of continuous actions are means; their spread is free.
"""

from __future__ import annotations

import inspect
import itertools
import sys
import types
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import torch
from gymnasium import spaces
from torch import Tensor, nn

from racecraft.compat.stored_models import texts_of
from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.world import ActionSpec, ArraySpec, ContinuousActions, DiscreteActions, MultiDiscreteActions
from racecraft.training.custom_code import TRAVELS
from racecraft.worlds.gymnasium.env.spaces import SOLE_NAME

MODULE, NAME = "script_model_", "Model"
"""How the modules are called in which registered models are found, and what each is called there."""
TENSORFLOW = ("TFModelV2", "Model", "RecurrentTFModelV2", "DistributionalQTFModel")
"""Bases of models that run on TensorFlow only."""
TORCH = "TorchModelV2"
DEFAULTS: Mapping[str, Any] = {
    "fcnet_hiddens": [256, 256], "fcnet_activation": "tanh", "conv_filters": None, "conv_activation": "relu",
    "free_log_std": False, "no_final_linear": False, "vf_share_layers": False, "use_lstm": False, "max_seq_len": 20,
    "lstm_cell_size": 256, "custom_model_config": {}, "custom_options": {},
}  # fmt: skip
"""RLlib's, where a script says nothing of its model."""
_registered: dict[str, type] = {}


class ScriptModel(nn.Module):
    """One of RLlib's models as racecraft asks for a network.

    Args:
        observations: What is seen, by name.
        actions: What is decided.
        outputs: How many numbers describe a decision.
    """

    made_by: ClassVar[type]
    told: ClassVar[Mapping[str, Any]]

    def __init__(self, observations: Mapping[str, ArraySpec], actions: ActionSpec, outputs: int) -> None:
        super().__init__()
        self._is_dict = set(observations) != {SOLE_NAME}
        seen = {name: _space(part) for name, part in observations.items()}
        flat = _flat(seen) if self._is_dict else seen[SOLE_NAME]
        words = {**self.told.get("custom_options", {}), **self.told.get("custom_model_config", {})}
        self.model: Any = self.made_by(
            flat, _action_space(actions), outputs, dict(self.told), "default_model", **_taken(self.made_by, words)
        )
        if not isinstance(self.model, nn.Module):
            raise TypeError(f"{self.made_by.__name__} is no torch.nn.Module; expected one, beside {TORCH}")
        first_state: Any = getattr(self.model, "get_initial_state", None)
        if callable(first_state) and first_state():
            raise TypeError(
                f"{self.made_by.__name__} has a state of its own; expected a model without, or leave custom_model out "
                "and say use_lstm"
            )

    def forward(self, observations: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Return what decides, (R, outputs), and the values (R,)."""
        floats = {name: part.float() for name, part in observations.items()}
        flat = torch.cat([floats[name].flatten(1) for name in sorted(floats)], dim=1)
        seen = floats if self._is_dict else floats[SOLE_NAME]
        decided, _ = self.model.forward({"obs": seen, "obs_flat": flat, "is_training": self.training}, [], None)
        return decided, self.model.value_function().reshape(-1)


def register_model(name: str, made_by: type) -> None:
    """Keep a script's model under a name."""
    _registered[name] = made_by


def offered_model(name: str, config: Mapping[str, Any]) -> str:
    """Have a registered model be found as "module:Class"; return that name.

    Raises:
        SettingError: Nobody registered it, or it runs on TensorFlow.
    """
    made_by = _registered.get(name)
    if made_by is None:
        raise SettingError(
            "config.model.custom_model is {name!r}, which nobody gave to ModelCatalog.register_custom_model. {hint}",
            name=name,
            hint=nearest(str(name), _registered),
        )
    bases = [base.__name__ for base in made_by.__mro__]
    if TORCH not in bases:
        kind = next((f"a TensorFlow model ({base})" for base in TENSORFLOW if base in bases), f"no {TORCH}")
        raise SettingError(
            "config.model.custom_model is {name!r}: {made_by} is {kind}, and networks are PyTorch's here. "
            'Leave it out, with the hyperparameter rl.training.config.model.custom_model="": our own network follows '
            "fcnet_hiddens and conv_filters, and heeds an observation `action_mask`. Or write it as a {torch}.",
            name=name,
            made_by=made_by.__name__,
            kind=kind,
            torch=TORCH,
        )
    known = "".join(letter if letter.isalnum() else "_" for letter in f"{MODULE}{name}_{next(_numbers)}")
    made = types.ModuleType(known)
    made.__dict__[NAME] = model_of(made_by, config)
    made.__dict__[TRAVELS] = texts_of(made_by, known, config)
    sys.modules[known] = made
    return f"{known}:{NAME}"


def model_of(made_by: type, config: Mapping[str, Any]) -> type[ScriptModel]:
    """Return a script's model as racecraft asks for a network."""
    return type(NAME, (ScriptModel,), {"made_by": made_by, "told": {**DEFAULTS, **config}})


_numbers = itertools.count()


def _taken(made_by: type, words: Mapping[str, Any]) -> dict[str, Any]:
    """Return the words of its own that a model's maker takes by name."""
    known = inspect.signature(made_by).parameters
    takes_any = any(one.kind is inspect.Parameter.VAR_KEYWORD for one in known.values())
    return {name: value for name, value in words.items() if takes_any or name in known}


def _space(part: ArraySpec) -> spaces.Box:
    return spaces.Box(float(part.low), float(part.high), part.shape, np.float32)


def _flat(seen: Mapping[str, spaces.Box]) -> spaces.Box:
    size = sum(int(np.prod(space.shape)) for space in seen.values())
    flat = spaces.Box(-np.inf, np.inf, (size,), np.float32)
    flat.original_space = spaces.Dict(dict(seen))  # type: ignore[attr-defined]
    return flat


def _action_space(actions: ActionSpec) -> spaces.Space[Any]:
    if isinstance(actions, DiscreteActions):
        return spaces.Discrete(actions.count)
    if isinstance(actions, MultiDiscreteActions):
        return spaces.MultiDiscrete(list(actions.counts))
    assert isinstance(actions, ContinuousActions), "an environment's actions are choices or numbers"
    return spaces.Box(np.array(actions.low, np.float32), np.array(actions.high, np.float32))
