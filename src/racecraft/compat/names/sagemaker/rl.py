"""`sagemaker.rl`."""

from racecraft.sagemaker.estimator import RLEstimator
from racecraft.sagemaker.estimator_config import RLFramework, RLToolkit

__all__ = ["RLEstimator", "RLFramework", "RLToolkit"]
