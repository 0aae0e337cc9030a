"""What the labels of one picture are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Box3D", "Labels", "ObjectLabel"]


@dataclass(frozen=True, slots=True, eq=False)
class Box3D:
    """Oriented box in camera coordinates (x right, y down, z forward) [m].

    `rotation` (3, 3) has the object's own axes as columns; `size_m` is measured along them.
    """

    center_m: NDArray[np.float64]
    size_m: NDArray[np.float64]
    rotation: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ObjectLabel:
    """One object in the picture.

    Attributes
    ----------
    id, instance, semantic_class, class_id
        The recipe's id; the value in the instance map; class name and the value in the semantic map.
    bbox_visible_px
        (x0, y0, x1, y1) that encloses the visible pixels, edges included: x1 - x0 is a width in pixels. None where no pixel
        centre shows the object.
    bbox_amodal_px
        The same for the whole object, hidden parts and parts outside the picture included. None where it is behind the camera.
    visible_px, amodal_px
        Pixel centres that show the object; pixel centres that would show it if nothing stood before it.
    visible_area_px, amodal_area_px
        Area that shows the object, and that would show it if nothing stood before it [px]: parts of pixels count as parts. An
        object thinner than a pixel may have an area and no pixel centre.
    visible_fraction
        visible_area_px / amodal_area_px, 0 where the object covers nothing.
    truncated_fraction
        Share of the amodal box's area that lies outside the picture.
    """

    id: str
    instance: int
    semantic_class: str
    class_id: int
    bbox_visible_px: tuple[int, int, int, int] | None
    bbox_amodal_px: tuple[float, float, float, float] | None
    visible_px: int
    amodal_px: int
    visible_area_px: float
    amodal_area_px: float
    visible_fraction: float
    truncated_fraction: float
    box3d: Box3D


@dataclass(frozen=True, slots=True, eq=False)
class Labels:
    """Maps (rows, cols) and objects of one picture.

    `instances` uint32 and `semantic` uint16 are 0 where nothing is; `depth_z_m` (along the optical axis) and
    `depth_range_m` (along the ray) are float32 [m], +inf where nothing is; `normals_camera` (rows, cols, 3) float32;
    `coverage` float32 in (0, 1], the share of the pixel that shows what its centre shows, `instances` there.
    `instance_table` has (id, instance) of every object of the scene, in the picture or not.
    """

    instances: NDArray[np.uint32]
    semantic: NDArray[np.uint16]
    depth_z_m: NDArray[np.float32]
    depth_range_m: NDArray[np.float32]
    normals_camera: NDArray[np.float32]
    coverage: NDArray[np.float32]
    objects: tuple[ObjectLabel, ...]
    instance_table: tuple[tuple[str, int], ...]
    semantic_classes: tuple[str, ...]
