"""The compiled kernel: what numpy is slow at, in C++, where a compiler was there to build it.

`kernel.cpp` is built by the installation. Without it everything is computed in numpy, the same
numbers more slowly: each function has its counterpart in the module that calls it.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import cython_blas

from human_gait.arrays import FloatArray

SWITCH = "HUMAN_GAIT_KERNEL"
"""Environment variable: ``0`` leaves the kernel out."""

LIBRARY, SOURCE = (Path(__file__).with_name(f"kernel.{end}") for end in ("library", "cpp"))


NONE = ctypes.c_void_p(None)
"""An array that is left out, where a function allows it."""


def _loaded() -> ctypes.CDLL | None:
    """Return the library; None if it is not built, or for another processor or version."""
    if os.environ.get(SWITCH) == "0":
        return None
    try:
        library = ctypes.CDLL(str(LIBRARY))
        library.kernel_source.restype = ctypes.c_char_p
        right = library.kernel_source().decode() == digest(SOURCE)
        if not right or not library.kernel_runs_here():
            return None
        library.use_blas(_dgemm())
    except (OSError, AttributeError, KeyError, ValueError):  # another file, another scipy
        return None
    return library


def digest(source: Path) -> str:
    """Return what tells the source of a library."""
    return hashlib.sha256(source.read_bytes()).hexdigest()


def _dgemm() -> ctypes.c_void_p:
    """Return the address of scipy's dgemm, which other compiled code may call."""
    capsule = cython_blas.__pyx_capi__["dgemm"]
    python = ctypes.pythonapi
    python.PyCapsule_GetName.restype, python.PyCapsule_GetName.argtypes = (
        ctypes.c_char_p,
        [ctypes.py_object],
    )
    python.PyCapsule_GetPointer.restype = ctypes.c_void_p
    python.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
    return ctypes.c_void_p(python.PyCapsule_GetPointer(capsule, python.PyCapsule_GetName(capsule)))


_BYTE = ctypes.c_char
_kernel = {"library": _loaded()}


def function(name: str) -> Callable[..., None] | None:
    """Return a function of the kernel; None if there is no kernel.

    It takes integers and arrays, `NONE` where one is left out, and `into`: arrays of doubles in C
    order that it writes to.
    """
    library = _kernel["library"]
    if library is None:
        return None
    compiled = getattr(library, name)

    def run(*arguments: Any, into: Sequence[FloatArray]) -> None:
        given = [_in_order(one) for one in arguments]  # as long as they are needed
        for one in into:
            if one.dtype != np.float64 or not one.flags.carray:
                raise TypeError(f"{name} writes to arrays of doubles in C order")
        compiled(*(_address(one) for one in (*given, *into)))

    return run


def optional(array: FloatArray | None) -> Any:
    """Return an array, or what stands for none."""
    return NONE if array is None else array


@contextmanager
def without() -> Iterator[None]:
    """Compute everything in numpy for a while."""
    kept = _kernel["library"]
    _kernel["library"] = None
    try:
        yield
    finally:
        _kernel["library"] = kept


def _in_order(one: Any) -> Any:
    """Return an argument as C reads it."""
    if one is None:
        raise TypeError("an array that is left out is kernel.NONE")
    if not isinstance(one, np.ndarray):
        return one
    return np.ascontiguousarray(one, dtype=np.float64 if one.dtype.kind == "f" else np.int32)


def _address(one: Any) -> Any:
    """Return an argument as it is passed: arrays by where they are."""
    if not isinstance(one, np.ndarray):
        return one
    if one.flags.writeable and one.size:  # in a third of the time
        return ctypes.byref(_BYTE.from_buffer(one))  # type: ignore[arg-type]
    return ctypes.c_void_p(one.ctypes.data)
