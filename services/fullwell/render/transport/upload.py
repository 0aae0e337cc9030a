"""Host arrays on the device, in memory whose alignment does not depend on chance."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["upload"]

_ALIGNMENT = 64


def upload(kind: Any, values: NDArray[Any]) -> Any:
    """Return a flat device array of type `kind` (say ``mi.UInt32``) with a copy of `values`.

    Dr.Jit works on the host array's own memory, and writes into its code how that is aligned: with NumPy's 16 bytes, which
    are 64 by chance, the same kernel would be compiled again every now and then.
    """
    flat = np.ravel(values)
    room = np.empty(flat.nbytes + _ALIGNMENT, dtype=np.uint8)
    start = -room.ctypes.data % _ALIGNMENT
    aligned = room[start : start + flat.nbytes].view(flat.dtype)
    aligned[:] = flat
    return kind(aligned)
