"""Every plot and table that racers had, from one table of ticks: any log, any track, either direction.

    import racecraft.worlds.deepracer.logs
    from racecraft.worlds.deepracer.analysis.logs import find_track, reward_heat_map

    logs = racecraft.worlds.deepracer.logs.read("my-model")
    track = find_track(logs.ticks, logs.about.get("world"))
    plot = reward_heat_map(logs.training, track)     # plot.data, plot.figure, plot.save("heat.png")

Functions take the table of `racecraft.worlds.deepracer.logs` and nothing else of that package. Those that return
a `Plot` have data and a figure; those that return a table are data alone. Named as in the notebooks of
deepracer-analysis and in log-guru.
"""

from racecraft.analysis.custom_plots import own_plots
from racecraft.analysis.plot import Plot, PlotError
from racecraft.worlds.deepracer.analysis.logs.actions import (
    action_breakdown,
    action_histogram,
    action_index_map,
    action_names,
    action_space,
    action_table,
)  # fmt: skip
from racecraft.worlds.deepracer.analysis.logs.circuit import circuit_of, find_track, on_track, track_or_none
from racecraft.worlds.deepracer.analysis.logs.episodes import per_iteration, simulation_agg
from racecraft.worlds.deepracer.analysis.logs.evaluations import evaluation_grid, evaluation_table
from racecraft.worlds.deepracer.analysis.logs.exits import endings, exit_points, exits_by_segment, exits_by_segment_plot
from racecraft.worlds.deepracer.analysis.logs.fitting import fitted_line
from racecraft.worlds.deepracer.analysis.logs.heat import action_heat_maps, cells, reward_heat_map
from racecraft.worlds.deepracer.analysis.logs.laps import (
    lap_correlations,
    lap_features,
    lap_times,
    sector_correlations,
    sector_losses,
    sector_times,
)  # fmt: skip
from racecraft.worlds.deepracer.analysis.logs.lengths import rewards_and_lengths
from racecraft.worlds.deepracer.analysis.logs.motion import (
    best_episode_distributions,
    episode_distributions,
    slides,
    with_motion,
)  # fmt: skip
from racecraft.worlds.deepracer.analysis.logs.paths import (
    best_laps,
    last_iteration,
    one_episode,
    one_iteration,
    selected_laps,
    top_iterations,
)  # fmt: skip
from racecraft.worlds.deepracer.analysis.logs.progress import training_progress
from racecraft.worlds.deepracer.analysis.logs.rescoring import new_reward, reward_params
from racecraft.worlds.deepracer.analysis.logs.rewards import common_rewards, discount_tester, reward_distribution
from racecraft.worlds.deepracer.analysis.logs.rounds import (
    completion_progress,
    lap_scatter,
    lap_time_progress,
    metrics_best_laps,
    metrics_summary,
)  # fmt: skip
from racecraft.worlds.deepracer.analysis.logs.scatter import quintiles, scatter_of_laps
from racecraft.worlds.deepracer.analysis.logs.segments import find_segments, in_segments, segments_plot
from racecraft.worlds.deepracer.analysis.logs.sequences import action_sequences
from racecraft.worlds.deepracer.analysis.logs.step_times import stability
from racecraft.worlds.deepracer.analysis.logs.straights import straights_and_curves
from racecraft.worlds.deepracer.analysis.logs.waypoints import reward_per_waypoint

__all__ = [
    "Plot", "PlotError", "action_breakdown", "action_heat_maps", "action_histogram", "action_index_map",
    "action_names", "action_sequences", "action_space", "action_table", "best_episode_distributions", "best_laps",
    "cells", "circuit_of", "common_rewards", "completion_progress", "discount_tester", "endings",
    "episode_distributions",
    "evaluation_grid", "evaluation_table", "exit_points", "exits_by_segment", "exits_by_segment_plot", "find_segments",
    "find_track", "fitted_line", "in_segments", "lap_correlations", "lap_features", "lap_scatter", "lap_time_progress",
    "lap_times", "last_iteration", "metrics_best_laps", "metrics_summary", "new_reward", "on_track", "one_episode",
    "one_iteration", "own_plots", "per_iteration", "quintiles", "reward_distribution", "reward_heat_map",
    "reward_params", "reward_per_waypoint", "rewards_and_lengths", "scatter_of_laps", "sector_correlations",
    "sector_losses", "sector_times", "segments_plot", "selected_laps", "simulation_agg", "slides", "stability",
    "straights_and_curves", "top_iterations", "track_or_none", "training_progress", "with_motion",
]  # fmt: skip
