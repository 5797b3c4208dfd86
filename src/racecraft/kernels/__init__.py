"""The only importer of Numba: compile a function once, keep its machine code on disk. Begin with `compile.py`.

    compile.py   @kernel, @lean_kernel, @inner_kernel and @parallel_kernel, the cache and its key, threads
    whole.py     what Python calls becomes machine code with all that it calls, once
    rng.py    the compiled twins of contract.random_streams

A kernel module imports its decorators from here and nothing of Numba's own, so that CUDA can come in at the same place.
"""

from racecraft.kernels.compile import inner_kernel, kernel, lean_kernel, parallel_kernel, prange, set_threads, threads

__all__ = ["inner_kernel", "kernel", "lean_kernel", "parallel_kernel", "prange", "set_threads", "threads"]
