"""SageMaker's estimator for reinforcement learning, on this machine; see `racecraft.sagemaker.estimator`.

from racecraft.estimator import RLEstimator, RLFramework, RLToolkit
"""

from racecraft.jobs.tuning.space import CategoricalParameter, ContinuousParameter, IntegerParameter
from racecraft.jobs.tuning.warm_start import WarmStartConfig, WarmStartTypes
from racecraft.sagemaker.endpoint import Predictor
from racecraft.sagemaker.estimator import RLEstimator, TrainingJob, TrainingJobAnalytics, UnexpectedStatusException
from racecraft.sagemaker.estimator_config import RLFramework, RLToolkit
from racecraft.sagemaker.estimator_trials import HyperparameterTuner
from racecraft.sagemaker.search_analytics import HyperparameterTuningJobAnalytics
from racecraft.sagemaker.session import Session, TrainingInput, get_execution_role

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
