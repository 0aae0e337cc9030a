"""A ball of any material that absorbs nothing cannot be seen in an even dome: the whole path loop keeps energy to 1e-3."""

from __future__ import annotations

import numpy as np
import pytest
from test_analytic_scenes import ANALYTIC_TOLERANCE, ONE, camera, pytestmark  # noqa: F401

from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.radiometry.glasses import glass
from fullwell.render import LightRequest, SamplingGoal, render_light
from fullwell.scene import (
    Conductor,
    ConstantEnvironment,
    Cube,
    Dielectric,
    Diffuse,
    Emission,
    Material,
    Mesh,
    Mirror,
    Part,
    Principled,
    RoughPlastic,
    SceneDescription,
    SceneObject,
    Sphere,
    Translucent,
)
from fullwell.scene.tessellate import mesh_of

LARGEST_ERROR = 3e-4
"""Standard error of the mean over the ball, so that 1e-3 is more than three of them."""

BAND = WavelengthGrid(550.0, 550.0, 100.0)
"""Wide enough for glass to spread colours."""

UNIT, NONE = Spectrum.constant(1.0), Spectrum.constant(0.0)
FLINT = glass("N-SF11")

MATERIALS: list[tuple[str, Material, int]] = [
    ("diffuse", Diffuse(UNIT), 64),
    ("sheet", Translucent(Spectrum.constant(0.55), Spectrum.constant(0.45)), 12288),
    *((f"plastic of roughness {a}", RoughPlastic(UNIT, a), 1024) for a in (0.02, 0.3, 1.0)),
    *(
        (f"principled of roughness {r}, metallic {m}", Principled(UNIT, r, m), 8192)
        for r in (0.1, 0.5, 1.0)
        for m in (0.0, 0.5, 1.0)
    ),
    ("mirror", Mirror(UNIT), 64),
    *((f"metal of roughness {a}", Conductor(NONE, UNIT, a), 8192) for a in (0.0, 0.02, 0.3, 1.0)),
    ("glass", Dielectric(1.5, 1.0), 4096),
    ("diamond", Dielectric(2.4, 1.0), 4096),
    *((f"glass of roughness {a}", Dielectric(1.5, 1.0, a), n) for a, n in ((0.02, 32768), (0.3, 32768), (1.0, 65536))),
    ("dispersive glass", Dielectric(FLINT, 1.0), 8192),
    ("dispersive glass of roughness 0.02", Dielectric(FLINT, 1.0, 0.02), 32768),
]
"""With camera rays per film sample that bring the standard error below `LARGEST_ERROR`."""

QUICK = (
    "diffuse",
    "plastic of roughness 0.3",
    "principled of roughness 0.5, metallic 0.5",
    "mirror",
    "metal of roughness 0.3",
    "glass",
)
"""The others run with the slow tests."""


def relative_to_light(objects: tuple[SceneObject, ...], samples: int, depth: int) -> tuple[float, float]:
    """Return (mean over the film of 16 x 12 samples, its standard error), in units of the dome."""
    request = LightRequest(
        grid=BAND,
        responses=(UNIT,),
        keep_bands=False,
        max_depth=depth,
        goal=SamplingGoal(noise_ratio=None, samples_per_pixel=samples),
        seed=1,
    )
    view = camera(rows=12, cols=16, hfov_deg=15)
    dome = (ConstantEnvironment(ONE),)
    empty = render_light(SceneDescription((), dome), view, request).replicas.mean(dtype=np.float64)
    found = render_light(SceneDescription(objects, dome), view, request).replicas.astype(np.float64) / empty
    assert np.all(np.isfinite(found))
    return float(found.mean()), float(found.std() / np.sqrt(found.size))


def ball(material: Material) -> tuple[SceneObject, ...]:
    return (SceneObject("ball", "", (Part(Sphere(1.0), material),)),)


def check_unseen(objects: tuple[SceneObject, ...], samples: int, depth: int = 512) -> None:
    mean, error = relative_to_light(objects, samples, depth)
    assert error < LARGEST_ERROR
    assert mean == pytest.approx(1.0, abs=ANALYTIC_TOLERANCE)


@pytest.mark.parametrize(
    ("material", "samples"),
    [pytest.param(m, n, id=name, marks=() if name in QUICK else pytest.mark.slow) for name, m, n in MATERIALS],
)
def test_white_ball_is_unseen_in_a_dome(material: Material, samples: int) -> None:
    check_unseen(ball(material), samples)


@pytest.mark.parametrize(
    "material", [Diffuse(UNIT), RoughPlastic(UNIT, 0.3), Conductor(NONE, UNIT, 0.3)], ids=lambda m: type(m).__name__
)
def test_white_mesh_is_unseen_in_a_dome(material: Material) -> None:
    check_unseen((SceneObject("box", "", (Part(Cube((2.0, 2.0, 2.0)), material),)),), 8192)


@pytest.mark.slow
@pytest.mark.parametrize(
    "material",
    [Diffuse(UNIT), RoughPlastic(UNIT, 0.3), Conductor(NONE, UNIT, 0.3), Dielectric(1.5, 1.0)],
    ids=lambda m: type(m).__name__,
)
def test_white_ball_is_unseen_in_a_glowing_room(material: Material) -> None:
    """The room's lamps are triangles, found by light sampling and by chance; its walls reflect nothing."""
    outward = mesh_of(Cube((12.0, 12.0, 12.0)))
    inward = Mesh(outward.vertices_m, outward.faces[:, ::-1])
    room = SceneObject("room", "", (Part(inward, Diffuse(NONE), emission=Emission(ONE)),))
    check_unseen((*ball(material), room), 8192)
