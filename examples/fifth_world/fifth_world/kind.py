"""What the corridor brings along; pyproject.toml registers it. `WorldKind` says what each line does."""

from racecraft.contract.kind import Command, Score, WorldKind

KIND = WorldKind(
    name="corridor",
    title="Corridor",
    training="fifth_world.training:TRAINING",
    train_command="racecraft corridor train",
    train="fifth_world.actions:train",
    commands=(Command("corridor", "fifth_world.cli:app"),),
    make_world="fifth_world.world:Corridor",
    judging_world="fifth_world.training:TRAINING.judging_world",
    exporters={"table": "fifth_world.export:export_table"},
    score=Score("return (1 at the exit, -0.01 a step)", "best checkpoint, mean return", "return"),
)
