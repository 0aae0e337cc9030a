"""What the rays through the pixels meet: the raw material of every label."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["SurfaceHits"]


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceHits:
    """First and hidden surfaces along the rays through the pixel centres, and along further rays where objects meet.

    Attributes
    ----------
    object_index
        (rows, cols) int32, index into ``scene.objects``; -1 where the ray meets nothing.
    range_m
        (rows, cols) float32, distance along the ray from the centre of the entrance pupil [m]; +inf where nothing is hit.
    normal_camera
        (rows, cols, 3) float32 unit shading normal in camera axes, turned towards the camera; 0 where nothing is hit.
    coverage
        (rows, cols) float32 in (0, 1], share of the pixel's square that shows what its centre shows.
    amodal_px
        (objects,) int64, number of pixel centres whose ray meets the object at all, hidden or not.
    visible_area_px
        (objects,) float64, area of the film that shows the object [px].
    amodal_area_px
        (objects,) float64, area of the film whose rays meet the object at all, hidden or not [px]; never less than the visible.
    """

    object_index: NDArray[np.int32]
    range_m: NDArray[np.float32]
    normal_camera: NDArray[np.float32]
    coverage: NDArray[np.float32]
    amodal_px: NDArray[np.int64]
    visible_area_px: NDArray[np.float64]
    amodal_area_px: NDArray[np.float64]
