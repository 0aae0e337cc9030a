"""Dispersion in the whole loop: a furnace stays one, and a prism sends each wavelength its own way."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.radiometry.glasses import glass
from fullwell.render import choose_variant, render_radiance
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
    Dielectric,
    Diffuse,
    Emission,
    Film,
    Lens,
    Mesh,
    Part,
    Rectangle,
    SceneDescription,
    SceneObject,
    Sphere,
    look_at,
)

pytestmark = pytest.mark.skipif(not choose_variant().variant.startswith("llvm"), reason="dispersion needs the path loop")
GRID = WavelengthGrid(410.0, 690.0, 40.0)
PHOTONS = GRID.centres_nm / (6.62607015e-34 * 299792458.0 * 1e9)
DENSE_FLINT = Dielectric(glass("N-SF11"), 1.000277)


def camera(rows: int, cols: int, hfov: float, target: tuple[float, float, float] = (0.0, 1.0, 0.0)) -> Camera:
    pose = look_at(np.zeros(3), np.array(target), np.array([0.0, 0.0, 1.0]))
    return Camera(
        "main", pose, Lens("pinhole", 0.05, 4.0, np.inf, Spectrum.constant(1.0)), Film(rows, cols, 0.05 * hfov / cols)
    )


def test_dispersive_ball_returns_the_furnace_at_every_wavelength() -> None:
    place = np.eye(4)
    place[1, 3] = 3.0
    ball = SceneObject("ball", "", (Part(Sphere(1.0), DENSE_FLINT),), place)
    scene = SceneDescription((ball,), (ConstantEnvironment(Spectrum.constant(1.0)),))
    image, _ = render_radiance(scene, camera(24, 24, 0.8), GRID, samples_per_pixel=512, max_depth=60, seed=2)
    # Depth 60 leaves what is trapped between the ball's faces; the mean of each band is 1 within 4 standard errors.
    means = image.photons.reshape(-1, GRID.count).mean(axis=0) / PHOTONS
    np.testing.assert_allclose(means, 1.0, atol=0.01)
    assert means.mean() == pytest.approx(1.0, abs=3e-3)


def prism(apex_deg: float, side_m: float) -> Mesh:
    """Return a prism along z whose apex points to +x, symmetric about y = 0."""
    half = np.radians(apex_deg / 2)
    base_x, half_width = -side_m * np.cos(half), side_m * np.sin(half)
    corners = np.array([[0.0, 0.0], [base_x, half_width], [base_x, -half_width]])
    vertices = np.concatenate([np.c_[corners, np.full(3, z)] for z in (-side_m, side_m)])
    faces = [[0, 2, 1], [3, 4, 5]]
    for a, b in ((0, 1), (1, 2), (2, 0)):
        faces += [[a, b, b + 3], [a, b + 3, a + 3]]
    return Mesh(vertices, np.array(faces, dtype=np.uint32))


def test_prism_shows_a_slit_where_snell_puts_each_band() -> None:
    """A camera looks through a 40 degree prism at a slit; the place of the slit in each band is traced by Snell's law."""
    index = glass("N-SF11")
    apex = 40.0
    part = Part(prism(apex, 1.0), DENSE_FLINT)
    place = np.eye(4)
    place[:3, 3] = [0.45, 1.5, 0.0]
    body = SceneObject("prism", "", (part,), place)
    slit_y, width = 6.0, 0.03

    def exit_ray(angle: float, n: float) -> tuple[np.ndarray, np.ndarray]:
        """Return (point, direction) of a ray in the plane after the prism, for a ray from the origin at `angle` from +y."""
        half = np.radians(apex / 2)
        normals = [np.array([np.sin(half), -np.cos(half)]), np.array([np.sin(half), np.cos(half)])]
        point, direction = np.zeros(2), np.array([np.sin(angle), np.cos(angle)])
        apex_at = np.array([0.45, 1.5])
        for normal, ratio in zip(normals, (1.000277 / n, n / 1.000277), strict=True):
            point = point + direction * ((apex_at - point) @ normal) / (direction @ normal)
            cosine = direction @ normal
            side = normal if cosine > 0 else -normal
            cosine = abs(cosine)
            sine2 = ratio**2 * (1 - cosine**2)
            direction = ratio * direction + (np.sqrt(1 - sine2) - ratio * cosine) * side
        return point, direction

    def lands_at(angle: float, n: float) -> float:
        point, direction = exit_ray(angle, n)
        return float(point[0] + direction[0] * (slit_y - point[1]) / direction[1])

    slit_x = lands_at(0.08, float(index.at(550.0)))
    turned = np.array([[1, 0, 0, slit_x], [0, 0, -1, slit_y], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    lamp = Part(Rectangle((width, 4.0)), Diffuse(Spectrum.constant(0.0)), emission=Emission(Spectrum.constant(1.0)))
    scene = SceneDescription((body, SceneObject("slit", "", (lamp,), turned)))
    view = camera(4, 400, 0.2, (np.sin(0.08), np.cos(0.08), 0.0))
    image, _ = render_radiance(scene, view, GRID, samples_per_pixel=1024, max_depth=6, seed=4)
    profile = image.photons.sum(axis=0)
    cols = np.arange(400) + 0.5
    found = (profile * cols[:, None]).sum(axis=0) / profile.sum(axis=0)
    angles = np.linspace(-0.02, 0.18, 4001)
    for band, centre_nm in enumerate(GRID.centres_nm):
        n = float(np.mean(index.at(np.linspace(centre_nm - 20, centre_nm + 20, 41))))
        lands = np.array([lands_at(angle, n) for angle in angles])
        angle = float(np.interp(slit_x, lands[np.argsort(lands)], angles[np.argsort(lands)]))
        expected = 200.0 + np.tan(angle - 0.08) / view.tangent_pitch
        assert found[band] == pytest.approx(expected, abs=1.0), centre_nm
    assert abs(found[-1] - found[0]) > 10.0
