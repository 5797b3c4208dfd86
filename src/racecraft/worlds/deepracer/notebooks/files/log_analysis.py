"""The workshops' log_analysis over local logs: centimetres and degrees, as it had them."""

from racecraft.worlds.deepracer.analysis.logs import (
    evaluation_grid,
    evaluation_table,
    find_track,
    rewards_and_lengths,
    simulation_agg,
)
from racecraft.worlds.deepracer.analysis.logs.workshop_plots import (
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
from racecraft.worlds.deepracer.logs.workshop_api import (
    EPISODE_PER_ITER,
    convert_to_pandas,
    episode_parser,
    get_closest_waypoint,
    load_data,
    ticks_of,
)

__all__ = [
    "EPISODE_PER_ITER", "action_breakdown", "analyze_training_progress", "convert_to_pandas", "episode_parser",
    "evaluation_grid", "evaluation_table",
    "find_track", "get_closest_waypoint", "load_data", "make_error_boxes", "plot_coords", "plot_episode_run",
    "plot_grid_world", "plot_line", "plot_top_laps", "plot_track", "plot_trackpoints", "print_border",
    "rewards_and_lengths", "simulation_agg", "ticks_of",
]
