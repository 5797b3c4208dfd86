"""`sagemaker.inputs`."""

from racecraft.jobs.session import TrainingInput

__all__ = ["TrainingInput"]
