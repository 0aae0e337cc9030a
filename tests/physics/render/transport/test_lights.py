"""Lamps, sampled, against closed forms: each estimate is the mean of contributions divided by their densities."""

from __future__ import annotations

import numpy as np
import pytest
from light_scenes import NO_NORMAL, UP, Lit, lamps, placed, rectangle

from fullwell.radiometry.spectrum import Spectrum
from fullwell.render import choose_variant
from fullwell.render.transport.wavelengths import CELL_COUNT
from fullwell.render.variant import activate
from fullwell.scene import (
    ConstantEnvironment,
    DirectionalLight,
    PointLight,
    SpotLight,
)

CLOSED_FORM = 1e-3
"""What the product promises on analytic scenes; 65,536 even samples of one lamp err by a tenth of it."""

SAME_DENSITY = 2e-3
"""Relative difference of two ways to one density, in single precision, for triangles down to 3 degrees across."""

pytestmark = pytest.mark.skipif(
    choose_variant().variant != "llvm_ad_spectral",
    reason="the path loop needs a usable LLVM; the fallback has no lights of its own",
)


@pytest.fixture(scope="module")
def mi():
    return activate()


def square_above(half_m: float, height_m: float) -> float:
    """Form factor of a square about the axis of a small surface that faces it (Howell, B-4)."""
    x = half_m / height_m
    return 4.0 / np.pi * x / np.sqrt(1 + x * x) * np.arctan(x / np.sqrt(1 + x * x))


# Closed forms --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance_m", [0.01, 1.0, 300.0])
def test_point_light_gives_intensity_over_squared_distance(mi, distance_m: float) -> None:
    lit = Lit.of(mi, lamps(), [PointLight((0.0, 0.0, distance_m), Spectrum.constant(3.0))])
    assert lit.irradiance((0, 0, 0)) == pytest.approx(3.0 / distance_m**2, rel=1e-5)


