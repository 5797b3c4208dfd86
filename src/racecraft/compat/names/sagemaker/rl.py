"""`sagemaker.rl`."""

from racecraft.jobs.estimator import RLEstimator
from racecraft.jobs.estimator_words import RLFramework, RLToolkit

__all__ = ["RLEstimator", "RLFramework", "RLToolkit"]
