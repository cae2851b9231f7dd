"""Machine code on disk, kept under the content of all that it was made of.

numba takes the functions that a function calls, and the constants that it reads, into its machine code,
wherever they are written; but it asks only the function's own file whether what lies on disk is still true.
After an edit or an update of another file the old code would run on.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from types import CodeType, ModuleType
from typing import Any

import llvmlite
import numpy as np
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.runtime.nrt import rtsys
from numba.extending import typeof_impl

from twin.navigation._jit import Kernel


class KernelCache(FunctionCache):
    """numba's cache of one kernel, which tells machine code of other content apart."""

    def __init__(self, kernel: Dispatcher) -> None:
        super().__init__(kernel.py_func)  # type: ignore[no-untyped-call]
        self._kernel = kernel

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what lies on disk, or None.

        Machine code needs numba's runtime; of all else that a compilation needs it is loaded without.
        """
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        key = super()._index_key(sig, codegen)  # type: ignore[no-untyped-call]
        return (*key, content_hash(self._kernel))


@typeof_impl.register(Kernel)
def _typeof(kernel: Kernel, context: Any) -> Any:
    """Let kernels call each other."""
    return typeof_impl(kernel.dispatcher, context)


@cache
def content_hash(kernel: Dispatcher) -> str:
    """Return a hash of all that goes into the machine code of `kernel`.

    That is its code, the kernels that it calls, how each is compiled, the constants that any of them reads,
    and the compiler's version. All is taken as it was imported: a file may have been edited since.
    """
    digest = hashlib.sha256(llvmlite.__version__.encode())
    for part in _kernel_parts(kernel, set()):
        digest.update(part.encode())
        digest.update(b"\0")
    return digest.hexdigest()


def _kernel_parts(kernel: Dispatcher, seen: set[Dispatcher]) -> Iterator[str]:
    if kernel in seen:
        return
    seen.add(kernel)
    function, package = kernel.py_func, _package(kernel.py_func.__module__)
    yield _text(sorted(kernel.targetoptions.items()))
    yield _text((function.__defaults__, function.__kwdefaults__))
    for cell in function.__closure__ or ():
        yield from _value_parts(cell.cell_contents, (), package, seen)
    for code in _codes(function.__code__):
        constants = [value for value in code.co_consts if not isinstance(value, CodeType)]
        yield _text((code.co_code, constants, code.co_names, code.co_varnames, code.co_flags))
        for name in code.co_names:
            if name in function.__globals__:
                yield name
                yield from _value_parts(function.__globals__[name], code.co_names, package, seen)


def _codes(code: CodeType) -> Iterator[CodeType]:
    """Yield `code` and that of all functions and comprehensions in it."""
    yield code
    for value in code.co_consts:
        if isinstance(value, CodeType):
            yield from _codes(value)


def _value_parts(value: object, names: tuple[str, ...], package: str, seen: set[Dispatcher]) -> Iterator[str]:
    """Yield what tells `value` from another.

    Args:
        value: What a kernel reads.
        names: The names in the kernel's code: of a module's attributes, those that it may read.
        package: The kernel's; modules of others change with their version only.
        seen: The kernels that were asked already.
    """
    if isinstance(value, Kernel):
        yield from _kernel_parts(value.dispatcher, seen)
    elif isinstance(value, ModuleType):
        yield value.__name__
        if _package(value.__name__) == package:
            for name in names:
                if hasattr(value, name):
                    yield name
                    yield from _value_parts(getattr(value, name), names, package, seen)
    elif isinstance(value, np.ndarray):
        yield repr((value.dtype, value.shape, value.tobytes()))
    elif isinstance(value, type) or callable(value):
        yield f"{value.__module__}.{getattr(value, '__qualname__', '')}"
    else:
        yield _text(value)


def _text(value: object) -> str:
    """Return `value` as text that is the same in every process: a set of words is in no order."""
    if isinstance(value, tuple | list):
        return f"({', '.join(map(_text, value))})"
    if isinstance(value, set | frozenset):
        return f"{{{', '.join(sorted(map(_text, value)))}}}"
    return repr(value)


def _package(module: str) -> str:
    return module.partition(".")[0]
