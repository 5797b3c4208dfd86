"""`sagemaker.estimator`: of the many, the one that trains agents."""

from racecraft.jobs.estimator import RLEstimator

__all__ = ["RLEstimator"]
