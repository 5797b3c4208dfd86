"""`sagemaker.inputs`."""

from racecraft.sagemaker.session import TrainingInput

__all__ = ["TrainingInput"]
