"""What Unity's scenes bring along as a world."""

from racecraft.contract.kind import Command, WorldKind

KIND = WorldKind(
    name="unity",
    title="Unity",
    training="racecraft.worlds.unity.training.trainer",
    train_command="racecraft unity train",
    commands=(Command("unity", "racecraft.worlds.unity.cli.unity:app"),),
)
