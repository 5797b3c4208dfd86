"""Unity scenes in another program, over ML-Agents' protocol. Begin with `kind.py`, then `env/wire.py`.

files (demonstrations, trainer configuration) → env (wire, session, world) → training → export (ONNX for Unity) → cli.
"""
