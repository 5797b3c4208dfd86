"""`ray.rllib.evaluation.episode`."""

from racecraft.compat.rllib_callbacks import Episode

MultiAgentEpisode = Episode

__all__ = ["Episode", "MultiAgentEpisode"]
