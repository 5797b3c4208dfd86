"""Optimise and translate a kernel once, in the whole that Python calls. Begin with `compiled_whole`.

Numba brings each function to machine code by itself and lays it into each caller, where it is optimised and translated
again, and again in that one's caller; a loop that threads share adds four copies of all that it calls. Half of what the
first training compiled were such copies. Here a kernel that is compiled because another calls it is a part, until
Python calls it as well:

    part     compiled for a caller: types and LLVM code, linked, not optimised, not translated; on disk as bitcode
    whole    compiled for Python: optimised and translated with all of its parts, as Numba does it, and with a way in
             that reads Python's arguments; where it was a part before, it is compiled anew

Results have the same bits: nothing here changes what LLVM may do to numbers.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numba
from numba import _dynfunc  # type: ignore[attr-defined]
from numba.core import codegen, cpu
from numba.core.compiler_lock import global_compiler_lock
from numba.core.environment import lookup_environment
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.sigutils import normalize_signature

_config: Any = numba.config
SHARED_LOOP = "__numba_parfor_gufunc"
"""How the names begin of what threads share."""
PART = "part"
"""What a part is called on disk, beside Numba's own "object" and "bitcode"."""
ENVIRONMENT = "_ZN08NumbaEnv"
"""How the names begin of what a function knows of Python."""


def compiled_whole(function: Callable[..., Any], **options: Any) -> Any:
    """Return a function compiled to plain IEEE and kept on disk; `options` are further ones of Numba's.

    Nobody takes it for a function of C, which would be a second way in to compile.
    """
    if _config.DISABLE_JIT:
        return function
    shared = {"nopython": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
    made: Any = Kernel(function, targetoptions={**shared, **options})
    made._compiler._customize_flags = _flags
    made.enable_caching()
    return made


class _Compiling(threading.local):
    """What this thread compiles."""

    def __init__(self) -> None:
        self.kernels: list[str] = []
        """By name; Python called the first, which calls the second, and so on."""


_compiling = _Compiling()


def _flags(flags: Any) -> Any:
    """Leave out of a part what reads Python's arguments."""
    flags.no_cpython_wrapper = len(_compiling.kernels) > 1
    return flags


class Kernel(CPUDispatcher):
    """A function that is compiled for each kind of arguments: a whole where Python calls it, else a part."""

    _cache: Any
    _compiler: Any

    def compile(self, sig: Any) -> Any:
        """Compile it for a signature, or fetch it from the disk; return what Python calls."""
        with global_compiler_lock:
            _compiling.kernels.append(self.py_func.__qualname__)
            try:
                entry = super().compile(sig)
                return self._as_whole(sig) if len(_compiling.kernels) == 1 else entry
            finally:
                _compiling.kernels.pop()

    def add_overload(self, cres: Any) -> None:
        """Take up what was compiled; a part is nothing that Python may call."""
        if cres.library.is_part:
            self.overloads[tuple(cres.signature.args)] = cres
        else:
            super().add_overload(cres)

    def _as_whole(self, sig: Any) -> Any:
        """Return what Python calls; see that its code knows of Python what its parts know."""
        arguments, returned = normalize_signature(sig)
        cres: Any = self.overloads[tuple(arguments)]
        if cres.library.is_part:
            cres = self._compiler.compile(arguments, returned)
            self.add_overload(cres)
            self._cache.save_overload(sig, cres)
        for variable in cres.library._final_module.global_variables:
            known = lookup_environment(variable.name) if variable.name.startswith(ENVIRONMENT) else None
            if known is not None:
                cres.library.codegen.set_env(variable.name, known)
        return cres.entry_point


class Library(codegen.JITCodeLibrary):
    """Code that is optimised and translated when its address is wanted, and not when it is linked to other code."""

    is_translated = False
    """Whether there is machine code."""
    is_part = False
    """Whether it was compiled for a kernel that calls it."""

    def finalize(self) -> None:
        """Link what it calls; `get_pointer_to_function` does the rest.

        A part that calls no other is optimised by itself, too: loops are best laid out before they stand in a caller.
        """
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self.is_part = _is_part(self)
        if self.is_part and not any(getattr(library, "is_part", False) for library in self._linking_libraries):
            self._optimize_final_module()
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return where the machine code of a function begins; 0 where there is no such function."""
        self._ensure_finalized()
        if not self.is_translated:
            self._codegen._check_llvm_bugs()
            self._shared_module = None
            self._optimize_final_module()
            self._final_module.verify()
            self._finalize_final_module()
            self.is_translated = True
        return int(super().get_pointer_to_function(name))

    def serialize_using_object_code(self) -> tuple[str, str, Any]:
        """Return what is kept on disk."""
        self._ensure_finalized()
        if self.is_part:
            return self.name, PART, self._final_module.as_bitcode()
        return super().serialize_using_object_code()

    @classmethod
    def _unserialize(cls, maker: Any, state: tuple[str, str, Any]) -> Any:
        name, kind, data = state
        if kind != PART:
            made = super()._unserialize(maker, state)
            made.is_translated = True
            return made
        made = maker.create_library(name)
        made.enable_object_caching()
        made._final_module = codegen.ll.parse_bitcode(data)
        made._finalized = made.is_part = True
        return made


class Code(codegen.JITCPUCodegen):
    """What makes libraries, and tells a function what it knows of Python."""

    _library_class = Library

    def set_env(self, env_name: str, env: Any) -> None:
        """Tell machine code where an environment is; a part has none, and its whole is told."""
        if self._engine.is_symbol_defined(env_name):
            super().set_env(env_name, env)


class Context(cpu.CPUContext):
    """Numba's context, in which a part has no way in from Python."""

    def get_executable(self, library: Any, fndesc: Any, env: Any) -> Any:
        """Return what Python calls; of a part, what stands for it and keeps alive what it knows of Python."""
        library._ensure_finalized()
        if library.is_part:
            return _dynfunc.make_function(fndesc.lookup_module(), fndesc.qualname, "", 0, env, (library,))
        return super().get_executable(library, fndesc, env)


def _is_part(library: Any) -> bool:
    """Tell whether a library is compiled for a kernel that calls it: another kernel, or the body of a shared loop."""
    _, *parts = _compiling.kernels or [""]
    return library.name in parts or library.name.startswith(SHARED_LOOP)


cpu_target.target_context.__class__ = Context
cpu_target.target_context.codegen().__class__ = Code
