"""`sagemaker.rl`."""

from racecraft.sagemaker.estimator import RLEstimator
from racecraft.sagemaker.estimator_words import RLFramework, RLToolkit

__all__ = ["RLEstimator", "RLFramework", "RLToolkit"]
