"""What Unity's scenes bring along as a world."""

from racecraft.contract.kind import Command, WorldKind

KIND = WorldKind(
    name="unity",
    title="Unity",
    training="racecraft.worlds.unity.training.trainer",
    train_command="racecraft unity train",
    train="racecraft.worlds.unity.actions.train:train",
    make_world="racecraft.worlds.unity.env.world:UnityWorld",
    gymnasium_envs={"racecraft/Unity-v0": ("racecraft.worlds.unity.env.gymnasium_env:unity_env", None)},
    evaluate="racecraft.worlds.unity.evaluation:judge_unity",
    demonstration_suffix=".demo",
    demonstrations="racecraft.worlds.unity.training.shown:read_demonstration_batch",
    console="racecraft.worlds.unity.console:UnityParts",
    commands=(Command("unity", "racecraft.worlds.unity.cli.unity:app"),),
    lessons="racecraft.worlds.unity.lessons",
    look="What a Unity scene looks like is seen in Unity; its curves are here.",
    exporters={"unity": "racecraft.worlds.unity.export.exporters:export_unity"},
    as_typed="racecraft.worlds.unity.training.run_advice:as_typed",
)
