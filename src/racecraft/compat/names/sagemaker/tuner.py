"""`sagemaker.tuner`."""

from racecraft.jobs.tuning.estimator_trials import HyperparameterTuner
from racecraft.jobs.tuning.search_analytics import HyperparameterTuningJobAnalytics
from racecraft.jobs.tuning.space import CategoricalParameter, ContinuousParameter, IntegerParameter
from racecraft.jobs.tuning.warm_start import WarmStartConfig, WarmStartTypes

__all__ = [
    "CategoricalParameter",
    "ContinuousParameter",
    "HyperparameterTuner",
    "HyperparameterTuningJobAnalytics",
    "IntegerParameter",
    "WarmStartConfig",
    "WarmStartTypes",
]
