"""`sagemaker.deserializers`."""

from racecraft.sagemaker.endpoint import JSONDeserializer, NumpyDeserializer

__all__ = ["JSONDeserializer", "NumpyDeserializer"]
