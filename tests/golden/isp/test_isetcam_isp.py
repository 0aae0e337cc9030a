"""ISETCam's demosaicing, which is the plain bilinear one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fullwell.isp.demosaic import demosaic_bilinear

GOLDEN_TOLERANCE = 1e-12
"""Absolute, of values up to 1; means of four numbers."""


def test_bilinear_demosaicing_of_all_four_bayer_orders_is_isetcams(reference: Callable[[str], Any]) -> None:
    cases = reference("isetcam/ip_demosaic.json")["cases"]
    assert len(cases) == 4
    for case in cases:
        pattern = tuple(tuple("RGB"[code - 1] for code in row) for row in case["pattern_1R2G3B"])
        found = demosaic_bilinear(np.array(case["mosaic"]), pattern, ("R", "G", "B"))
        np.testing.assert_allclose(found, case["bilinear_rgb"], rtol=0, atol=GOLDEN_TOLERANCE)
