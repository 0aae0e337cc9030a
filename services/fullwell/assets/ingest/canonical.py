"""The level file: one GLB for each level of detail, which reads back exactly and shows sensibly in any viewer.

glTF 2.0 (Khronos, ISO/IEC 12113:2022): metres, y up. One mesh with one node for each part, both of the part's name. A point
(x, y, z) of the asset, z up, stands in the file as (x, z, -y): the asset faces +x there too. Images are stored bottom row
first, so that texture coordinates (v up here, v down in glTF) need no arithmetic, which would not be exact.
"""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fullwell.assets.model import LoadedModel, LoadedPart, ModelError, srgb_to_linear
from fullwell.core.hashing import canonical_json, sha256_hex

__all__ = ["read_level", "write_level"]

_GENERATOR: Final = "fullwell level 1"
_HEADER: Final = struct.Struct("<4sII")
_CHUNK: Final = struct.Struct("<I4s")
_FLOAT, _UINT = 5126, 5125
_VERTEX_BUFFER, _INDEX_BUFFER = 34962, 34963
_EXTRAS: Final = "fullwell"


def write_level(parts: Sequence[LoadedPart], *, attribution: str = "") -> bytes:
    """Return the GLB file of a level: the same bytes for the same parts.

    Vertices, normals and texture coordinates are stored in float32. `attribution` goes into the file's copyright field.
    """
    writer = _Writer()
    for part in parts:
        writer.add(part)
    return writer.finish(attribution)


class _Writer:
    def __init__(self) -> None:
        self._binary = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._images: dict[str, int] = {}
        self._tree: dict[str, list[dict[str, Any]]] = {"nodes": [], "meshes": [], "materials": [], "images": [], "textures": []}

    def add(self, part: LoadedPart) -> None:
        """Add a part as a mesh, a node and a material."""
        attributes = {"POSITION": self._array(_y_up(part.vertices_m), _VERTEX_BUFFER, bounds=True)}
        if part.normals is not None:
            attributes["NORMAL"] = self._array(_y_up(part.normals), _VERTEX_BUFFER)
        if part.uv is not None:
            attributes["TEXCOORD_0"] = self._array(part.uv, _VERTEX_BUFFER)
        number = len(self._tree["meshes"])
        primitive = {
            "attributes": attributes,
            "indices": self._array(part.faces.reshape(-1), _INDEX_BUFFER),
            "material": number,
            "mode": 4,
        }
        self._tree["meshes"].append({"name": part.name, "primitives": [primitive]})
        self._tree["nodes"].append({"name": part.name, "mesh": number})
        self._tree["materials"].append(self._material(part))

    def _material(self, part: LoadedPart) -> dict[str, Any]:
        surface: dict[str, Any] = {"metallicFactor": part.metallic, "roughnessFactor": part.roughness}
        if part.base_color_texture is None:
            surface["baseColorFactor"] = [*_linear(part.base_color_srgb), 1.0]
        else:
            surface["baseColorTexture"] = {"index": self._texture(part.base_color_texture)}
        material: dict[str, Any] = {
            "name": part.material_name or part.name,
            "pbrMetallicRoughness": surface,
            "doubleSided": part.double_sided,
            # Linear factors do not give the encoded colours back to the last digit; these do.
            "extras": {
                _EXTRAS: {
                    "base_color_srgb": list(part.base_color_srgb),
                    "emissive_srgb": None if part.emissive_srgb is None else list(part.emissive_srgb),
                    "material_name": part.material_name,
                }
            },
        }
        if part.emissive_srgb is not None:
            material["emissiveFactor"] = _linear(part.emissive_srgb)
        return material

    def _texture(self, pixels: NDArray[np.uint8]) -> int:
        key = sha256_hex(str(pixels.shape).encode() + pixels.tobytes())
        if key not in self._images:
            stream = io.BytesIO()
            Image.fromarray(np.ascontiguousarray(pixels[::-1])).save(stream, "PNG")
            self._images[key] = len(self._tree["images"])
            view = self._view(stream.getvalue(), None)
            self._tree["images"].append({"bufferView": view, "mimeType": "image/png"})
            self._tree["textures"].append({"source": self._images[key]})
        return self._images[key]

    def _array(self, values: NDArray[Any], target: int, *, bounds: bool = False) -> int:
        kind = _UINT if target == _INDEX_BUFFER else _FLOAT
        stored = np.ascontiguousarray(values, dtype="<u4" if kind == _UINT else "<f4")
        entry: dict[str, Any] = {
            "bufferView": self._view(stored.tobytes(), target),
            "componentType": kind,
            "count": len(stored),
            "type": "SCALAR" if stored.ndim == 1 else f"VEC{stored.shape[1]}",
        }
        if bounds:
            entry["min"], entry["max"] = stored.min(axis=0).tolist(), stored.max(axis=0).tolist()
        self._accessors.append(entry)
        return len(self._accessors) - 1

    def _view(self, content: bytes, target: int | None) -> int:
        self._binary.extend(b"\0" * (-len(self._binary) % 4))
        entry = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(content)}
        self._views.append(entry if target is None else {**entry, "target": target})
        self._binary.extend(content)
        return len(self._views) - 1

    def finish(self, attribution: str) -> bytes:
        """Return the file."""
        self._binary.extend(b"\0" * (-len(self._binary) % 4))
        asset = {"version": "2.0", "generator": _GENERATOR, **({"copyright": attribution} if attribution else {})}
        tree = {
            "asset": asset,
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self._tree["nodes"])))}],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._binary)}],
            **{name: entries for name, entries in self._tree.items() if entries},
        }
        text = canonical_json(tree)
        text += b" " * (-len(text) % 4)
        length = _HEADER.size + 2 * _CHUNK.size + len(text) + len(self._binary)
        head = _HEADER.pack(b"glTF", 2, length) + _CHUNK.pack(len(text), b"JSON")
        return head + text + _CHUNK.pack(len(self._binary), b"BIN\0") + bytes(self._binary)


