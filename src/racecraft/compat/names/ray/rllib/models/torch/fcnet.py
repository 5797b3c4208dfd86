"""`ray.rllib.models.torch.fcnet`: dense layers over everything that is seen, two heads behind."""

from __future__ import annotations

from typing import Any

import numpy as np
from torch import Tensor, nn

from racecraft.compat.names.ray.rllib.models.torch.misc import SlimFC, normc_initializer
from racecraft.compat.names.ray.rllib.models.torch.torch_modelv2 import TorchModelV2


class FullyConnectedNetwork(TorchModelV2, nn.Module):
    """fcnet_hiddens dense layers with fcnet_activation behind each; values by a second row unless vf_share_layers."""

    def __init__(
        self, obs_space: Any, action_space: Any, num_outputs: int, model_config: dict[str, Any], name: str
    ) -> None:
        nn.Module.__init__(self)
        TorchModelV2.__init__(self, obs_space, action_space, num_outputs, model_config, name)
        size, units = int(np.prod(obs_space.shape)), list(model_config.get("fcnet_hiddens") or [])
        kind = model_config.get("fcnet_activation")
        width = units[-1] if units else size
        self._hidden_layers = _row(size, units, kind)
        self._value_branch_separate = None if model_config.get("vf_share_layers") else _row(size, units, kind)
        self._logits = SlimFC(width, num_outputs, normc_initializer(0.01))
        self._value_branch = SlimFC(width, 1, normc_initializer(0.01))
        self._values: Tensor | None = None

    def forward(self, input_dict: dict[str, Any], state: list[Any], seq_lens: Any) -> tuple[Any, list[Any]]:
        """Return what decides, and the state."""
        seen = input_dict["obs_flat"] if "obs_flat" in input_dict else input_dict["obs"]
        seen = seen.float().reshape(len(seen), -1)
        features = self._hidden_layers(seen)
        behind = features if self._value_branch_separate is None else self._value_branch_separate(seen)
        self._values = self._value_branch(behind).squeeze(1)
        return self._logits(features), state

    def value_function(self) -> Any:
        """Return the values of what was seen last."""
        assert self._values is not None, "must call forward() first"
        return self._values

    def __call__(self, input_dict: Any, state: Any = None, seq_lens: Any = None) -> Any:
        """Ask it."""
        return nn.Module.__call__(self, input_dict, state or [], seq_lens)


def _row(size: int, units: list[int], kind: Any) -> nn.Sequential:
    widths = [size, *units]
    layers = [SlimFC(a, b, normc_initializer(1.0), kind) for a, b in zip(widths, widths[1:], strict=False)]
    return nn.Sequential(*layers)


__all__ = ["FullyConnectedNetwork"]
