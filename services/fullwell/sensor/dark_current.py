"""Dark current: electrons that the silicon makes without light."""

from __future__ import annotations

__all__ = ["dark_electrons"]


def dark_electrons(*, dark_current_e_per_s: float, exposure_time_s: float) -> float:
    """Return the mean dark electrons of a pixel [e-]. Their shot noise is that of all electrons in the well.

    References
    ----------
    janesick2007, chapter 3; emva1288.
    """
    return dark_current_e_per_s * exposure_time_s
