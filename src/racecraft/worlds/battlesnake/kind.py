"""What Battlesnake brings along as a world."""

from racecraft.contract.kind import Command, Score, WorldKind

KIND = WorldKind(
    name="battlesnake",
    title="Battlesnake",
    training="racecraft.worlds.battlesnake.training.trainer",
    train_command="racecraft snakes train",
    train="racecraft.worlds.battlesnake.actions.train:train",
    make_world="racecraft.worlds.battlesnake.env.making:make_world",
    gymnasium_envs={
        "racecraft/Battlesnake-v0": (
            "racecraft.worlds.battlesnake.players.gymnasium_env:SnakeEnv",
            "racecraft.worlds.battlesnake.players.gymnasium_env:snake_vector_env",
        )
    },
    evaluate="racecraft.worlds.battlesnake.evaluation.judged_run:judge_snake",
    fresh_scores="racecraft.worlds.battlesnake.evaluation.fresh_games:fresh_games",
    commands=(Command("snakes", "racecraft.worlds.battlesnake.cli.snakes:app"),),
    score=Score("rating (Elo)", "best checkpoint, rating", "rating"),
    evaluation_table="racecraft.worlds.battlesnake.analysis.evaluations:rating_table",
    look=(
        "A snake's training games are not kept; its curves are here. "
        "`racecraft snakes watch --live --url RUN --url search` plays one before your eyes."
    ),
    export_instead="`racecraft snakes serve RUN` plays it on any board, rc.load_policy('RUN') loads it in Python.",
    names={"create_snake_race": "racecraft.worlds.battlesnake.actions.create_race:create_snake_race"},
    race_commands=(Command("create-snakes", "racecraft.worlds.battlesnake.cli.create_race:create"),),
    league="racecraft.worlds.battlesnake.league.races:SnakeLeague",
    console="racecraft.worlds.battlesnake.console:SnakeParts",
    lessons="racecraft.worlds.battlesnake.lessons",
    as_typed="racecraft.worlds.battlesnake.analysis.run_advice:as_typed",
)
