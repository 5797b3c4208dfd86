"""`sagemaker.analytics`."""

from racecraft.sagemaker.estimator import TrainingJobAnalytics
from racecraft.sagemaker.search_analytics import HyperparameterTuningJobAnalytics

__all__ = ["HyperparameterTuningJobAnalytics", "TrainingJobAnalytics"]
