"""What the tests of lights share: small sets of lamps, and estimates made with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.radiometry.spectrum import Spectrum
from fullwell.render.transport.lights import LightSample, LightSet
from fullwell.render.transport.surfaces import CurvedShape, PartRecord, SceneSurfaces
from fullwell.render.transport.upload import upload
from fullwell.render.transport.wavelengths import CELL_COUNT, SpectraTable
from fullwell.scene import Diffuse, Light

GREY = Diffuse(Spectrum.constant(0.5))
CELL = 400
"""The cell that estimates look at: 500 nm."""

UP = (0.0, 0.0, 1.0)
NO_NORMAL = (0.0, 0.0, 0.0)


def lamps(
    triangles: Any = (),
    curved: Sequence[CurvedShape] = (),
    radiance: Sequence[float] = (1.0,),
    groups: Sequence[str] = ("default",),
) -> SceneSurfaces:
    """Emissive triangles (n, 3, 3), whose parts take turns in equal runs, and curved shapes that name their part."""
    corners = np.asarray(triangles, dtype=np.float64).reshape(-1, 3, 3)
    faces = np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3)
    parts = tuple(PartRecord(0, 0, Spectrum.constant(value), number % len(groups)) for number, value in enumerate(radiance))
    run = max(1, len(corners) // len(parts))
    return SceneSurfaces(
        vertices_m=corners.reshape(-1, 3).astype(np.float32),
        faces=faces,
        face_part=np.minimum(np.arange(len(faces)) // run, len(parts) - 1).astype(np.uint32),
        normals=None,
        uv=None,
        emissive_faces=len(faces),
        curved=tuple(curved),
        emissive_curved=len(curved),
        parts=parts,
        materials=(GREY,),
        groups=tuple(groups),
    )


def rectangle(half_m: float, height_m: float, centre: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float64]:
    """Two triangles that shine down."""
    a, h = half_m, height_m
    corners = np.array([[[-a, -a, h], [-a, a, h], [a, a, h]], [[-a, -a, h], [a, a, h], [a, -a, h]]])
    return corners + [*centre, 0.0]


def placed(
    kind: Any, centre: Sequence[float], radius_m: float, *, axis: str = "z", half_height: float = 0.0, part: int = 0
) -> CurvedShape:
    """A curved shape whose own z axis points along "z", "-z" or "x"."""
    turn = {
        "z": np.eye(3),
        "-z": np.diag([1.0, -1.0, -1.0]),
        "x": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    }[axis]
    to_world = np.eye(4)
    to_world[:3, :3], to_world[:3, 3] = turn * radius_m, centre
    return CurvedShape(kind, to_world, part, half_height)


@dataclass
class Lit:
    """A light set and the spectra on the device."""

    mi: Any
    lights: LightSet
    spectra: Any

    @classmethod
    def of(
        cls, mi: Any, surfaces: SceneSurfaces, lights: Sequence[Light] = (), group_weights: Sequence[float] | None = None
    ) -> Lit:
        """Put lights on the device."""
        table = SpectraTable()
        weights = np.ones(len(surfaces.groups)) if group_weights is None else np.asarray(group_weights)
        lit = LightSet(
            mi,
            table,
            surfaces,
            lights,
            centre_m=np.zeros(3),
            weights=np.ones(CELL_COUNT),
            group_weights=weights,
            scene_radius_m=10.0,
        )
        return cls(mi, lit, table.finish(mi))

    def vector(self, values: Any, lanes: int) -> Any:
        """One point or direction for all lanes, or (lanes, 3)."""
        spread = np.broadcast_to(np.asarray(values, dtype=np.float32), (lanes, 3))
        return self.mi.Vector3f(*(upload(self.mi.Float, spread[:, k]) for k in range(3)))

    def all_lanes(self, lanes: int) -> Any:
        """Every lane active."""
        import drjit as dr

        return dr.full(self.mi.Bool, True, lanes)

    def sample(self, point: Any, normal: Any, lanes: int = 2**16, seed: int = 1) -> LightSample:
        """Sample with stratified numbers."""
        mi = self.mi
        rng = np.random.default_rng(seed)
        # Additive recurrence of the plastic number's kin in three dimensions: even in all of them.
        step = 1.0 / 1.2207440846057596 ** np.arange(1, 4)
        numbers = (np.arange(lanes)[None] * step[:, None] + rng.random((3, 1))) % 1.0
        u_select, x, y = (upload(mi.Float, np.minimum(row, 1 - 2**-24).astype(np.float32)) for row in numbers)
        return self.lights.sample(
            self.vector(point, lanes), self.vector(normal, lanes), u_select, mi.Point2f(x, y), self.all_lanes(lanes)
        )

    def radiance(self, sample: LightSample) -> NDArray[np.float64]:
        """(lanes,) what the sample brings in the cell."""
        import drjit as dr

        cells = [dr.full(self.mi.UInt32, CELL, dr.width(sample.pdf))]
        found = sample.radiance(self.spectra, cells)[0].numpy()
        if "environment" in self.lights.features:
            of_dome = sample.dome & (sample.pdf > 0)
            far = self.lights.environment_radiance(self.spectra, sample.direction, cells, of_dome)[0].numpy()
            found = np.where(of_dome.numpy(), far, found)
        return np.asarray(found, dtype=float)

    def contributions(self, point: Any, normal: Any, lanes: int = 2**16, seed: int = 1) -> NDArray[np.float64]:
        """(lanes,) estimates of the irradiance; of the fluence where there is no normal."""
        sample = self.sample(point, normal, lanes, seed)
        pdf = np.asarray(sample.pdf.numpy(), dtype=float)
        cosine = np.maximum(sample.direction.numpy().T @ np.asarray(normal, dtype=float), 0.0) if np.any(normal) else 1.0
        found = pdf > 0
        of_chosen = np.where(found, self.radiance(sample) * cosine / np.where(found, pdf, 1.0), 0.0)
        return of_chosen + self.of_sun(normal, lanes, seed) if "sun" in self.lights.features else of_chosen

    def of_sun(self, normal: Any, lanes: int, seed: int = 1) -> NDArray[np.float64]:
        """(lanes,) estimates of the sun's part."""
        import drjit as dr

        mi = self.mi
        rng = np.random.default_rng(seed)
        direction, density = self.lights.sample_sun(mi.Point2f(*rng.random((2, lanes), dtype=np.float32)))
        radiance = self.lights.sun_radiance(self.spectra, [dr.full(mi.UInt32, CELL, lanes)])[0].numpy()
        pdf = np.asarray(density.numpy(), dtype=float)
        cosine = np.maximum(direction.numpy().T @ np.asarray(normal, dtype=float), 0.0) if np.any(normal) else 1.0
        return np.where(pdf > 0, radiance * cosine / np.where(pdf > 0, pdf, 1.0), 0.0)

    def irradiance(self, point: Any, normal: Any = UP, lanes: int = 2**16) -> float:
        """Mean of the estimates."""
        return float(self.contributions(point, normal, lanes).mean())
