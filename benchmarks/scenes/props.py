"""What the scenes share: recipe entries for meshes, materials and cameras, and the folder that mesh files are written into."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scenes.meshes import Triangles, write_ply
from benchmarks.scenes.people import person_parts
from benchmarks.scenes.vehicles import BODIES, CAR_COLOURS, car_parts, lamp_places

__all__ = ["CAR_MATERIALS", "Props", "at", "diffuse", "metal", "plastic", "recipe"]

Entry = dict[str, Any]
Size = tuple[int, int]


def diffuse(reflectance: float | str | Entry) -> Entry:
    """Return a matt material."""
    return {"kind": "diffuse", "reflectance": reflectance}


def plastic(reflectance: float | str | Entry, roughness: float) -> Entry:
    """Return a material with a gloss coat."""
    return {"kind": "rough_plastic", "reflectance": reflectance, "roughness": roughness}


def metal(name: str, roughness: float = 0.0) -> Entry:
    """Return a metal."""
    return {"kind": "conductor", "metal": name, "roughness": roughness}


def at(place_m: Any, turn_deg: float = 0.0, scale: Any = None) -> Entry:
    """Return a transform: stretch, turn about z, move."""
    step: Entry = {} if scale is None else {"scale": scale}
    return step | {
        "rotate_deg": {"axis": "z", "angle_deg": round(float(turn_deg), 4)},
        "translate_m": [round(float(x), 4) for x in place_m],
    }


CAR_MATERIALS: dict[str, Entry] = {
    "car_glass": plastic(0.012, 0.02),
    "car_trim": plastic(0.03, 0.30),
    "tyre": plastic(0.035, 0.45),
    "rim": metal("aluminium", 0.30),
    "car_lens": plastic(0.55, 0.06),
    "car_tail": plastic("#8a0f12", 0.08),
    "car_plate": diffuse(0.75),
}
"""Materials of all cars; the paint comes with each."""

_CAR_PART_MATERIALS = {
    "glass": "car_glass", "trim": "car_trim", "tyre": "tyre", "rim": "rim",
    "lens": "car_lens", "tail": "car_tail", "plate": "car_plate",
}  # fmt: skip

RED_LED: Entry = {"wavelength_nm": [600, 612, 624, 630, 636, 650, 670], "values": [0, 0.15, 0.8, 1, 0.7, 0.1, 0]}
"""Relative spectrum of a red light-emitting diode [W nm^-1], 630 nm, 25 nm wide."""


class Props:
    """Writes each mesh once and returns the recipe entries that refer to it."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._written: set[str] = set()
        self.triangles = 0
        self._cars: dict[str, dict[str, Triangles]] = {}
        self._sizes: dict[str, int] = {}

    def mesh(self, name: str, mesh: Triangles) -> Entry:
        """Return the geometry entry of a mesh; a name stands for one mesh."""
        file = f"{name}.ply"
        if file not in self._written:
            write_ply(mesh, self._folder / file)
            self._written.add(file)
            self._sizes[file] = len(mesh.faces)
        self.triangles += self._sizes[file]
        return {"kind": "model", "file": file, "unit_m": 1, "up_axis": "z"}

    def part(self, name: str, file_name: str, mesh: Triangles, material: str | Entry) -> Entry:
        """Return the part entry of a mesh with one material."""
        return {"name": name, "geometry": self.mesh(file_name, mesh), "materials": {"*": material}}

    def car(self, name: str, body: str, colour: str, transform: Entry, *, lamps: Entry | None = None) -> Entry:
        """Return a car. `lamps` has the luminances "head" and "tail" [cd m^-2] of lit lamps and "spd", the headlamps' light."""
        meshes = self._cars.setdefault(body, car_parts(BODIES[body]))
        parts = [self.part("paint", f"{body}_paint", meshes["paint"], plastic(colour, 0.06))]
        parts += [self.part(part, f"{body}_{part}", meshes[part], material) for part, material in _CAR_PART_MATERIALS.items()]
        if lamps is not None:
            parts += _lit_lamps(body, lamps)
        return {"id": name, "class": "car", "parts": parts, "transform": transform}

    def random_car(self, name: str, rng: np.random.Generator, transform: Entry, **lit: Any) -> Entry:
        """Return a car of a likely type and colour."""
        body = str(rng.choice(["saloon", "hatch", "suv", "van"], p=[0.3, 0.35, 0.25, 0.10]))
        colours, shares = zip(*CAR_COLOURS, strict=True)
        colour = str(rng.choice(colours, p=np.array(shares) / sum(shares)))
        return self.car(name, body, colour, transform, **lit)

    def person(self, name: str, rng: np.random.Generator, transform: Entry) -> Entry:
        """Return a pedestrian."""
        clothes = ["#2c3446", "#7a3b2e", "#b0902f", "#55604a", "#8a8f96", "#22252b", "#c8c2b4", "#8c2733", "#3b5d7a"]
        colours = {
            "skin": str(rng.choice(["#c99b7d", "#8d5a3c", "#e0b79a"])),
            "hair": str(rng.choice(["#1b1512", "#4a3222", "#8a6a42"])),
            "top": str(rng.choice(clothes)),
            "trousers": str(rng.choice(clothes[:6])),
            "shoes": "#1c1a18",
        }
        meshes = person_parts(rng)
        parts = [self.part(part, f"{name}_{part}", mesh, diffuse(colours[part])) for part, mesh in meshes.items()]
        return {"id": name, "class": "person", "parts": parts, "transform": transform}


def _lit_lamps(body: str, lamps: Entry) -> list[Entry]:
    """Return headlamp and tail lamp disks that face forwards and backwards."""
    parts = []
    for front, group in ((True, "headlights"), (False, "headlights")):
        emission: Entry = {"kind": "emissive", "group": group}
        emission |= {"luminance_cd_m2": lamps["head" if front else "tail"], "spd": lamps["spd"] if front else RED_LED}
        for number, (x, y, z) in enumerate(lamp_places(BODIES[body], front=front)):
            side = 1 if front else -1
            place = [round(x + side * 0.02, 4), round(y, 4), round(z, 4)]
            facing = {
                "origin_m": place,
                "target_m": [place[0] + side, place[1], place[2] - (0.01 if front else 0.0)],
                "up": [0, 0, 1],
            }
            shape = {"kind": "disk", "radius_m": 0.065 if front else 0.06}
            parts.append(
                {
                    "name": f"{'head' if front else 'tail'}lamp_{number}",
                    "geometry": shape,
                    "material": emission,
                    "transform": {"look_at": facing},
                }
            )
    return parts


def recipe(
    name: str,
    scene: Entry,
    pose: Entry,
    lens: Entry,
    *,
    size: Size,
    model: str,
    exposure: Entry | None = None,
    depth: int = 8,
    seed: int = 1,
) -> Entry:
    """Return a recipe with one camera and one sensor of `size` (columns, rows)."""
    cols, rows = size
    sensor = {"name": "main", "model": model, "rows": rows, "cols": cols, "exposure": exposure or {"auto": {}}}
    return {
        "schema": "fullwell/recipe/v1",
        "name": name,
        "seed": seed,
        "scene": scene,
        "cameras": [{"name": "main", "pose": pose, "lens": lens, "sensors": [sensor]}],
        "outputs": ["image.png", "raw.npz"],
        "quality": {"samples_per_pixel": 32, "max_depth": depth},
    }
