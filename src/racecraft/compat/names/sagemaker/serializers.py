"""`sagemaker.serializers`."""

from racecraft.jobs.endpoint import JSONSerializer, NumpySerializer

__all__ = ["JSONSerializer", "NumpySerializer"]
