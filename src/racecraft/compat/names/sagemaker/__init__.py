"""`sagemaker`, as the notebooks of SageMaker RL use it: jobs of this machine instead of AWS's.

Both versions of the SDK's names are understood. What is not here trains no agent.
"""

from racecraft.compat.names.sagemaker import analytics, estimator, exceptions, inputs, predictor, rl, session
from racecraft.compat.names.sagemaker import serializers as serializers
from racecraft.compat.names.sagemaker.analytics import HyperparameterTuningJobAnalytics, TrainingJobAnalytics
from racecraft.sagemaker.model import Model
from racecraft.sagemaker.session import Session, TrainingInput, get_execution_role

s3_input = TrainingInput

__all__ = [
    "HyperparameterTuningJobAnalytics",
    "Model",
    "Session",
    "TrainingJobAnalytics",
    "analytics",
    "estimator",
    "exceptions",
    "get_execution_role",
    "inputs",
    "predictor",
    "rl",
    "s3_input",
    "session",
]
