"""`ray.rllib.models.torch.torch_modelv2`: the base of PyTorch's networks; a script's own is an `nn.Module`, too."""

from racecraft.compat.names.ray.rllib.models.modelv2 import ModelV2


class TorchModelV2(ModelV2):
    """A network of PyTorch's."""


__all__ = ["TorchModelV2"]
