"""Many policies of one shape, each with weights of its own, asked at once. Begin with `Population`.

Dense networks go by hand, one batched product a layer; whatever else (images, a user's own encoder) goes by PyTorch's
`vmap`. For 32 networks of 4-64-64-2 on one core the first takes about 40 µs a tick and the second 300 to 460, where one
network after the other takes 6 ms (PyTorch 2.13).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor, nn

from racecraft.algorithms.networks import ActorCritic, Encoder, Vector
from racecraft.contract.world import Array


class Population:
    """P policies.

    Args:
        network: One of that shape; its critic is left out.
        count: P.
    """

    def __init__(self, network: ActorCritic, count: int) -> None:
        self._one = PolicyAlone(network)
        self._by_hand = is_dense(network.policy_body)
        self._shapes = {name: part.shape for name, part in self._one.named_parameters()}
        self._weights: dict[str, Tensor] = {}
        for name, part in self._one.named_parameters():
            shape = part.shape[::-1] if self._by_hand and part.dim() == 2 else part.shape
            self._weights[name] = torch.zeros(count, *shape, device=part.device)
        self._chosen: tuple[bytes, dict[str, Tensor]] | None = None

    def put(self, member: int, weights: Tensor) -> None:
        """Give a member its weights: float32 (D,), parameter after parameter as `PolicyAlone` names them."""
        parts = weights.split([shape.numel() for shape in self._shapes.values()])
        for (name, shape), part in zip(self._shapes.items(), parts, strict=True):
            square = part.view(shape)
            self._weights[name][member] = square.T if self._by_hand and len(shape) == 2 else square
        self._chosen = None

    @torch.inference_mode()
    def params(self, observations: Mapping[str, Tensor], members: Array | None = None) -> Tensor:
        """Return the parameters of actions (R, P'), row i asked of member `members[i]`; None: of member i."""
        weights = self._weights if members is None else self._of(members)
        seen = {name: observations[name] for name in self._one.policy_body.names}
        if self._by_hand:
            return _dense(self._one, seen, weights)

        def asked(own: dict[str, Tensor], row: dict[str, Tensor]) -> Any:
            alone = {name: part.unsqueeze(0) for name, part in row.items()}
            return torch.func.functional_call(self._one, own, (alone,)).squeeze(0)

        found: Tensor = torch.func.vmap(asked)(weights, seen)
        return found

    def _of(self, members: Array) -> dict[str, Tensor]:
        """Return the weights of some members; the latest choice is kept, for it is asked tick after tick."""
        key = members.tobytes()
        if self._chosen is None or self._chosen[0] != key:
            which = torch.from_numpy(members)
            self._chosen = key, {name: part[which.to(part.device)] for name, part in self._weights.items()}
        return self._chosen[1]


class PolicyAlone(nn.Module):
    """A network's way from observations to the parameters of actions; the parameters are shared with it."""

    def __init__(self, network: ActorCritic) -> None:
        super().__init__()
        self.policy_body, self.policy_head = network.policy_body, network.policy_head

    def forward(self, observations: Mapping[str, Tensor]) -> Tensor:
        """Return the parameters of actions."""
        found: Tensor = self.policy_head(self.policy_body(observations).float())
        return found


def is_dense(body: nn.Module) -> bool:
    """Tell whether there are dense layers over vectors, and nothing else."""
    plain = (Vector, nn.Linear, nn.Tanh, nn.ReLU, nn.Sequential, nn.ModuleList)
    return type(body) is Encoder and all(isinstance(part, plain) for part in body.modules() if part is not body)


def _dense(one: PolicyAlone, seen: Mapping[str, Tensor], weights: Mapping[str, Tensor]) -> Tensor:
    """Return the parameters of actions, one batched product a layer."""

    def through(layers: Any, place: str, rows: Tensor) -> Tensor:
        for index, layer in enumerate(layers):
            if isinstance(layer, nn.Linear):
                bias = weights[f"{place}.{index}.bias"].unsqueeze(1)
                rows = torch.baddbmm(bias, rows, weights[f"{place}.{index}.weight"])
            else:
                rows = layer(rows).unsqueeze(1) if isinstance(layer, Vector) else layer(rows)
        return rows

    body: Any = one.policy_body
    parts = [
        through(layers, f"policy_body.embedders.{index}", seen[name])
        for index, (name, layers) in enumerate(zip(body.names, body.embedders, strict=True))
    ]
    features = through(body.trunk, "policy_body.trunk", torch.cat(parts, dim=2))
    head = weights["policy_head.bias"].unsqueeze(1)
    return torch.baddbmm(head, features, weights["policy_head.weight"]).squeeze(1)
