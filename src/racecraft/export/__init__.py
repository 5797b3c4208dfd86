"""A policy as files that other programs load. Begin with `policy_onnx.py`.

The layers of a policy as ONNX are made here; a world adds the formats of its own programs through its kind.
"""
