"""`sagemaker.exceptions`."""

from racecraft.sagemaker.estimator import UnexpectedStatusException

__all__ = ["UnexpectedStatusException"]
