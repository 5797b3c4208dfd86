"""What stands in each notebook, cell by cell: a string that begins with "# " is text, every other one is code.

`LOGS`, `RUN` and `TRACK` are put in when a notebook is written.
"""

from __future__ import annotations

HEAD = """from pathlib import Path

import racecraft as rc
from racecraft.worlds.deepracer.analysis import logs as analysis

LOGS = {logs!r}  # a run folder, a DeepRacer model, a console archive, a log; several in a list are rounds
logs = rc.logs.read(LOGS)
ticks = logs.ticks.collect()
training = logs.training.collect()
track = analysis.track_or_none(ticks, logs.about.get("world"))
print(f"{{len(logs.files)}} files, {{ticks.height:,}} steps, {{track.name if track else 'no known track'}}")
for damage in logs.damaged[:10]:
    print(damage)"""

TRAINING = (
    '# Training\nHow the training went. Every plot has its figures in `.data`, and `.save("name.png")`.',
    HEAD,
    'print(logs.about.get("hyperparameters", "no hyperparameters beside the log"))\nlogs.about.get("action_space")',
    "ticks.head()",
    "# Stability\nThe time between steps should be 67 ms; above 70 on average, or 90 for one of twenty, is trouble.",
    "analysis.stability(training)",
    "# The track\nWaypoints are numbered from the start line.",
    "from racecraft.worlds.deepracer.tracks.picture import draw_track\n\ntrack and draw_track(track)",
    "# Progress",
    "analysis.training_progress(training)",
    "# All laps, full laps, fifths",
    "analysis.scatter_of_laps(training)",
    'episodes = analysis.simulation_agg(training)\nfull = episodes.filter(episodes["complete"])\nprint(full.height, '
    '"full laps")\nfull.height and analysis.scatter_of_laps(training, complete=True)',
    "analysis.quintiles(training)",
    "# Tables",
    'analysis.best_laps(training, by="progress_share")',
    'full.sort("seconds").head(5)',
    'full.sort("reward", descending=True).head(5)',
    "# Where it paid\nThe iterations with the largest mean reward, their paths; the reward's mean in cells of 5 cm.",
    "track and analysis.top_iterations(training, track)",
    "track and analysis.reward_heat_map(training, track)",
    "# One iteration, one episode",
    "track and analysis.last_iteration(training, track)",
    'best = int(analysis.best_laps(training, by="progress_share")["unique_episode"][0])\n'
    "track and analysis.one_episode(training, track, best)",
    "analysis.episode_distributions(training, best)",
    "track and analysis.fitted_line(training, track, best)",
    "# Actions, segment by segment",
    "track and analysis.action_breakdown(training, track)",
    "# Where it leaves the road, and what to change",
    "left = episodes.height > full.height\ntrack and left and analysis.exit_points(training, track)",
    "from racecraft.worlds.deepracer.analysis.logs.advice import advice\n"
    "from racecraft.worlds.deepracer.analysis.logs.judged import judged_in_log\n\n"
    "judged = judged_in_log(logs.ticks.collect(), logs.metrics.collect())\n"
    "for one in advice(training, track, judged=judged):\n"
    '    print(f"{one.try_}\\n    {one.found}\\n")',
    "# Another reward for the same laps\nPut your own function here; it gets AWS's parameters, all of them right.",
    'def reward_function(params):\n    return params["speed"] if params["all_wheels_on_track"] else 1e-3\n\n\n'
    "track and analysis.new_reward(training, track, reward_function)",
)

EVALUATION = (
    "# Evaluation\nEvery evaluation and submission: laps, times, paths.",
    HEAD,
    'import polars as pl\n\nruns = ticks.filter(pl.col("phase") != "training")\nprint(runs.height, "steps of '
    'evaluations")',
    "runs.height and analysis.evaluation_table(runs)",
    "runs.height and track and analysis.evaluation_grid(runs, track)",
    'runs.height and track and analysis.evaluation_grid(runs, track, "reward")',
    "# Faster against slower",
    "done = analysis.simulation_agg(runs) if runs.height else None\n"
    'done is not None and done.sort("seconds").select("stream", "episode", "seconds", "distance_m", "speed_mps")',
    "done is not None and track and analysis.sector_times(runs, track).data if done is not None and "
    'done["complete"].any() else "no full lap"',
)

