"""Shared memory of System V, as AFL++ hands it to its targets.

Segments are made and removed by AFL++; one stays attached until the process ends.
"""

from __future__ import annotations

import ctypes
import os

_FAILED = ctypes.c_void_p(-1).value


class _Description(ctypes.Structure):
    """Head of Linux's `struct shmid_ds` on 64-bit machines: `struct ipc_perm`, then the size (`man 2 shmctl`)."""

    _fields_ = (("permissions", ctypes.c_byte * 48), ("size", ctypes.c_size_t), ("rest", ctypes.c_byte * 128))


_IPC_STAT = 2


def attach(number: int) -> memoryview:
    """The segment as writable bytes. Raises OSError when there is none of this number."""
    library = ctypes.CDLL(None, use_errno=True)
    library.shmat.restype = ctypes.c_void_p
    library.shmat.argtypes = (ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
    library.shmctl.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.c_void_p)
    found = _Description()
    if library.shmctl(number, _IPC_STAT, ctypes.byref(found)):
        raise _last_error(number)
    address = library.shmat(number, None, 0)
    if address == _FAILED:
        raise _last_error(number)
    return memoryview((ctypes.c_ubyte * found.size).from_address(address)).cast("B")


def _last_error(number: int) -> OSError:
    code = ctypes.get_errno()
    return OSError(code, f"shared memory {number}: {os.strerror(code)}")
