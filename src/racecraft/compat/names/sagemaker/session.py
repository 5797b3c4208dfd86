"""`sagemaker.session`."""

from racecraft.sagemaker.session import Session, TrainingInput, get_execution_role

s3_input = TrainingInput

__all__ = ["Session", "get_execution_role", "s3_input"]
