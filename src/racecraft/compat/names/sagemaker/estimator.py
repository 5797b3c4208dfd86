"""`sagemaker.estimator`: of the many, the one that trains agents."""

from racecraft.sagemaker.estimator import RLEstimator

__all__ = ["RLEstimator"]
