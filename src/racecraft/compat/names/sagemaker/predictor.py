"""`sagemaker.predictor`, in the names of both versions of the SDK."""

from racecraft.sagemaker.endpoint import JSONDeserializer, JSONSerializer, Predictor

RealTimePredictor = Predictor
json_serializer = JSONSerializer()
json_deserializer = JSONDeserializer()

__all__ = ["Predictor", "RealTimePredictor", "json_deserializer", "json_serializer"]
