"""Rolling shutter: rows start one after the other."""

from __future__ import annotations

__all__ = ["readout_duration_s"]


def readout_duration_s(*, rows: int, line_time_s: float) -> float:
    """Return how much later the last row starts and ends than the first [s]; 0 for a global shutter.

    Row r starts at r x `line_time_s` (RawImage.row_start_s) and integrates for the exposure time. The light is taken as
    constant while the frame lasts: motion within it is the renderer's.
    """
    return (rows - 1) * line_time_s
