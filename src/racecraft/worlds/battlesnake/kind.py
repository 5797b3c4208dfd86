"""What Battlesnake brings along as a world."""

from racecraft.contract.kind import Command, Score, WorldKind

KIND = WorldKind(
    name="battlesnake",
    title="Battlesnake",
    training="racecraft.worlds.battlesnake.training.trainer",
    train_command="racecraft snakes train",
    commands=(Command("snakes", "racecraft.worlds.battlesnake.cli.snakes:app"),),
    score=Score("rating (Elo)", "best checkpoint, rating", "rating"),
)
