"""`ray.rllib.evaluation`: what callbacks are told of."""

from racecraft.compat.rllib_callbacks import Episode
from racecraft.compat.rllib_callbacks import Worlds as RolloutWorker

MultiAgentEpisode = Episode

__all__ = ["Episode", "MultiAgentEpisode", "RolloutWorker"]