METRICS = (
    "# Metrics\nWhat AWS's metrics files tell of trainings, rounds and workers, without a single step.",
    HEAD,
    'where = Path(LOGS) if isinstance(LOGS, str) else Path(LOGS[0])\nfiles = sorted(where.glob("metrics/**/*.json"))\n'
    "metrics = logs.metrics.collect()\nif not metrics.height and files:\n"
    "    metrics = rc.logs.read(files).metrics.collect()\nmetrics.head()",
    "metrics.height and analysis.metrics_summary(metrics)",
    'metrics.height and analysis.metrics_summary(metrics, "median")',
    "metrics.height and analysis.metrics_best_laps(metrics)",
    "metrics.height and analysis.completion_progress(metrics)",
    'metrics.height and analysis.completion_progress(metrics, "max")',
    'lapped = metrics.height and bool((metrics["progress_share"] >= 1).any())\n'
    "lapped and analysis.lap_time_progress(metrics)",
    "metrics.height and analysis.lap_scatter(metrics)",
)

ACTION_SPACE = (
    "# Action space\nWhat the car chose, how often, and where. Continuous actions are put into even bins.",
    HEAD,
    "analysis.action_table(training)",
    "analysis.action_histogram(training)",
    'import polars as pl\n\nlast = training.filter(pl.col("iteration") == training["iteration"].max())\n'
    "analysis.action_histogram(last)",
    "analysis.action_space(training)",
    "analysis.action_sequences(training)",
    "track and analysis.action_index_map(training, track)",
    "track and analysis.action_heat_maps(training, track)",
    "track and analysis.reward_per_waypoint(training, track)",
    'best = int(analysis.best_laps(training, by="progress_share")["unique_episode"][0])\n'
    'track and analysis.one_episode(training, track, best, "steering_rad")',
)

VISUAL = (
    "# Visual analysis\nWhat the model looks at, and how sure it is. No TensorFlow.",
    "from pathlib import Path\n\nimport racecraft as rc\nfrom racecraft.worlds.deepracer.analysis.look_page import "
    "doubts_figure, sureness_figure, sureness_map\n"
    "from racecraft.worlds.deepracer.players.trained_car import load_trained_car\n"
    "from racecraft.worlds.deepracer.analysis.looking import look_at_lap, look_at_pictures\n\nRUN = {run!r}\n"
    "PICTURES = None  # a picture, a folder of them, or a film\ncar = load_trained_car(RUN)\nprint(car.checkpoint)",
    "lap = look_at_lap(car, car.trained_on)\nprint(lap.outcome)\nlap.surfaces",
    "sureness_figure(lap)",
    "sureness_map(lap)",
    "# Where it doubts most",
    "doubts_figure(lap)",
    "# Best against second best\nOn pictures of your own, or along the lap.",
    "look = look_at_pictures(car.policy, Path(PICTURES)) if PICTURES else lap.look\n"
    "[look.facts(row) for row in range(min(10, len(look)))]",
    "# As the training went\nThe same lap through the eyes of an earlier checkpoint.",
    "from racecraft.formats.checkpoint import Checkpoints\n\nshelf = Checkpoints(car.run.checkpoints)\n"
    'first = load_trained_car(RUN, "last")\nlook_at_lap(first, first.trained_on).surfaces',
)

LOG_ANALYSIS = (
    "# DeepRacer Log Analysis\nThe notebook of the 2019 workshops over local logs: `cw_utils` finds them, "
    "`log_analysis` reads and draws them, both under their old names.",
    'import os\n\nos.environ["RACECRAFT_RUNS"] = {runs!r}\n\nimport cw_utils as cw\nimport log_analysis as la',
    "# Download\nEvery simulation of a group as a file of its own: path, id, first and last time, the latest at the "
    "end.",
    'log_group = "/aws/robomaker/SimulationJobs"\nfetched = cw.download_all_logs("logs/deepracer-", log_group)\n'
    "for path, simulation, first, last in fetched:\n    print(path, simulation, first, last)",
    "fname = fetched[-1][0]\ndata = la.load_data(fname)\nEPISODES_PER_ITERATION = 20\n"
    "df = la.convert_to_pandas(data, None, EPISODES_PER_ITERATION)\ndf.head()",
    "# Reward per iteration and episode",
    "ticks = la.ticks_of(df)\ntrack = la.find_track(ticks)\nla.analyze_training_progress(ticks)",
    "# The track",
    "la.plot_trackpoints(track)",
    "# Top episodes, all rewards on the track",
    "action_map, episode_map, sorted_idx = la.episode_parser(data)\nsorted_idx[:10]",
    "la.plot_top_laps(ticks, track, 3)",
    "la.plot_track(ticks, track)",
    "# One episode",
    "la.plot_episode_run(ticks, track, sorted_idx[0])",
    "# Actions by segment, on every track",
    "la.action_breakdown(ticks, track)",
    "# One lap on a grid",
    'lap = df[df["episode"] == sorted_idx[0]]\nla.plot_grid_world(lap, 100 * track.inner, 100 * track.outer)',
)

