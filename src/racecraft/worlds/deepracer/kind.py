"""What DeepRacer brings along as a world."""

from racecraft.contract.kind import EXCHANGE, JUDGE, TRAIN, UNDERSTAND, WORKSHOP, Command, Score, WorldKind

CLI = "racecraft.worlds.deepracer.cli"
EXPORT = "racecraft.worlds.deepracer.export.exporters"

KIND = WorldKind(
    name="deepracer",
    title="DeepRacer",
    training="racecraft.worlds.deepracer.training.trainer",
    train_command="racecraft train",
    names={
        "logs": "racecraft.worlds.deepracer.logs",
        "load_track": "racecraft.worlds.deepracer.tracks.catalogue:load_track",
    },
    imported_ahead=("racecraft.worlds.deepracer.training.trainer", f"{CLI}.dr.group", f"{CLI}.train"),
    warm_up="racecraft.worlds.deepracer.training.warm_up:warm_up",
    folder_settings=f"{CLI}.folder_settings:print_folder_settings",
    installation=f"{CLI}.installation:open_installation",
    make_world="racecraft.worlds.deepracer.env.making:make_world",
    gymnasium_envs={
        "racecraft/DeepRacer-v0": (
            "racecraft.worlds.deepracer.adapter:DeepRacerEnv",
            "racecraft.worlds.deepracer.adapter:deepracer_vector_env",
        )
    },
    open_run="racecraft.worlds.deepracer.players.borrowed:open_run_or_model",
    evaluate="racecraft.worlds.deepracer.evaluation.judged_run:judge_car",
    fresh_scores="racecraft.worlds.deepracer.evaluation.fresh_laps:fresh_laps",
    evaluate_words=("track", "tracks", "laps"),
    status_labels="racecraft.worlds.deepracer.files.training_metrics:STATUS_LABELS",
    commands=(
        Command("new", f"{CLI}.new:new", TRAIN),
        Command("check", f"{CLI}.check:check", TRAIN),
        Command("reward", f"{CLI}.reward:app", TRAIN),
        Command("train", f"{CLI}.train:train", TRAIN),
        Command("explain", f"{CLI}.explain:explain", TRAIN),
        Command("evaluate", f"{CLI}.evaluate:evaluate", JUDGE),
        Command("race", f"{CLI}.race:race", JUDGE),
        Command("leaderboards", f"{CLI}.leaderboards:leaderboards", JUDGE),
        Command("why", f"{CLI}.why:why", UNDERSTAND),
        Command("look", f"{CLI}.look:look", UNDERSTAND),
        Command("sensors", f"{CLI}.sensors:sensors", UNDERSTAND),
        Command("logs", f"{CLI}.logs:logs", UNDERSTAND),
        Command("telemetry", f"{CLI}.telemetry:telemetry", UNDERSTAND),
        Command("notebooks", f"{CLI}.notebooks:notebooks", UNDERSTAND),
        Command("replay", f"{CLI}.replay:replay", UNDERSTAND),
        Command("line", f"{CLI}.line:line", UNDERSTAND),
        Command("actions", f"{CLI}.actions:actions", UNDERSTAND),
        Command("tracks", f"{CLI}.tracks:app"),
        Command("import", f"{CLI}.import_model:import_", EXCHANGE),
        Command("init", f"{CLI}.init:init", EXCHANGE),
        Command("dr", f"{CLI}.dr.group:app", EXCHANGE, queues=("start-training",)),
        Command("bench", f"{CLI}.bench:app", WORKSHOP),
    ),
    score=Score(
        "progress (% of a lap)",
        "best checkpoint, mean progress",
        "progress %",
        figure="{:.1f} %",
        sentence="{:.3g} % of a lap",
        lowest=0.0,
        highest=100.0,
    ),
    facts="racecraft.worlds.deepracer.analysis.run_facts:car_facts",
    report_parts="racecraft.worlds.deepracer.analysis.report:report_parts",
    evaluation_table="racecraft.worlds.deepracer.analysis.evaluations:lap_table",
    advice="racecraft.worlds.deepracer.analysis.account:car_advice",
    watch="racecraft.worlds.deepracer.serving.watch:watch",
    console="racecraft.worlds.deepracer.console.parts:CarParts",
    exporters={
        "car": f"{EXPORT}:export_car",
        "drfc": f"{EXPORT}:export_aws",
        "console": f"{EXPORT}:export_aws",
        "onnx": f"{EXPORT}:export_file",
        "openvino": f"{EXPORT}:export_file",
        "tflite": f"{EXPORT}:export_file",
    },
    as_typed="racecraft.worlds.deepracer.analysis.account:as_typed",
)
