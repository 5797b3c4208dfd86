"""`sagemaker.serializers`."""

from racecraft.sagemaker.endpoint import JSONSerializer, NumpySerializer

__all__ = ["JSONSerializer", "NumpySerializer"]
