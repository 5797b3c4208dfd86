"""What learners compute in one pass over memory; compiled with Numba by `kernels/compile.py`."""
