"""Why a car's run cannot be exported, from the head of its checkpoint: a page shows it in place of buttons."""

from __future__ import annotations

from racecraft.algorithms.plain_layers import require_plain_layers
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import RacecraftError
from racecraft.formats.checkpoint import BEST, Checkpoints
from racecraft.formats.run_folder import RunFolder


def export_refusal(run: RunFolder) -> str:
    """Return the sentence with which every exporter refuses the best checkpoint; "": its network can be exported."""
    try:
        require_plain_layers(PolicySpec.from_dictionary(Checkpoints(run.checkpoints).read_card(BEST)["policy_spec"]))
    except (RacecraftError, KeyError, TypeError) as error:
        return str(error)
    return ""
