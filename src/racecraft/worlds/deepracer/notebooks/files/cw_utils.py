"""Local logs under the names of the workshops' cw_utils: nothing is fetched, no account is needed."""

from types import SimpleNamespace

from racecraft.worlds.deepracer.logs.local_streams import (
    LEADERBOARDS,
    SIMULATIONS,
    download_all_logs,
    download_log,
    get_log_events,
    iso_to_timestamp,
    simulation_id,
    streams,
)

boto3 = SimpleNamespace(__version__="none is needed")
"""The old notebook asks which boto3 there is."""

__all__ = ["LEADERBOARDS", "SIMULATIONS", "boto3", "download_all_logs", "download_log", "get_log_events", "iso_to_timestamp", "simulation_id", "streams"]
