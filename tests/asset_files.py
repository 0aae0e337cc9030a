"""Small model files for tests, made on the spot."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

import trimesh

__all__ = ["CUBE_OBJ", "box_glb", "zipped"]

CUBE_OBJ = b"""mtllib cube.mtl
o body
v -1 0 -0.5\nv 1 0 -0.5\nv 1 0 0.5\nv -1 0 0.5
v -1 1 -0.5\nv 1 1 -0.5\nv 1 1 0.5\nv -1 1 0.5
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl paint
f 1/1 2/2 3/3 4/4\nf 8/1 7/2 6/3 5/4\nf 1/1 5/2 6/3 2/4
f 2/1 6/2 7/3 3/4\nf 3/1 7/2 8/3 4/4\nf 4/1 8/2 5/3 1/4
"""
"""A box of 2 x 1 x 1 with a material that names the texture paint.png."""


def box_glb(length: float = 4.4, width: float = 1.8, height: float = 1.5) -> bytes:
    """Return a GLB file with one box, y up as glTF demands, `length` along its z axis [m]."""
    box = trimesh.creation.box(extents=(width, height, length))
    box.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.PBRMaterial(baseColorFactor=(200, 20, 20, 255)))
    return bytes(trimesh.Scene({"body": box}).export(file_type="glb"))


def zipped(files: Mapping[str, bytes]) -> bytes:
    """Return a ZIP archive with exactly these names, hostile ones too."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return stream.getvalue()
