"""What a tuner of SageMaker's shape begins with: the jobs of earlier ones."""

from __future__ import annotations

from collections.abc import Collection
from enum import Enum

from racecraft.contract.errors import SettingError


class WarmStartTypes(Enum):
    """What has changed since the earlier searches."""

    IDENTICAL_DATA_AND_ALGORITHM = "IdenticalDataAndAlgorithm"
    """Nothing but ranges and counts: figures may be compared, and the best of all searches is told."""
    TRANSFER_LEARNING = "TransferLearning"
    """Data, script or settings, too."""


class WarmStartConfig:
    """Which searches another one begins with.

    Args:
        warm_start_type: What has changed since.
        parents: Names of these searches.

    Raises:
        SettingError: It is no `WarmStartTypes`, or no parent is named.
    """

    def __init__(self, warm_start_type: WarmStartTypes, parents: Collection[str]) -> None:
        if not isinstance(warm_start_type, WarmStartTypes):
            known = ", ".join(f"WarmStartTypes.{one.name}" for one in WarmStartTypes)
            raise SettingError(
                "warm_start_type is {warm_start_type!r}; expected one of {known}.",
                warm_start_type=warm_start_type,
                known=known,
            )
        if not parents:
            raise SettingError("WarmStartConfig has no parents; expected the names of one or more earlier searches.")
        self.type = warm_start_type
        self.parents = {parents} if isinstance(parents, str) else set(parents)
