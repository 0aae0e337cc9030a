"""The scene on the device, loaded once for the picture and its labels."""

from __future__ import annotations

import gc
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.render.transport.collect import collect_surfaces
from fullwell.render.transport.geometry import Geometry
from fullwell.scene import SceneDescription

__all__ = ["forget_geometry", "load_geometry"]

_kept: list[tuple[SceneDescription, NDArray[np.float64], str, Geometry]] = []
"""The scene that was loaded last, by identity: descriptions are never changed once they are made."""


def load_geometry(mi: Any, scene: SceneDescription, centre_m: NDArray[np.float64]) -> Geometry:
    """Return the surfaces of `scene` on the device, with the world point `centre_m` [m] at the origin.

    The geometry that was loaded last is kept, and returned again for the same scene object, centre and variant.

    Raises
    ------
    FieldError
        The scene holds what cannot be rendered as it is meant; the message names the object.
    """
    variant = str(mi.variant())
    for kept_scene, kept_centre_m, kept_variant, geometry in _kept:
        if kept_scene is scene and kept_variant == variant and np.array_equal(kept_centre_m, centre_m):
            return geometry
    # The old scene goes before the new one comes: two would need twice the memory, and dead shapes keep their numbers.
    forget_geometry()
    loaded = Geometry(mi, collect_surfaces(scene, centre_m))
    _kept.append((scene, np.array(centre_m, dtype=np.float64), variant, loaded))
    return loaded


def forget_geometry() -> None:
    """Free the geometry that was loaded last, where nothing else holds it."""
    _kept.clear()
    gc.collect()
