"""`sagemaker.tuner`."""

from racecraft.jobs.tuning.estimator_trials import HyperparameterTuner
from racecraft.jobs.tuning.space import CategoricalParameter, ContinuousParameter, IntegerParameter

__all__ = ["CategoricalParameter", "ContinuousParameter", "HyperparameterTuner", "IntegerParameter"]
