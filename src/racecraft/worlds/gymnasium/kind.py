"""What Gymnasium's environments bring along as a world."""

from racecraft.contract.kind import Command, WorldKind

KIND = WorldKind(
    name="gymnasium",
    title="Gymnasium",
    training="racecraft.worlds.gymnasium.training.trainer",
    train_command="racecraft gym train",
    train="racecraft.worlds.gymnasium.actions.train:train",
    make_world="racecraft.worlds.gymnasium.env.from_gymnasium:make_world",
    judging_world="racecraft.worlds.gymnasium.evaluation:opened_judging_world",
    commands=(Command("gym", "racecraft.worlds.gymnasium.cli.gym:app"),),
    look="What a Gymnasium environment looks like stays in the environment; its curves are here.",
    console="racecraft.worlds.gymnasium.console:GymnasiumParts",
    as_typed="racecraft.worlds.gymnasium.training.run_advice:as_typed",
)
