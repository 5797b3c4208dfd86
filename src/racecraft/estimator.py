"""SageMaker's estimator for reinforcement learning, on this machine; `racecraft.jobs.estimator` tells how it works.

from racecraft.estimator import RLEstimator, RLFramework, RLToolkit
"""

from racecraft.jobs.endpoint import Predictor
from racecraft.jobs.estimator import RLEstimator, TrainingJob, TrainingJobAnalytics, UnexpectedStatusException
from racecraft.jobs.estimator_words import RLFramework, RLToolkit
from racecraft.jobs.session import Session, TrainingInput, get_execution_role
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
    "Predictor",
    "RLEstimator",
    "RLFramework",
    "RLToolkit",
    "Session",
    "TrainingInput",
    "TrainingJob",
    "TrainingJobAnalytics",
    "UnexpectedStatusException",
    "WarmStartConfig",
    "WarmStartTypes",
    "get_execution_role",
]
