"""Materials of the path loop: energy, densities, reciprocity, and Mitsuba's own scattering functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import qmc

from fullwell.radiometry import Spectrum, metal
from fullwell.radiometry.glasses import glass
from fullwell.render.variant import VECTORISED, activate
from fullwell.scene import Conductor, Dielectric, Diffuse, Material, Mirror, Principled, RoughPlastic, Translucent

ENERGY_TOLERANCE = 1e-3
"""What the product promises."""

SINGLE_PRECISION = 2e-4
"""Relative: microfacet densities near their peak amplify the rounding of the half vector."""

QUADRATURE_TOLERANCE = 2e-3
"""Of midpoint sums over the sphere against mean weights; lobes of alpha 0.1 are the narrowest."""

COAT_TOLERANCE = 2e-3
"""Absolute: the plugin interpolates the transmittance of its coat between 64 equally spaced cosines."""

COSINES = (1.0, 0.85, 0.5, 0.2, 0.05, 0.01)
WAVELENGTHS = 4
ONE, ZERO = Spectrum.constant(1.0), Spectrum.constant(0.0)
RAMP = Spectrum(np.array([400.0, 800.0]), np.array([0.1, 0.9]))
FALL = Spectrum(np.array([400.0, 800.0]), np.array([0.6, 0.1]))


class Bench:
    """Materials on the device, and calls of them with one direction per lane."""

    def __init__(self, materials: Sequence[Material], *, compensate: bool = True) -> None:
        from fullwell.render.transport.materials import MaterialTable
        from fullwell.render.transport.wavelengths import SpectraTable

        self.mi: Any = activate()
        if self.mi.variant() != VECTORISED:
            pytest.skip("the path loop needs the vectorised renderer")
        self.count = len(materials)
        spectra = SpectraTable()
        self.table = MaterialTable(self.mi, spectra, materials, compensate=compensate)
        self._spectra = spectra.finish(self.mi)

    def surface(
        self, material: NDArray[Any] | int, *, first_cell: int = 300, cells: list[int] | None = None, single: bool = False
    ) -> Any:
        from fullwell.render.transport.upload import upload

        mi = self.mi
        numbers = cells or [(first_cell + 100 * i) % (100 * WAVELENGTHS) + 200 for i in range(WAVELENGTHS)]
        cells = [mi.UInt32(number) for number in numbers]
        return self.table.at(
            self._spectra,
            upload(mi.UInt32, np.atleast_1d(np.asarray(material, dtype=np.uint32))),
            mi.Point2f(0.3, 0.6),
            cells,
            [mi.Float(300.25) + 0.5 * mi.Float(cell) for cell in cells],
            mi.Float(0.4),
            mi.Bool(True),
            mi.Bool(True) if single else None,
        )

    def vectors(self, directions: NDArray[Any]) -> Any:
        return self.mi.Vector3f(np.ascontiguousarray(np.atleast_2d(directions).T, dtype=np.float32))


def towards(cosine: float, azimuth: float = 0.0) -> NDArray[np.float64]:
    sine = np.sqrt(max(0.0, 1.0 - cosine**2))
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])


def spread_numbers(count: int) -> NDArray[np.float64]:
    """Return (count, 3) points that fill the unit cube evenly."""
    return np.asarray(qmc.Sobol(3, scramble=True, seed=5).random(count))


def sphere_midpoints(rows: int, cols: int) -> tuple[NDArray[np.float64], float]:
    """Return directions at the middles of cells of equal solid angle, and that solid angle [sr]."""
    z, azimuth = np.meshgrid((np.arange(rows) + 0.5) / rows * 2 - 1, (np.arange(cols) + 0.5) / cols * 2 * np.pi, indexing="ij")
    sine = np.sqrt(1.0 - z**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z], axis=-1).reshape(-1, 3), 4 * np.pi / (rows * cols)


def mean_weights(
    bench: Bench, cosine: float, samples: int, *, chosen: NDArray[Any] | None = None, first_cell: int = 300
) -> NDArray[np.float64]:
    """Return (materials, W) mean sample weights, refracted ones as power: without the factor of radiance."""
    mi = bench.mi
    numbers = np.arange(bench.count) if chosen is None else chosen
    u = np.tile(spread_numbers(samples), (len(numbers), 1))
    surface = bench.surface(np.repeat(numbers, samples), first_cell=first_cell)
    drawn = surface.sample(
        bench.vectors(towards(cosine)), mi.Float(u[:, 0]), mi.Point2f(np.ascontiguousarray(u[:, 1:].T, dtype=np.float32))
    )
    power = np.where(np.array(drawn.transmitted), np.array(drawn.eta) ** 2, 1.0)
    weights = np.array(drawn.weight) * power
    assert np.all(np.isfinite(weights))
    assert np.all(weights >= 0)
    return np.asarray(weights.reshape(WAVELENGTHS, len(numbers), samples).mean(axis=2).T, dtype=np.float64)


WHITE: list[tuple[str, Material]] = [
    ("diffuse", Diffuse(ONE)),
    *((f"sheet {t}", Translucent(Spectrum.constant(1.0 - t), Spectrum.constant(t))) for t in (0.0, 0.3, 1.0)),
    ("mirror", Mirror(ONE)),
    *((f"metal {a}", Conductor(ZERO, ONE, a)) for a in (0.0, 0.003, 0.05, 0.2, 0.6, 1.0)),
    *((f"plastic {a} {n}", RoughPlastic(ONE, a, n)) for a in (5e-4, 0.005, 0.1, 0.5, 1.0) for n in (1.0, 1.2, 1.5, 3.0)),
    *((f"principled {r} {m}", Principled(ONE, r, m)) for r in (0.02, 0.3, 0.7, 1.0) for m in (0.0, 0.4, 1.0)),
    *(
        (f"glass {a} {n}", Dielectric(n, 1.0, a))
        for a in (0.0, 0.003, 0.1, 0.4, 1.0)
        for n in (1.0, 1.0001, 1.1, 1.5, 4.0, 0.7)
    ),
]


@pytest.fixture(scope="module")
def white() -> Bench:
    return Bench([material for _, material in WHITE])


class TestEnergy:
    @pytest.mark.parametrize("cosine", [*COSINES, -1.0, -0.85, -0.5, -0.1])
    def test_white_materials_return_all_light(self, white: Bench, cosine: float) -> None:
        coarse = np.abs(mean_weights(white, cosine, 1 << 15) - 1).max(axis=1)
        # What the sampling itself leaves open is looked at more closely.
        doubtful = np.append(np.flatnonzero(coarse > ENERGY_TOLERANCE / 2), 0)
        fine = np.abs(mean_weights(white, cosine, 1 << 19, chosen=doubtful) - 1).max(axis=1)
        wrong = {WHITE[i][0]: off for i, off in zip(doubtful, fine, strict=True) if off > ENERGY_TOLERANCE}
        assert not wrong

    @pytest.mark.parametrize("cosine", [1.0, 0.4, -0.4])
    def test_dispersive_glass_returns_all_light_over_its_wavelengths(self, cosine: float) -> None:
        bench = Bench([Dielectric(glass("N-SF11"), 1.0, alpha) for alpha in (0.0, 0.1, 0.5)])
        # Each wavelength takes its turn as the first, which refraction keeps.
        turns = [mean_weights(bench, cosine, 1 << 15, first_cell=100 * turn) for turn in range(WAVELENGTHS)]
        by_wavelength = np.mean([np.roll(turn, number, axis=1) for number, turn in enumerate(turns)], axis=0)
        np.testing.assert_allclose(by_wavelength, 1.0, atol=ENERGY_TOLERANCE)

    def test_coated_body_darkens_by_its_inner_reflections(self) -> None:
        bench = Bench([RoughPlastic(Spectrum.constant(rho), 5e-4, 1.5) for rho in (0.0, 0.2, 0.5, 0.8)])
        grey = mean_weights(bench, 0.6, 1 << 15)[:, 0]
        outside, inside = 0.0918, 0.5964  # diffuse reflectances of n = 1.5 (walter2007's Fresnel terms, integrated)
        surface = _fresnel(0.6, 1.5)
        rho = np.array([0.0, 0.2, 0.5, 0.8])
        expected = surface + (1 - surface) * (1 - outside) / 1.5**2 * rho / (1 - rho * inside)
        np.testing.assert_allclose(grey, expected, atol=ENERGY_TOLERANCE)

    def test_metals_get_back_less_than_they_absorb(self) -> None:
        eta, k = metal("copper")
        smooth, rough = (Bench([Conductor(eta, k, alpha)]) for alpha in (0.0, 0.8))
        single = Bench([Conductor(eta, k, 0.8)], compensate=False)
        polished, compensated, lost = (mean_weights(bench, 0.7, 1 << 15)[0] for bench in (smooth, rough, single))
        assert np.all(compensated > lost + 0.02)
        assert np.all(compensated < polished)  # each further reflection absorbs


def _fresnel(cosine: float, index: float) -> float:
    refracted = np.sqrt(1 - (1 - cosine**2) / index**2)
    normal = (cosine - index * refracted) / (cosine + index * refracted)
    parallel = (index * cosine - refracted) / (index * cosine + refracted)
    return float((normal**2 + parallel**2) / 2)


EYES: list[tuple[str, Material]] = [
    ("diffuse", Diffuse(RAMP)),
    ("metal", Conductor(*metal("gold"), 0.3)),
    ("sheet", Translucent(RAMP, FALL)),
    ("plastic", RoughPlastic(RAMP, 0.15, 1.5)),
    ("polished plastic", RoughPlastic(RAMP, 5e-4, 1.5)),
    ("principled", Principled(RAMP, 0.6, 0.5)),
    ("glass", Dielectric(1.5, 1.0, 0.3)),
    ("dense glass", Dielectric(2.4, 1.0, 0.2)),
    ("dispersive glass", Dielectric(glass("N-SF11"), 1.0, 0.3)),
]


class TestSampling:
    @pytest.mark.parametrize("cosine", [0.95, 0.4, -0.7])
    @pytest.mark.parametrize(("name", "material"), EYES)
    def test_samples_follow_their_density_and_weigh_what_evaluation_says(
        self, name: str, material: Material, cosine: float
    ) -> None:
        bench = Bench([material])
        samples = 1 << 17
        wi, u = bench.vectors(towards(cosine, 0.7)), spread_numbers(samples)
        surface = bench.surface(0)
        drawn = surface.sample(
            wi, bench.mi.Float(u[:, 0]), bench.mi.Point2f(np.ascontiguousarray(u[:, 1:].T, dtype=np.float32))
        )
        smooth = ~np.broadcast_to(np.array(drawn.delta), samples) & (np.array(drawn.pdf) > 0)
        sampled = (np.array(drawn.weight) * smooth).mean(axis=1)

        directions, solid_angle = sphere_midpoints(512, 512)
        value, density = (np.array(x) for x in surface.evaluate(wi, bench.vectors(directions)))
        np.testing.assert_allclose(value.sum(axis=1) * solid_angle, sampled, atol=QUADRATURE_TOLERANCE)
        np.testing.assert_allclose(density.sum() * solid_angle, smooth.mean(), atol=QUADRATURE_TOLERANCE)

        bins = [np.linspace(-1, 1, 9), np.linspace(-np.pi, np.pi, 9)]
        counted, expected = (
            np.histogram2d(z, np.arctan2(y, x), bins, weights=weight)[0]
            for (x, y, z), weight in (
                (np.array(drawn.wo), smooth / samples),
                (directions.T, density * solid_angle),
            )
        )
        np.testing.assert_allclose(counted, expected, atol=QUADRATURE_TOLERANCE)

    @pytest.mark.parametrize(("name", "material"), EYES)
    def test_the_density_of_a_sample_is_that_of_evaluation(self, name: str, material: Material) -> None:
        bench = Bench([material])
        wi, u = bench.vectors(towards(0.6)), spread_numbers(1 << 12)
        surface = bench.surface(0)
        drawn = surface.sample(
            wi, bench.mi.Float(u[:, 0]), bench.mi.Point2f(np.ascontiguousarray(u[:, 1:].T, dtype=np.float32))
        )
        value, density = surface.evaluate(wi, drawn.wo)
        smooth = np.array(drawn.pdf) > 0
        np.testing.assert_allclose(np.array(drawn.pdf)[smooth], np.array(density)[smooth], rtol=1e-3)
        np.testing.assert_allclose(
            (np.array(drawn.weight) * np.array(drawn.pdf))[:, smooth], np.array(value)[:, smooth], rtol=5e-3, atol=1e-6
        )

    def test_polished_surfaces_have_nothing_to_evaluate(self) -> None:
        bench = Bench([Mirror(ONE), Dielectric(1.5), Conductor(*metal("gold")), RoughPlastic(ONE, 5e-4), Diffuse(ZERO)])
        surface = bench.surface(np.arange(5))
        assert np.array(surface.has_smooth).tolist() == [False, False, False, True, True]
        value, density = surface.evaluate(bench.vectors(towards(0.5)), bench.vectors(towards(0.5, np.pi)))
        assert not np.array(value)[:, :3].any()
        assert not np.array(density)[:3].any()

    def test_features_name_the_code_that_is_needed(self) -> None:
        assert Bench([Diffuse(ONE)]).table.features == frozenset()
        assert Bench([Principled(ONE, 0.5, 0.5), Dielectric(1.5)]).table.features == {"plastic", "metal", "glass"}
        assert Bench([Dielectric(glass("water"), roughness=0.1)]).table.features == {"glass", "rough_glass", "dispersion"}
        assert Bench([Dielectric(Spectrum.constant(1.5))]).table.features == {"glass"}


class TestReciprocity:
    @pytest.mark.parametrize(("name", "material"), [item for item in EYES if "glass" not in item[0]])
    def test_opaque_materials_scatter_the_same_both_ways(self, name: str, material: Material) -> None:
        forth, back = _both_ways(Bench([material]), upper=True)
        np.testing.assert_allclose(forth, back, rtol=SINGLE_PRECISION, atol=1e-6)

    def test_glass_without_compensation_is_reciprocal_up_to_the_index_squared(self) -> None:
        forth, back = _both_ways(Bench([Dielectric(1.5, 1.0, 0.3)], compensate=False), upper=False)
        np.testing.assert_allclose(forth, back / 1.5**2, rtol=1e-3, atol=1e-5)


def _both_ways(bench: Bench, *, upper: bool) -> tuple[NDArray[Any], NDArray[Any]]:
    u = spread_numbers(1 << 10)
    above = np.stack([towards(c, a) for c, a in zip(u[:, 0] * 0.95 + 0.05, 6 * u[:, 1], strict=True)])
    other = np.stack([towards(c, a) for c, a in zip(np.roll(u[:, 2], 7) * 0.95 + 0.05, 6 * np.roll(u[:, 0], 3), strict=True)])
    other[:, 2] *= 1 if upper else -1
    surface = bench.surface(0)
    forth, _ = surface.evaluate(bench.vectors(above), bench.vectors(other))
    back, _ = surface.evaluate(bench.vectors(other), bench.vectors(above))
    return np.array(forth) / np.abs(other[:, 2]), np.array(back) / np.abs(above[:, 2])


def _table(spectrum: Spectrum) -> dict[str, Any]:
    return {
        "type": "irregular",
        "wavelengths": ", ".join(map(str, spectrum.wavelength_nm)),
        "values": ", ".join(map(str, spectrum.values)),
    }


MITSUBA: list[tuple[str, Material, dict[str, Any], bool]] = [
    ("diffuse", Diffuse(RAMP), {"type": "diffuse", "reflectance": _table(RAMP)}, True),
    *(
        (
            f"metal {alpha}",
            Conductor(*metal("gold"), alpha),
            {"type": "roughconductor", "distribution": "ggx", "alpha": alpha}
            | {name: _table(table) for name, table in zip(("eta", "k"), metal("gold"), strict=True)},
            True,
        )
        for alpha in (0.05, 0.3, 1.0)
    ),
    *(
        (
            f"plastic {alpha} {index}",
            RoughPlastic(RAMP, alpha, index),
            {
                "type": "roughplastic",
                "distribution": "ggx",
                "alpha": alpha,
                "int_ior": index,
                "ext_ior": 1.0,
                "nonlinear": True,
                "diffuse_reflectance": _table(RAMP),
            },
            False,  # the lobes are chosen differently
        )
        for alpha in (0.05, 0.3, 1.0)
        for index in (1.3, 1.5, 2.0)
    ),
    *(
        (
            f"glass {alpha} {index}",
            Dielectric(index, 1.0, alpha),
            {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha, "int_ior": index, "ext_ior": 1.0},
            True,
        )
        for alpha in (0.05, 0.4)
        for index in (1.3, 2.0)
    ),
]


class TestMitsuba:
    @pytest.mark.parametrize(("name", "material", "plugin", "same_density"), MITSUBA)
    def test_scattering_without_compensation_is_that_of_the_plugin(
        self, name: str, material: Material, plugin: dict[str, Any], same_density: bool
    ) -> None:
        import drjit as dr

        bench = Bench([material], compensate=False)
        mi, surface = bench.mi, bench.surface(0)
        u = spread_numbers(1 << 12)
        wi = np.stack([towards(c, a) for c, a in zip(u[:, 0], 6 * u[:, 1], strict=True)])
        if "glass" in name:
            wi[::2, 2] *= -1
        drawn = surface.sample(
            bench.vectors(wi), mi.Float(u[:, 2]), mi.Point2f(np.ascontiguousarray(u[:, :2].T, dtype=np.float32))
        )
        interaction = dr.zeros(mi.SurfaceInteraction3f, len(u))
        interaction.wi = bench.vectors(wi)
        cells = [(300 + 100 * i) % 400 + 200 for i in range(WAVELENGTHS)]
        interaction.wavelengths = type(interaction.wavelengths)([mi.Float(300.25 + 0.5 * cell) for cell in cells])
        bsdf = mi.load_dict(plugin)
        value, density = (np.array(x) for x in bsdf.eval_pdf(mi.BSDFContext(), interaction, drawn.wo))
        ours, our_density = (np.array(x) for x in surface.evaluate(bench.vectors(wi), drawn.wo))

        tolerance = SINGLE_PRECISION if "plastic" not in name else COAT_TOLERANCE
        np.testing.assert_allclose(ours, value, rtol=10 * SINGLE_PRECISION, atol=tolerance)
        if same_density:
            np.testing.assert_allclose(our_density, density, rtol=10 * SINGLE_PRECISION, atol=SINGLE_PRECISION)

    @pytest.mark.parametrize("cosine", [0.9, 0.3, -0.9, -0.3])
    def test_polished_glass_reflects_and_refracts_as_the_plugin(self, cosine: float) -> None:
        import drjit as dr

        bench = Bench([Dielectric(1.5, 1.0)])
        mi = bench.mi
        numbers = np.linspace(0.005, 0.995, 100)
        interaction = dr.zeros(mi.SurfaceInteraction3f, 100)
        interaction.wi = bench.vectors(np.tile(towards(cosine, 0.4), (100, 1)))
        bsdf = mi.load_dict({"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0})
        theirs, weight = bsdf.sample(mi.BSDFContext(), interaction, mi.Float(numbers), mi.Point2f(0.5, 0.5))
        ours = bench.surface(0).sample(interaction.wi, mi.Float(numbers), mi.Point2f(0.5, 0.5))
        np.testing.assert_allclose(np.array(ours.wo), np.array(theirs.wo), atol=1e-6)
        np.testing.assert_allclose(np.array(ours.weight), np.array(weight), rtol=1e-5)
        np.testing.assert_allclose(np.array(ours.eta), np.array(theirs.eta), rtol=1e-6)
        assert np.array(ours.delta).all()


class TestDispersion:
    @pytest.mark.parametrize(("line_nm", "index"), [(486.1327, 1.52238), (587.5618, 1.51680), (656.2725, 1.51432)])
    def test_a_prism_of_crown_glass_deviates_each_line_by_the_least_angle(self, line_nm: float, index: float) -> None:
        from fullwell.radiometry.glasses import AIR_INDEX

        apex = np.radians(60.0)
        deviation = 2 * np.arcsin(index * np.sin(apex / 2)) - apex  # minimum deviation, with the catalogue's index
        bench = Bench([Dielectric(glass("N-BK7"), AIR_INDEX)])
        incidence = (apex + deviation) / 2
        inside = self._refracted(bench, line_nm, np.array([-np.sin(incidence), 0.0, np.cos(incidence)]))
        # The second face leans by the apex angle, and is met from inside: its normal points out of the glass.
        angle = apex - np.arctan2(inside[0], -inside[2])
        outside = self._refracted(bench, line_nm, np.array([-np.sin(angle), 0.0, -np.cos(angle)]))
        emergence = np.arctan2(outside[0], outside[2])
        assert np.degrees(incidence + emergence - apex) == pytest.approx(np.degrees(deviation), abs=2e-3)

    def _refracted(self, bench: Bench, line_nm: float, wi: NDArray[np.float64]) -> NDArray[np.float64]:
        cell = int((line_nm - 300.0) / 0.5)
        drawn = bench.surface(0, cells=[cell] * WAVELENGTHS).sample(
            bench.vectors(wi), bench.mi.Float(0.999), bench.mi.Point2f(0.5, 0.5)
        )
        assert np.array(drawn.single_wavelength).all()
        return np.array(drawn.wo)[:, 0].astype(np.float64)

    def test_refraction_keeps_the_first_wavelength_and_gives_it_the_weight_of_all_once(self) -> None:
        bench = Bench([Dielectric(glass("F2"), 1.0)])
        first = bench.surface(0).sample(bench.vectors(towards(0.8)), bench.mi.Float(0.9), bench.mi.Point2f(0.5, 0.5))
        again = bench.surface(0, single=True).sample(
            bench.vectors(towards(0.8)), bench.mi.Float(0.9), bench.mi.Point2f(0.5, 0.5)
        )
        one, other = np.array(first.weight)[:, 0], np.array(again.weight)[:, 0]
        assert one[0] == pytest.approx(WAVELENGTHS * other[0])
        assert not one[1:].any()
        assert other[0] == pytest.approx(np.array(again.eta)[0] ** -2)

    def test_reflection_keeps_all_wavelengths_with_their_own_shares(self) -> None:
        bench = Bench([Dielectric(glass("N-SF11"), 1.0)])
        drawn = bench.surface(0, cells=[200, 400, 600, 800]).sample(
            bench.vectors(towards(0.8)), bench.mi.Float(0.0), bench.mi.Point2f(0.5, 0.5)
        )
        shares = [_fresnel(0.8, float(glass("N-SF11").at(300.25 + cell / 2))) for cell in (200, 400, 600, 800)]
        np.testing.assert_allclose(np.array(drawn.weight)[:, 0], np.array(shares) / shares[0], rtol=1e-4)
        assert not np.array(drawn.single_wavelength).any()


class TestLimits:
    def test_nothing_is_ever_undefined(self) -> None:
        materials: list[Material] = [Diffuse(ZERO), Mirror(ZERO), Conductor(ZERO, ZERO, 0.1), Conductor(ONE, ZERO, 0.0)]
        for alpha in (1e-3, 0.0011, 0.03, 1.0):
            materials += [Conductor(ZERO, ONE, alpha), Principled(ZERO, alpha, 0.5), Principled(ONE, alpha, 1.0)]
            materials += [RoughPlastic(ZERO, alpha, n) for n in (1.0, 1.0001, 4.0)]
            materials += [Dielectric(n, 1.0, alpha) for n in (1.0, 1.0001, 1.002, 4.0, 0.25)]
        bench = Bench(materials)
        mi, rng = bench.mi, np.random.default_rng(2)
        cosines = [1.0, 0.3, 1e-3, 1e-6, 1e-12, 0.0, -1e-9, -1e-3, -1.0]
        lanes = 1 << 12
        u = rng.random((lanes, 3), dtype=np.float32)
        u[:8] = [[a, b, c] for a in (0.0, 1 - 2**-24) for b in (0.0, 1 - 2**-24) for c in (0.0, 1 - 2**-24)]
        for cosine in cosines:
            rows = np.repeat(np.arange(len(materials)), lanes)
            numbers = np.tile(u, (len(materials), 1))
            surface, wi = bench.surface(rows), bench.vectors(towards(cosine, 0.3))
            drawn = surface.sample(wi, mi.Float(numbers[:, 0]), mi.Point2f(np.ascontiguousarray(numbers[:, 1:].T)))
            value, density = surface.evaluate(wi, drawn.wo)
            for result in (drawn.wo, drawn.weight, drawn.pdf, value, density):
                assert np.isfinite(np.array(result)).all()
            for result in (drawn.weight, drawn.pdf, value, density):
                assert (np.array(result) >= 0).all()


class TestCompilation:
    def test_other_materials_of_the_same_features_compile_nothing(self) -> None:
        import drjit as dr

        from fullwell.render.transport.upload import upload

        def compiled(materials: list[Material], cosine: float) -> int:
            bench = Bench(materials)
            u = spread_numbers(1 << 10)
            lanes = np.arange(1 << 10) % len(materials)
            wi = bench.mi.Vector3f(*(upload(bench.mi.Float, np.full(1 << 10, x, dtype=np.float32)) for x in towards(cosine)))
            u_lobe, x, y = (upload(bench.mi.Float, column.astype(np.float32)) for column in u.T)
            numbers = (u_lobe, bench.mi.Point2f(x, y))
            surface = bench.surface(lanes)
            drawn = surface.sample(wi, *numbers)
            value, density = surface.evaluate(wi, drawn.wo)
            dr.kernel_history_clear()
            with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
                dr.eval(drawn.weight, drawn.pdf, value, density)
                history = dr.kernel_history([dr.KernelType.JIT])
            return sum(not kernel["cache_hit"] for kernel in history)

        compiled([RoughPlastic(RAMP, 0.1), Conductor(*metal("gold"), 0.3), Dielectric(glass("F2"), 1.0, 0.2)], 0.8)
        others = [Principled(ONE, 0.5, 0.3), Diffuse(ZERO), Dielectric(1.4), Dielectric(glass("water"), 1.0, 0.5), Mirror(RAMP)]
        assert compiled(others, 0.3) == 0
