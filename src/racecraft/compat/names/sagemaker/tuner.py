"""`sagemaker.tuner`."""

from racecraft.jobs.tuning.space import CategoricalParameter, ContinuousParameter, IntegerParameter
from racecraft.jobs.tuning.warm_start import WarmStartConfig, WarmStartTypes
from racecraft.sagemaker.estimator_trials import HyperparameterTuner
from racecraft.sagemaker.search_analytics import HyperparameterTuningJobAnalytics

__all__ = [
    "CategoricalParameter",
    "ContinuousParameter",
    "HyperparameterTuner",
    "HyperparameterTuningJobAnalytics",
    "IntegerParameter",
    "WarmStartConfig",
    "WarmStartTypes",
]
