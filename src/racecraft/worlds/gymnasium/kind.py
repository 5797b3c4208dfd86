"""What Gymnasium's environments bring along as a world."""

from racecraft.contract.kind import Command, WorldKind

KIND = WorldKind(
    name="gymnasium",
    title="Gymnasium",
    training="racecraft.worlds.gymnasium.training.trainer",
    train_command="racecraft gym train",
    commands=(Command("gym", "racecraft.worlds.gymnasium.cli.gym:app"),),
)
