"""The worlds, each a package that the core finds by its entry point. Begin with `contract/kind.py`.

Worlds do not import each other, and only `worlds/`, `sagemaker/` and `compat/` import from here.
"""
