"""`sagemaker.analytics`."""

from racecraft.jobs.estimator import TrainingJobAnalytics

__all__ = ["TrainingJobAnalytics"]
