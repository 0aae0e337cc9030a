"""Small parts for the tests of ingestion."""

from __future__ import annotations

import numpy as np

from fullwell.assets.model import LoadedPart

__all__ = ["grid_part", "part"]


def part(vertices_m: np.ndarray, faces: np.ndarray, **changes: object) -> LoadedPart:
    """Return a plain grey part."""
    fields: dict[str, object] = {
        "name": "part",
        "vertices_m": np.asarray(vertices_m, dtype=np.float64),
        "faces": np.asarray(faces, dtype=np.uint32),
        "normals": None,
        "uv": None,
        "base_color_srgb": (0.5, 0.5, 0.5),
        "base_color_texture": None,
        "roughness": 0.5,
        "metallic": 0.0,
        "emissive_srgb": None,
        "double_sided": False,
    }
    return LoadedPart(**{**fields, **changes})  # type: ignore[arg-type]


def grid_part(rows: int, cols: int, **changes: object) -> LoadedPart:
    """Return the unit square in the xy plane as a grid of triangles that face up, with texture coordinates equal to x and y."""
    x, y = np.meshgrid(np.linspace(0, 1, cols + 1), np.linspace(0, 1, rows + 1))
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    index = np.arange(x.size).reshape(x.shape)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return part(vertices, faces, **{"uv": vertices[:, :2], **changes})
