"""Dirt of streets: bands by height, seeded per vehicle, nothing where there is none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from assets_in_memory import MemoryAssets, street_boxes
from fullwell.radiometry import Spectrum
from fullwell.scene import (
    Conductor,
    Dielectric,
    Diffuse,
    Emission,
    Material,
    Mesh,
    Principled,
    RoughPlastic,
    SceneDescription,
)
from fullwell.schema import build_frame, load_recipe
from fullwell.schema.conversion.dirt import by_height, dirt_of_vehicle, soiled

GREY = Spectrum.constant(0.5)


def wall(height_m: float = 1.5) -> Mesh:
    corners = np.array([[0, 0, 0], [2, 0, 0.1], [2, 0, height_m], [0, 0, height_m]], dtype=np.float64)
    normals = np.tile([0.0, -1.0, 0.0], (4, 1))
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32), normals, corners[:, [0, 2]].copy())


def area_m2(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(np.asarray(mesh.vertices_m)[mesh.faces], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_bands_lose_no_area_and_keep_what_vertices_carry() -> None:
    mesh = wall()
    bands = [band for band, _ in by_height(mesh, 0.5)]
    assert len(bands) == 7
    assert sum(map(area_m2, bands)) == pytest.approx(area_m2(mesh), rel=1e-12)
    for band in bands:
        assert band.normals is not None
        assert band.uv is not None
        assert band.normals == pytest.approx(np.tile([0.0, -1.0, 0.0], (len(band.normals), 1)))
        assert band.uv == pytest.approx(np.asarray(band.vertices_m)[:, [0, 2]])
        a, b, c = np.moveaxis(np.asarray(band.vertices_m)[band.faces], 1, 0)
        assert (np.cross(b - a, c - a)[:, 1] < 0).all()  # all face the way they did


def test_what_lies_within_one_band_is_not_cut() -> None:
    roof = Mesh(np.array([[0, 0, 1.4], [1, 0, 1.4], [0, 1, 1.41]]), np.array([[0, 1, 2]], dtype=np.uint32))
    bands = list(by_height(roof, 0.5))
    assert len(bands) == 1
    assert bands[0][0] is roof


def test_dirt_falls_towards_the_roof_and_grows_with_the_level() -> None:
    little, much = ([share for _, share in by_height(wall(), level)] for level in (0.3, 0.9))
    assert much == sorted(much, reverse=True)
    assert all(more > less > 0 for more, less in zip(much, little, strict=True))
    assert max(much) <= 0.9


def test_each_vehicle_has_its_own_dirt_that_the_seed_decides() -> None:
    shares = np.array([dirt_of_vehicle(1.0, 7, f"car.{number}") for number in range(400)])
    assert ((shares >= 0.35) & (shares <= 1.0)).all()
    assert shares.mean() == pytest.approx(0.675, abs=0.04)
    assert dirt_of_vehicle(1.0, 7, "car.3") == shares[3]
    assert dirt_of_vehicle(1.0, 8, "car.3") != shares[3]
    assert dirt_of_vehicle(0.4, 7, "car.3") == pytest.approx(0.4 * shares[3])
    assert dirt_of_vehicle(0.0, 7, "car.3") == 0.0


def test_materials_under_dirt_are_shared_and_clean_ones_stay_as_they_are() -> None:
    kept: dict[str, tuple[Material, Emission | None]] = {}
    paint = RoughPlastic(GREY, 0.03)
    assert soiled("paint/grey", paint, 0.01, kept) is paint
    once = soiled("paint/grey", paint, 0.30, kept)
    assert once is soiled("paint/grey", paint, 0.305, kept)
    assert isinstance(once, RoughPlastic)
    assert once.roughness > paint.roughness
    assert isinstance(soiled("asphalt/worn", Diffuse(GREY), 0.4, kept, road=True), Diffuse)
    assert isinstance(soiled("paint/grey", paint, 1.0, kept), Diffuse)
    assert soiled("a clear pane", Dielectric(), 1.0, kept) is not None
    metal = soiled("metal/chrome", Conductor(Spectrum.constant(3.0), Spectrum.constant(4.0)), 0.5, kept)
    assert isinstance(metal, Principled)
    assert metal.metallic == pytest.approx(0.5)


def test_panes_and_lamps_are_wiped() -> None:
    kept: dict[str, tuple[Material, Emission | None]] = {}
    glass = RoughPlastic(GREY, 0.01, 1.52)
    pane, body = (soiled(name, glass, 0.6, kept) for name in ("glass/window", "paint/grey"))
    assert isinstance(pane, RoughPlastic)
    assert isinstance(body, RoughPlastic)
    assert glass.roughness < pane.roughness < body.roughness


def scene(assets: MemoryAssets, **traffic: Any) -> SceneDescription:
    recipe = {
        "schema": "fullwell/recipe/v1",
        "name": "street",
        "seed": 5,
        "scene": {
            "traffic": {
                "network": {"layout": "straight", "length_m": 120},
                "demand": {"car": {"density_per_km": 30}, "pedestrian": {"density_per_km": 10}},
                "time_s": 2,
                "dressed": False,
                **traffic,
            },
            "lights": [{"name": "sky", "kind": "constant_environment", "luminance_cd_m2": 3000, "spd": "D65"}],
        },
        "cameras": [
            {
                "name": "mast",
                "pose": {"origin_m": [60, 20, 6], "target_m": [60, 0, 0]},
                "lens": {"kind": "pinhole", "hfov_deg": 60, "f_number": 4},
                "sensors": [{"name": "s", "model": "imx363", "rows": 48, "cols": 64, "exposure": {"time_s": 0.001}}],
            }
        ],
        "outputs": ["labels.json"],
    }
    return build_frame(load_recipe(recipe), assets=assets).scene


def told(described: SceneDescription) -> list[tuple[str, str, bytes, str]]:
    return [
        (item.id, part.name, np.asarray(part.geometry.vertices_m).tobytes(), repr_of(part.material))
        for item in described.objects
        for part in item.parts
        if isinstance(part.geometry, Mesh)
    ]


def repr_of(material: Material) -> str:
    match material:
        case Diffuse(Spectrum() as spectrum) | RoughPlastic(Spectrum() as spectrum):
            return f"{type(material).__name__} {spectrum.values.tobytes().hex()}"
    return type(material).__name__


def test_a_street_without_dirt_is_what_it_was_and_a_dirty_one_differs_in_vehicles_and_roads_alone(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    assets = MemoryAssets(*street_boxes(), folder=tmp_path_factory.mktemp("assets"))
    clean = scene(assets)
    assert told(scene(assets, dirt={"vehicles": 0, "roads": 0})) == told(clean)
    dirty = scene(assets, dirt={"vehicles": 0.8, "roads": 0.5})
    assert [item.id for item in dirty.objects] == [item.id for item in clean.objects]
    for before, after in zip(clean.objects, dirty.objects, strict=True):
        same = told_of(before) == told_of(after)
        assert same == (before.semantic_class in ("pedestrian", "terrain")), before.id
        if before.semantic_class == "car":
            assert len(after.parts) > len(before.parts)
            areas = [
                sum(area_m2(part.geometry) for part in item.parts if isinstance(part.geometry, Mesh))
                for item in (before, after)
            ]
            assert areas[1] == pytest.approx(areas[0], rel=1e-6)


def told_of(item: Any) -> list[tuple[bytes, str]]:
    return [(np.asarray(part.geometry.vertices_m).tobytes(), repr_of(part.material)) for part in item.parts]
