"""`sagemaker.deserializers`."""

from racecraft.jobs.endpoint import JSONDeserializer, NumpyDeserializer

__all__ = ["JSONDeserializer", "NumpyDeserializer"]