def read_level(content: bytes | Path) -> LoadedModel:
    """Return the parts of a level file exactly as they were given to `write_level`, arrays in float32 precision.

    Takes no time for checks beyond its structure: level files are known by their digest. Raises ModelError where the file is
    none of this project's, or damaged.
    """
    label = content.name if isinstance(content, Path) else "the level file"
    try:
        return _Reader(content.read_bytes() if isinstance(content, Path) else content).model()
    except (KeyError, IndexError, TypeError, ValueError, struct.error, OSError) as error:
        message = f"{label} is damaged or was not written by this project ({type(error).__name__}: {error}). Prepare it again."
        raise ModelError(message, value=label) from error


class _Reader:
    def __init__(self, content: bytes) -> None:
        magic, version, length = _HEADER.unpack_from(content)
        if (magic, version, length) != (b"glTF", 2, len(content)):
            raise ValueError("not a whole GLB file")
        text_length, kind = _CHUNK.unpack_from(content, _HEADER.size)
        start = _HEADER.size + _CHUNK.size
        self._tree = json.loads(content[start : start + text_length])
        if kind != b"JSON" or self._tree["asset"].get("generator") != _GENERATOR:
            raise ValueError(f"the generator is not {_GENERATOR!r}")
        self._binary = memoryview(content)[start + text_length + _CHUNK.size :]
        self._textures: dict[int, NDArray[np.uint8]] = {}

    def model(self) -> LoadedModel:
        parts = tuple(self._part(mesh) for mesh in self._tree["meshes"])
        lows = [part.vertices_m.min(axis=0) for part in parts]
        highs = [part.vertices_m.max(axis=0) for part in parts]
        bounds_m = np.array([np.min(lows, axis=0), np.max(highs, axis=0)])
        return LoadedModel(parts, bounds_m, unit_m=1.0, up_axis="y", warnings=())

    def _part(self, mesh: dict[str, Any]) -> LoadedPart:
        primitive = mesh["primitives"][0]
        stored = primitive["attributes"]
        material = self._tree["materials"][primitive["material"]]
        exact, surface = material["extras"][_EXTRAS], material["pbrMetallicRoughness"]
        texture = surface.get("baseColorTexture")
        vertices_m = _z_up(self._array(stored["POSITION"]))
        faces = self._array(primitive["indices"]).reshape(-1, 3)
        if faces.max() >= len(vertices_m):
            raise ValueError("an index points nowhere")
        return LoadedPart(
            name=mesh["name"],
            vertices_m=vertices_m,
            faces=faces.astype(np.uint32),
            normals=_z_up(self._array(stored["NORMAL"])) if "NORMAL" in stored else None,
            uv=self._array(stored["TEXCOORD_0"]).astype(np.float64) if "TEXCOORD_0" in stored else None,
            base_color_srgb=_triple(exact["base_color_srgb"]),
            base_color_texture=None if texture is None else self._texture(texture["index"]),
            roughness=float(surface["roughnessFactor"]),
            metallic=float(surface["metallicFactor"]),
            emissive_srgb=None if exact["emissive_srgb"] is None else _triple(exact["emissive_srgb"]),
            double_sided=bool(material["doubleSided"]),
            material_name=exact["material_name"],
        )

    def _texture(self, index: int) -> NDArray[np.uint8]:
        if index not in self._textures:
            view = self._tree["images"][self._tree["textures"][index]["source"]]["bufferView"]
            with Image.open(io.BytesIO(self._bytes(view))) as image:
                self._textures[index] = np.ascontiguousarray(np.asarray(image.convert("RGB"), dtype=np.uint8)[::-1])
        return self._textures[index]

    def _array(self, index: int) -> NDArray[Any]:
        entry = self._tree["accessors"][index]
        kind = {_UINT: "<u4", _FLOAT: "<f4"}[entry["componentType"]]
        columns = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[entry["type"]]
        values = np.frombuffer(self._bytes(entry["bufferView"]), dtype=kind)
        return values.reshape(entry["count"], columns) if columns > 1 else values

    def _bytes(self, view: int) -> memoryview:
        entry = self._tree["bufferViews"][view]
        start, length = int(entry["byteOffset"]), int(entry["byteLength"])
        if start < 0 or length < 0 or start + length > len(self._binary):
            raise ValueError("a buffer view lies outside the file")
        return self._binary[start : start + length]


def _y_up(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)


def _z_up(vectors: NDArray[np.float32]) -> NDArray[np.float64]:
    # Adding zero turns the -0 that a change of sign left into 0.
    return np.stack([vectors[:, 0], -vectors[:, 2], vectors[:, 1]], axis=1).astype(np.float64) + 0.0


def _linear(srgb: tuple[float, float, float]) -> list[float]:
    """Return a colour for viewers; its last bits, which differ between machines, would change the file's digest."""
    return [round(float(value), 7) for value in srgb_to_linear(np.array(srgb))]


def _triple(values: Sequence[float]) -> tuple[float, float, float]:
    first, second, third = (float(value) for value in values)
    return first, second, third
