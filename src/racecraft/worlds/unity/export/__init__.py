"""Hand a policy over to Unity: the ONNX file that a scene loads."""
