"""`sagemaker.analytics`."""

from racecraft.jobs.estimator import TrainingJobAnalytics
from racecraft.jobs.tuning.search_analytics import HyperparameterTuningJobAnalytics

__all__ = ["HyperparameterTuningJobAnalytics", "TrainingJobAnalytics"]
