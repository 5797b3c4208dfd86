"""`ray.rllib.models.modelv2`: what networks have in common."""

from __future__ import annotations

from typing import Any


class ModelV2:
    """A network that gives what decides, and then a value."""

    def __init__(
        self, obs_space: Any, action_space: Any, num_outputs: int, model_config: dict[str, Any], name: str,
        framework: str = "torch",
    ) -> None:  # fmt: skip
        self.obs_space, self.action_space, self.num_outputs = obs_space, action_space, num_outputs
        self.model_config, self.name, self.framework = model_config, name, framework

    def get_initial_state(self) -> list[Any]:
        """Return what is carried from tick to tick: nothing."""
        return []

    def forward(self, input_dict: dict[str, Any], state: list[Any], seq_lens: Any) -> tuple[Any, list[Any]]:
        """Return what decides, and the state."""
        raise NotImplementedError

    def value_function(self) -> Any:
        """Return the values of what was seen last."""
        raise NotImplementedError

    def __call__(
        self, input_dict: dict[str, Any], state: list[Any] | None = None, seq_lens: Any = None
    ) -> tuple[Any, list[Any]]:
        """Ask it."""
        return self.forward(input_dict, state or [], seq_lens)


__all__ = ["ModelV2"]