COACH = (
    "# Train and evaluate a car\nWhat the SageMaker and RoboMaker notebook did, on this machine: no bucket, no "
    "role, no bill.",
    'from pathlib import Path\n\nimport racecraft as rc\n\nTRACK = {track!r}\nSTOPS = ["minutes=2"]\nSETTINGS = {{}}\n'
    'FOLDER = Path("my-car")\nFOLDER.mkdir(exist_ok=True)',
    "# The reward function\nWritten into your own folder; change it here.",
    'reward = """\ndef reward_function(params):\n    if not params["all_wheels_on_track"]:\n        return 1e-3\n'
    '    return 1.0 - 0.5 * params["distance_from_center"] / (0.5 * params["track_width"])\n"""\n'
    '(FOLDER / "reward_function.py").write_text(reward)',
    "# Train",
    'trained = rc.train("deepracer", folder=FOLDER, track=TRACK, stops=STOPS, settings=SETTINGS, quiet=True)\n'
    "print(trained.run.path)",
    "# The curve",
    "from racecraft.analysis.figures import draw_curves\n\nrun = rc.read_run(trained.run.path)\n"
    'draw_curves("curves.png", run.metrics().to_dicts(), score_name="progress (% of a lap)")',
    "# Evaluate",
    "rc.evaluate(trained.run.path, laps=3)",
    "# The log, and what to change",
    "from racecraft.worlds.deepracer.analysis import logs as analysis\n"
    "from racecraft.worlds.deepracer.analysis.logs.advice import advice\n\n"
    "logs = rc.logs.read(trained.run.path)\ncircuit = analysis.track_or_none(logs.ticks, "
    'logs.about.get("world"))\nadvice(logs.training.collect(), circuit)',
)

NOTEBOOKS = {
    "Training_analysis.ipynb": TRAINING,
    "Evaluation_analysis.ipynb": EVALUATION,
    "Metrics.ipynb": METRICS,
    "ActionSpace_analysis.ipynb": ACTION_SPACE,
    "Visual_Analysis.ipynb": VISUAL,
    "DeepRacer Log Analysis.ipynb": LOG_ANALYSIS,
    "rl_deepracer_robomaker_coach.ipynb": COACH,
}
"""Names as racers know them."""

CW_UTILS = '''"""Local logs under the names of the workshops' cw_utils: nothing is fetched, no account is needed."""

from types import SimpleNamespace

from racecraft.worlds.deepracer.logs.local_streams import (
    download_all_logs,
    download_log,
    get_log_events,
    iso_to_timestamp,
    streams,
)

boto3 = SimpleNamespace(__version__="none is needed")
"""The old notebook asks which boto3 there is."""

__all__ = ["boto3", "download_all_logs", "download_log", "get_log_events", "iso_to_timestamp", "streams"]
'''

LOG_ANALYSIS_MODULE = '''"""The workshops' log_analysis over local logs: centimetres and degrees, as it had them."""

from racecraft.worlds.deepracer.analysis.logs import find_track, simulation_agg
from racecraft.worlds.deepracer.analysis.logs.old_names import (
    action_breakdown,
    analyze_training_progress,
    make_error_boxes,
    plot_coords,
    plot_episode_run,
    plot_grid_world,
    plot_line,
    plot_top_laps,
    plot_track,
    plot_trackpoints,
    print_border,
)
from racecraft.worlds.deepracer.logs.old_names import (
    EPISODE_PER_ITER,
    convert_to_pandas,
    episode_parser,
    get_closest_waypoint,
    load_data,
    ticks_of,
)

__all__ = [
    "EPISODE_PER_ITER", "action_breakdown", "analyze_training_progress", "convert_to_pandas", "episode_parser",
    "find_track", "get_closest_waypoint", "load_data", "make_error_boxes", "plot_coords", "plot_episode_run",
    "plot_grid_world", "plot_line", "plot_top_laps", "plot_track", "plot_trackpoints", "print_border",
    "simulation_agg", "ticks_of",
]
'''
MODULES = {"cw_utils.py": CW_UTILS, "log_analysis.py": LOG_ANALYSIS_MODULE}