@pytest.mark.parametrize(("angle_deg", "share"), [(0.0, 1.0), (19.9, 1.0), (25.0, 0.5), (28.0, 0.2), (30.1, 0.0), (150.0, 0.0)])
def test_spot_light_falls_linearly_from_its_beam_to_its_cutoff(mi, angle_deg: float, share: float) -> None:
    spot = SpotLight((0.0, 0.0, 0.0), (0.0, 0.0, -2.0), Spectrum.constant(5.0), beam_deg=20.0, cutoff_deg=30.0)
    lit = Lit.of(mi, lamps(), [spot])
    angle = np.radians(angle_deg)
    point = 2.0 * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    assert lit.irradiance(point, NO_NORMAL) == pytest.approx(5.0 / 4.0 * share, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("height_m", [1e-3, 0.1, 1.0, 10.0, 300.0])
def test_square_lamp_gives_its_form_factor(mi, height_m: float) -> None:
    lit = Lit.of(mi, lamps(rectangle(1.0, height_m), radiance=[2.0]))
    expected = 2.0 * np.pi * square_above(1.0, height_m)
    assert lit.irradiance((0, 0, 0), lanes=2**19) == pytest.approx(expected, rel=CLOSED_FORM)


@pytest.mark.parametrize("distance_m", [0.5001, 0.6, 3.0, 1000.0])
def test_sphere_gives_its_form_factor(mi, distance_m: float) -> None:
    lit = Lit.of(mi, lamps(curved=[placed("sphere", (0, 0, distance_m), 0.5)], radiance=[2.0]))
    assert lit.irradiance((0, 0, 0)) == pytest.approx(2.0 * np.pi * (0.5 / distance_m) ** 2, rel=CLOSED_FORM)


@pytest.mark.parametrize("height_m", [0.3, 1.0, 30.0])
def test_disk_gives_its_form_factor_on_its_axis(mi, height_m: float) -> None:
    lit = Lit.of(mi, lamps(curved=[placed("disk", (0, 0, height_m), 0.5, axis="-z")], radiance=[2.0]))
    expected = 2.0 * np.pi * 0.25 / (0.25 + height_m**2)
    assert lit.irradiance((0, 0, 0)) == pytest.approx(expected, rel=CLOSED_FORM)


@pytest.mark.parametrize("distance_m", [0.15, 0.5, 4.0])
def test_cylinder_gives_its_form_factor(mi, distance_m: float) -> None:
    """By quadrature over the half that is seen."""
    radius, half = 0.1, 1.0
    tube = placed("cylinder", (0, 0, distance_m), radius, axis="x", half_height=half / radius)
    lit = Lit.of(mi, lamps(curved=[tube], radiance=[2.0]))
    widest = np.arccos(radius / distance_m)
    turn = (np.arange(800) + 0.5) / 800 * 2 * widest - widest
    along = (np.arange(1600) + 0.5) / 1600 * 2 * half - half
    turn, along = np.meshgrid(turn, along, indexing="ij")
    y, z = radius * np.sin(turn), distance_m - radius * np.cos(turn)
    squared = along**2 + y**2 + z**2
    facing = -(np.sin(turn) * y - np.cos(turn) * z) / np.sqrt(squared)
    cell_m2 = (2 * widest / 800 * radius) * (2 * half / 1600)
    expected = 2.0 * np.sum(np.maximum(z, 0) / np.sqrt(squared) * facing / squared) * cell_m2
    assert lit.irradiance((0, 0, 0), lanes=2**18) == pytest.approx(expected, rel=CLOSED_FORM)


def test_directional_lights_add_up(mi) -> None:
    lights = [DirectionalLight((0, 0, -1.0), Spectrum.constant(v)) for v in (3.0, 0.5, 0.01)]
    lights.append(DirectionalLight((0, np.sqrt(3.0), -1.0), Spectrum.constant(2.0)))
    assert Lit.of(mi, lamps(), lights).irradiance((0, 0, 0)) == pytest.approx(3.51 + 1.0, rel=CLOSED_FORM)


def test_all_kinds_together_add_up(mi) -> None:
    surfaces = lamps(rectangle(0.5, 2.0), [placed("sphere", (1, 1, 2), 0.2), placed("disk", (0, 0, 3), 0.4, axis="-z")])
    kinds = [
        PointLight((0.5, 0, 1), Spectrum.constant(1.0)),
        DirectionalLight((0, 0, -1), Spectrum.constant(0.5)),
        ConstantEnvironment(Spectrum.constant(0.1)),
    ]
    whole = Lit.of(mi, surfaces, kinds)
    assert whole.lights.features == {"tree", "curved", "point", "distant", "environment", "dome"}
    assert whole.lights.count == 7
    parts = [Lit.of(mi, surfaces).irradiance((0, 0, 0), lanes=2**18)]
    parts += [Lit.of(mi, lamps(), [light]).irradiance((0, 0, 0)) for light in kinds]
    assert whole.irradiance((0, 0, 0), lanes=2**19) == pytest.approx(sum(parts), rel=2 * CLOSED_FORM)


# Densities -----------------------------------------------------------------------------------------------------------


def test_density_of_a_triangle_is_one_over_its_solid_angle(mi) -> None:
    """The octant, whose solid angle is pi / 2, and a direction within it is as likely as any other: its mean is known."""
    lit = Lit.of(mi, lamps([[[1, 0, 0], [0, 0, 1], [0, 1, 0]]]))
    sample = lit.sample((0, 0, 0), NO_NORMAL)
    assert sample.pdf.numpy() == pytest.approx(np.full(2**16, 2.0 / np.pi), rel=1e-5)
    directions = sample.direction.numpy()
    assert np.linalg.norm(directions, axis=0) == pytest.approx(np.ones(2**16), abs=1e-5)
    assert directions.mean(axis=1) == pytest.approx(np.full(3, 0.5), rel=CLOSED_FORM)
    assert (directions**2).mean(axis=1) == pytest.approx(np.full(3, 1.0 / 3.0), rel=CLOSED_FORM)
    assert np.ptp(sample.distance.numpy() * directions.sum(axis=0)) < 1e-4  # on the plane x + y + z = 1


@pytest.mark.parametrize("normal", [UP, NO_NORMAL])
def test_a_hit_has_the_density_of_its_sample(mi, normal) -> None:
    """Leaf by leaf: a sample's own direction, met on the lamp that it was chosen on."""
    shapes = [
        placed("sphere", (1, 1, 2), 0.2),
        placed("disk", (0, -1, 2), 0.4, axis="-z"),
        placed("cylinder", (0, 1, 2), 0.1, axis="x", half_height=8.0),
    ]
    triangles = np.concatenate([rectangle(0.5, 1.5, (x, x)) for x in (-2.0, 0.0, 2.0)])
    lit = Lit.of(mi, lamps(triangles, shapes), [ConstantEnvironment(Spectrum.constant(0.1))])
    lanes = 4096
    origin = np.random.default_rng(3).uniform(-1, 1, (lanes, 3)) * [1, 1, 0.2]
    sample = lit.sample(origin, normal, lanes)
    pdf, distance = sample.pdf.numpy().astype(float), sample.distance.numpy().astype(float)
    direction = sample.direction.numpy().T.astype(float)
    compared = 0
    for leaf in range(len(triangles) + len(shapes)):
        place = origin + np.where(np.isfinite(distance), distance, 0.0)[:, None] * direction
        normals, on = surface_at(place, leaf, triangles, shapes)
        on &= (pdf > 0) & np.isfinite(distance)
        density = lit.lights.hit_density(
            mi.UInt32(np.full(lanes, leaf, np.uint32)),
            lit.vector(origin, lanes),
            lit.vector(normal, lanes),
            sample.direction,
            sample.distance,
            lit.vector(normals, lanes),
            lit.all_lanes(lanes),
        ).numpy()
        assert density[on] == pytest.approx(pdf[on], rel=SAME_DENSITY)
        compared += np.count_nonzero(on)
    assert compared > 0.95 * np.count_nonzero(np.isfinite(distance) & (pdf > 0))


def surface_at(place, leaf, triangles, shapes):
    """Normals (lanes, 3) of a leaf at `place`, and which places lie on it."""
    if leaf < len(triangles):
        a, b, c = triangles[leaf]
        unit = np.cross(b - a, c - a)
        unit /= np.linalg.norm(unit)
        inner = np.linalg.lstsq(np.stack([b - a, c - a], 1), (place - a).T, rcond=None)[0]
        on = (np.abs((place - a) @ unit) < 1e-4) & (inner > -1e-4).all(0) & (inner.sum(0) < 1 + 1e-4)
        return np.broadcast_to(unit, place.shape), on
    shape = shapes[leaf - len(triangles)]
    local = (place - shape.to_world[:3, 3]) @ np.linalg.inv(shape.to_world[:3, :3]).T
    flat = np.linalg.norm(local[:, :2], axis=1)
    turn = shape.to_world[:3, :3] / np.linalg.norm(shape.to_world[:3, 0])
    if shape.kind == "sphere":
        return local @ turn.T, np.abs(np.linalg.norm(local, axis=1) - 1) < 2e-3
    if shape.kind == "disk":
        return np.broadcast_to(turn[:, 2], place.shape), (np.abs(local[:, 2]) < 1e-3) & (flat < 1)
    outwards = np.concatenate([local[:, :2] / flat[:, None], np.zeros((len(local), 1))], axis=1)
    return outwards @ turn.T, (np.abs(flat - 1) < 1e-3) & (np.abs(local[:, 2]) <= shape.half_height * (1 + 1e-5))


def test_density_over_all_directions_is_the_probability_of_the_lamps(mi) -> None:
    """Rays in all directions from a point within a closed box of lamps: each meets one."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([corners[list(t)] for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    inward = (
        np.einsum("ni,ni->n", np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), triangles.sum(1))
        < 0
    )
    triangles[~inward] = triangles[~inward][:, ::-1]
    lit = Lit.of(mi, lamps(triangles, radiance=np.linspace(1, 4, 12).tolist()))
    lanes = 2**18
    step = (np.arange(lanes) + 0.5) / lanes
    turn, z = np.pi * (1 + np.sqrt(5)) * np.arange(lanes), 1 - 2 * step
    direction = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], 1)
    origin = np.array([0.3, -0.2, 0.4])
    total = np.zeros(lanes)
    for leaf, (a, b, c) in enumerate(triangles):
        normal = np.cross(b - a, c - a) / 4.0
        distance = ((a - origin) @ normal) / np.where(direction @ normal == 0, np.inf, direction @ normal)
        place = origin + distance[:, None] * direction
        inner = np.linalg.lstsq(np.stack([b - a, c - a], 1), (place - a).T, rcond=None)[0]
        on = (distance > 0) & (inner >= 0).all(0) & (inner.sum(0) <= 1)
        density = lit.lights.hit_density(
            mi.UInt32(np.full(lanes, leaf, np.uint32)),
            lit.vector(origin, lanes),
            lit.vector(NO_NORMAL, lanes),
            lit.vector(direction, lanes),
            mi.Float(np.maximum(distance, 0).astype(np.float32)),
            lit.vector(normal, lanes),
            lit.all_lanes(lanes),
        ).numpy()
        total[on] += density[on]
    assert total.min() > 0
    assert total.mean() * 4 * np.pi == pytest.approx(1.0, rel=CLOSED_FORM)


def test_emission_of_a_hit_has_row_and_group_of_its_part(mi) -> None:
    surfaces = lamps(
        np.concatenate([rectangle(0.5, 2.0), rectangle(0.5, 2.0, (3, 0))]),
        [placed("sphere", (0, 0, 5), 0.5, part=1)],
        radiance=[3.0, 7.0],
        groups=["ceiling", "floor"],
    )
    lit = Lit.of(mi, surfaces)
    row, group = lit.lights.hit_emission(mi.UInt32([0, 1, 2, 3, 4]), lit.all_lanes(5))
    assert group.numpy().tolist() == [0, 0, 1, 1, 1]
    values = lit.spectra.values.numpy().reshape(CELL_COUNT, -1)[0, row.numpy()]
    assert values.tolist() == [3.0, 3.0, 7.0, 7.0, 7.0]


# Noise ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("half_m", "most"), [(0.2, 0.02), (1.0, 0.15), (5.0, 0.5)])
def test_a_square_lamp_is_less_noisy_than_by_area(mi, half_m: float, most: float) -> None:
    """Relative standard deviation of one sample; uniform over the area of the square would be the second figure."""
    values = Lit.of(mi, lamps(rectangle(half_m, 1.0))).contributions((0, 0, 0), UP)
    xy = np.random.default_rng(0).uniform(-half_m, half_m, (2, 2**16))
    by_area = 1.0 / (1.0 + np.sum(xy**2, axis=0)) ** 2
    ours, theirs = (v.std() / v.mean() for v in (values, by_area))
    assert ours < most
    assert ours < theirs


def plane_of_lamps(count: int, half_m: float, seed: int):
    rng = np.random.default_rng(seed)
    triangles = np.concatenate([rectangle(0.1, 3.0, tuple(rng.uniform(-half_m, half_m, 2))) for _ in range(count)])
    return lamps(triangles, radiance=np.exp(rng.normal(0, 1.5, count)).tolist())


def test_a_thousand_lamps_have_a_hundredth_of_the_variance_of_even_choice(mi) -> None:
    """Over receivers on the floor; the variance is a sum over leaves, without Monte Carlo."""
    surfaces = plane_of_lamps(1000, 20.0, 0)
    lit = Lit.of(mi, surfaces)
    ratios = []
    for point in np.random.default_rng(1).uniform(-20, 20, (16, 2)):
        share = selection(lit, (*point, 0.0), UP, len(surfaces.faces))
        assert share.sum() == pytest.approx(1.0, abs=1e-4)
        corners = surfaces.vertices_m[surfaces.faces].astype(float)
        way = corners.mean(axis=1) - [*point, 0.0]
        squared = np.sum(way**2, axis=1)
        light = np.array([surfaces.parts[p].radiance.values[0] for p in surfaces.face_part]) * way[:, 2] ** 2 / squared**2
        ours = np.sum(light**2 / share) / light.sum() ** 2 - 1
        evenly = len(light) * np.sum(light**2) / light.sum() ** 2 - 1
        ratios.append((ours, evenly))
    ours, evenly = np.mean(ratios, axis=0)
    assert ours < 1.0
    assert evenly / ours > 100.0


def selection(lit: Lit, point, normal, leaves: int) -> np.ndarray:
    leaf = lit.mi.UInt32(np.arange(leaves, dtype=np.uint32))
    walk = lit.lights._walk
    return (
        walk.probability(leaf, lit.vector(point, leaves), lit.vector(normal, leaves), lit.all_lanes(leaves))
        .numpy()
        .astype(float)
    )


# Limits --------------------------------------------------------------------------------------------------------------


def test_behind_the_lamp_and_below_the_receiver_there_is_nothing(mi) -> None:
    lit = Lit.of(mi, lamps(rectangle(0.5, 2.0)))
    assert np.all(lit.sample((0, 0, 3), UP).pdf.numpy() == 0)
    assert np.all(lit.sample((0, 0, 3), NO_NORMAL).pdf.numpy() == 0)
    assert np.all(lit.contributions((0, 0, 0), (0, 0, -1)) == 0)


def test_grazing_receivers_get_their_form_factor(mi) -> None:
    """A small surface upright beside a square, in the plane of its edge: half a square, by quadrature."""
    lit = Lit.of(mi, lamps(rectangle(1.0, 0.05)))
    steps = (np.arange(2000) + 0.5) / 1000 - 1
    x, y = np.meshgrid(steps, steps)
    expected = np.sum(np.maximum(x, 0) * 0.05 / (x**2 + y**2 + 0.05**2) ** 2) * 1e-6
    assert lit.irradiance((0, 0, 0), (1, 0, 0), lanes=2**18) == pytest.approx(expected, rel=2 * CLOSED_FORM)


def test_lamps_of_extreme_power_and_place_give_finite_numbers(mi) -> None:
    surfaces = lamps(
        [
            *rectangle(0.5, 2.0),
            [[0, 0, 1], [0, 0, 1], [1, 0, 1]],
            [[0, 0, 1], [1, 0, 1], [2, 0, 1]],
            *rectangle(0.5, 0.0),
            *rectangle(1e-6, 1.0),
            *rectangle(1e6, 1e7),
        ],
        [
            placed("sphere", (0, 0, 0), 0.3),
            placed("sphere", (0, 0, 1), 0.0),
            placed("cylinder", (0, 0, 0), 1.0, half_height=1.0),
        ],
        radiance=[1e12, 0.0, 1e-30],
    )
    lights = [
        PointLight((0.0, 0.0, 0.0), Spectrum.constant(1e12)),
        PointLight((0.0, 0.0, 1.0), Spectrum.constant(0.0)),
        SpotLight((0.0, 0.0, 0.0), (0, 0, 1), Spectrum.constant(1.0), 10.0, 20.0),
        DirectionalLight((0, 0, -1), Spectrum.constant(0.0)),
        ConstantEnvironment(Spectrum.constant(0.0)),
    ]
    lit = Lit.of(mi, surfaces, lights)
    assert lit.lights.features == {"tree", "curved", "point"}
    lanes = 4096
    points = np.concatenate([np.zeros((lanes // 2, 3)), np.random.default_rng(0).normal(0, 1, (lanes // 2, 3))])
    for normal in (UP, NO_NORMAL, (1, 0, 0)):
        sample = lit.sample(points, normal, lanes)
        found = sample.pdf.numpy() > 0
        assert found.any()
        for values in (sample.pdf.numpy(), sample.direction.numpy().T, sample.distance.numpy(), lit.radiance(sample)):
            assert np.all(np.isfinite(values[found]))
        assert np.all(np.isfinite(sample.pdf.numpy()))
        for leaf in range(surfaces.emissive_faces + surfaces.emissive_curved):
            density = lit.lights.hit_density(
                mi.UInt32(np.full(lanes, leaf, np.uint32)),
                lit.vector(points, lanes),
                lit.vector(normal, lanes),
                lit.vector(UP, lanes),
                lit.mi.Float(np.linspace(0, 5, lanes).astype(np.float32)),
                lit.vector((0, 0, -1), lanes),
                lit.all_lanes(lanes),
            ).numpy()
            assert np.all(np.isfinite(density))
            assert np.all(density >= 0)


def test_no_lights_at_all_give_densities_of_zero(mi) -> None:
    lit = Lit.of(mi, lamps())
    assert lit.lights.features == frozenset()
    assert lit.lights.count == 0
    assert np.all(lit.sample((0, 0, 0), UP, 16).pdf.numpy() == 0)


def test_group_weights_move_choices_and_not_results(mi) -> None:
    surfaces = lamps(
        np.concatenate([rectangle(0.2, 2.0, (-1, 0)), rectangle(0.2, 2.0, (1, 0))]), radiance=[1.0, 1.0], groups=["a", "b"]
    )
    even, uneven = Lit.of(mi, surfaces), Lit.of(mi, surfaces, group_weights=[1.0, 9.0])
    assert np.mean(uneven.sample((0, 0, 0), UP).group.numpy() == 1) == pytest.approx(0.9, abs=0.01)
    assert even.irradiance((0, 0, 0)) == pytest.approx(uneven.irradiance((0, 0, 0), lanes=2**18), rel=2 * CLOSED_FORM)


def test_a_group_of_weight_zero_is_still_lit(mi) -> None:
    surfaces = lamps(rectangle(0.2, 2.0), groups=["a"])
    dark, even = Lit.of(mi, surfaces, group_weights=[0.0]), Lit.of(mi, surfaces)
    assert dark.irradiance((0, 0, 0)) == pytest.approx(even.irradiance((0, 0, 0)), rel=CLOSED_FORM)
    two = lamps(
        np.concatenate([rectangle(0.2, 2.0, (-1, 0)), rectangle(0.2, 2.0, (1, 0))]), radiance=[1.0, 1.0], groups=["a", "b"]
    )
    sample = Lit.of(mi, two, group_weights=[1.0, 0.0]).sample((0, 0, 0), UP)
    assert 0 < np.mean(sample.group.numpy() == 1) < 0.01


def test_another_scene_of_the_same_kinds_compiles_nothing(mi) -> None:
    import drjit as dr

    def run(surfaces) -> list[bool]:
        lit = Lit.of(mi, surfaces)
        dr.set_flag(dr.JitFlag.KernelHistory, True)
        try:
            dr.kernel_history_clear()
            sample = lit.sample((0, 0, 0), UP, 4096)
            dr.eval(sample.direction, sample.pdf, sample.distance)
            return [bool(entry["cache_hit"]) for entry in dr.kernel_history([dr.KernelType.JIT])]
        finally:
            dr.set_flag(dr.JitFlag.KernelHistory, False)

    run(plane_of_lamps(3, 2.0, 0))
    assert all(run(plane_of_lamps(50, 9.0, 1)))
    assert all(run(lamps([[[1, 0, 0], [0, 0, 1], [0, 1, 0]]])))
