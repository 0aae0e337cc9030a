"""Dirt of streets: bands by height, seeded per vehicle, nothing where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.radiometry import Spectrum
from fullwell.scene import Conductor, Dielectric, Diffuse, Emission, Material, Mesh, Principled, RoughPlastic
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
