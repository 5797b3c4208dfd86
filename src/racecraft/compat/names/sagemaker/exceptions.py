"""`sagemaker.exceptions`."""

from racecraft.jobs.estimator import UnexpectedStatusException

__all__ = ["UnexpectedStatusException"]
