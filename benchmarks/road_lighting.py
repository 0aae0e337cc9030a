"""Luminance, uniformity and illuminance of lit streets as EN 13201-3 measures them, beside the classes of EN 13201-2.

Run: python -m benchmarks.road_lighting [--samples 256] [--write]; takes the assets of this machine's store
(fullwell assets starter --approve --no-previews). --write fills docs/physics/street-lighting.md.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.results import DOCS, fill_page, markdown_table, number
from fullwell.core.constants import LUMINOUS_EFFICACY_LM_PER_W, NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.core.settings import load_settings
from fullwell.pipeline.assets import assets_of_settings
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.radiometry.photometry import luminance_cd_m2, luminous_efficiency
from fullwell.render import LightRequest, SamplingGoal, render_light
from fullwell.scene import BeamPattern, Camera, Film, Lens, Mesh, SceneDescription, look_at
from fullwell.scene.groups import only_groups
from fullwell.schema import RecipeBuilder, load_recipe
from fullwell.schema.assets import StoredAssetFiles
from fullwell.schema.conversion.street_lamps import INTENSITY_CD
from fullwell.traffic.headlamps import beam_intensity_cd, beam_patterns

CLASSES = {"M1": 2.0, "M2": 1.5, "M3": 1.0, "M4": 0.75, "M5": 0.5, "M6": 0.3}
"""Least mean luminance [cd m^-2] of a dry road by EN 13201-2."""

LANE_M = 3.2
_EYE_M, _BEFORE_M = 1.5, 60.0
_LARGEST_STEP_M, _ACROSS = 3.0, 3
_PITCH_RAD = 4.5e-4
_EDGE_M = 0.15
"""Beside the lane's edges: markings are not the road's surface."""


@dataclass(frozen=True, slots=True)
class RoadLight:
    """What the field between two lamps shows: mean luminance [cd m^-2], overall and lengthwise uniformity, mean horizontal
    illuminance [lx] by the lamps directly, spacing [m], height [m] of a lamp, its flux [lm], and the class of the mean."""

    luminance_cd_m2: float
    overall: float
    lengthwise: float
    illuminance_lux: float
    spacing_m: float
    height_m: float
    flux_lm: float

    @property
    def lighting_class(self) -> str:
        """The highest class whose mean luminance is reached, "below M6" for none."""
        return next((name for name, least in CLASSES.items() if self.luminance_cd_m2 >= least), "below M6")


def recipe(style: str, *, street_lamps: str = "asset", seed: int = 1, wet: bool = False) -> dict[str, Any]:
    """Return a straight street at night without traffic."""
    traffic = {
        "network": {"layout": "straight", "length_m": 240, "lane_width_m": LANE_M, "sidewalk_width_m": 3.0},
        "style": style,
        "lamps": "night",
        "street_lamps": street_lamps,
        "wet": wet,
    }
    pose = {"origin_m": [0, -LANE_M / 2, 1.5], "target_m": [60, -LANE_M / 2, 0]}
    sensors = [{"name": "main", "model": "ar0132at-rgb", "rows": 16, "cols": 16, "exposure": {"time_s": 0.01}}]
    camera = {"name": "eye", "pose": pose, "lens": {"hfov_deg": 10, "f_number": 2.0}, "sensors": sensors}
    return {
        "schema": "fullwell/recipe/v1",
        "name": "road-lighting",
        "seed": seed,
        "scene": {"traffic": traffic},
        "cameras": [camera],
        "outputs": ["image.png"],
    }


def street(document: dict[str, Any], assets: StoredAssetFiles) -> SceneDescription:
    """Return the scene of a recipe with its street lights alone."""
    scene = RecipeBuilder(load_recipe(document), assets=assets).frame(0).scene
    return only_groups(scene, frozenset({"streetlights"}))


def measure(scene: SceneDescription, *, samples: int = 256) -> RoadLight:
    """Return the light of the lane y = -LANE_M / 2, between two lamps of its own side near the middle of a street along x."""
    emitters = _emitters(scene)
    places = [lamp.corners.mean(axis=(0, 1)) for lamp in emitters]
    own = np.sort([place[0] for place in places if place[1] < 0])
    first = own[int(np.argmin(np.abs(own - (_BEFORE_M + 0.55 * (own[-1] - _BEFORE_M)))))]
    last = own[own > first + 1.0][0]
    spacing = float(last - first)
    steps = max(10, int(np.ceil(spacing / _LARGEST_STEP_M)))
    values = _field(scene, first, spacing, steps, samples)
    middle = values[:, _ACROSS // 2]
    places = first + (np.arange(steps) + 0.5) * spacing / steps
    across = -LANE_M / 2 + (np.arange(_ACROSS) - 1) * LANE_M / _ACROSS
    lux = np.mean([_illuminance_lux(emitters, (x, y, 0.0)) for x in places for y in across])
    lamp = emitters[0]
    area = float(np.linalg.norm(_areas(lamp.corners), axis=1).sum())
    return RoadLight(
        float(values.mean()),
        float(values.min() / values.mean()),
        float(middle.min() / middle.max()),
        float(lux),
        spacing,
        float(lamp.corners[..., 2].min()),
        np.pi * lamp.luminance_cd_m2 * area,
    )


def _field(scene: SceneDescription, first_m: float, spacing_m: float, steps: int, samples: int) -> NDArray[np.float64]:
    """Return (steps, across) luminances [cd m^-2] of the field's cells for an observer 60 m before it."""
    eye = np.array([first_m - _BEFORE_M, -LANE_M / 2, _EYE_M])
    middle = np.array([first_m + spacing_m / 2, -LANE_M / 2, 0.0])
    rows, cols = 28, round(LANE_M / _BEFORE_M / _PITCH_RAD) + 4
    lens = Lens("pinhole", 1.0, 4.0, np.inf, Spectrum.constant(1.0))
    camera = Camera("eye", look_at(eye, middle, np.array([0.0, 0.0, 1.0])), lens, Film(rows, cols, _PITCH_RAD))
    efficiency = luminous_efficiency()
    response = Spectrum(efficiency.wavelength_nm, efficiency.values * 555.0 / efficiency.wavelength_nm, outside="zero")
    request = LightRequest(
        grid=WavelengthGrid(400.0, 700.0, 10.0),
        responses=(response,),
        keep_bands=False,
        keep_groups=False,
        goal=SamplingGoal(noise_ratio=None, samples_per_pixel=samples),
        max_depth=5,
        seed=3,
    )
    counted = render_light(scene, camera, request).replicas.mean(axis=0)[0, 0].astype(np.float64)
    photon_j = PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M / 555.0
    luminance = counted * photon_j * LUMINOUS_EFFICACY_LM_PER_W
    x, y = ((np.arange(n) + 0.5 - n / 2) * _PITCH_RAD for n in (cols, rows))
    rays = np.stack([*np.meshgrid(x, y), np.ones((rows, cols))], axis=-1) @ camera.camera_to_world[:3, :3].T
    ground = eye + rays * (-eye[2] / np.minimum(rays[..., 2:], -1e-9))
    along = np.floor((ground[..., 0] - first_m) / spacing_m * steps).astype(np.int64)
    aside = ground[..., 1] + LANE_M
    across = np.floor(aside / LANE_M * _ACROSS).astype(np.int64)
    inside = (along >= 0) & (along < steps) & (aside > _EDGE_M) & (aside < LANE_M - _EDGE_M)
    sums, counts = np.zeros((steps, _ACROSS)), np.zeros((steps, _ACROSS))
    np.add.at(sums, (along[inside], across[inside]), luminance[inside])
    np.add.at(counts, (along[inside], across[inside]), 1)
    return sums / counts


@dataclass(frozen=True, slots=True, eq=False)
class _Lamp:
    """Triangles (n, 3, 3) in the world, their luminance, and how it is spread: a pattern in axes (3, 3)."""

    corners: NDArray[np.float64]
    luminance_cd_m2: float
    pattern: BeamPattern | None
    axes: NDArray[np.float64]


def _emitters(scene: SceneDescription) -> list[_Lamp]:
    """Return every emitting part."""
    found = []
    for item in scene.objects:
        for part in item.parts:
            if part.emission is not None and isinstance(part.geometry, Mesh):
                to_world = item.to_world @ part.to_object
                vertices = part.geometry.vertices_m @ to_world[:3, :3].T + to_world[:3, 3]
                luminance = luminance_cd_m2(part.emission.radiance)
                corners = vertices[part.geometry.faces.astype(np.int64)]
                found.append(_Lamp(corners, luminance, part.emission.pattern, to_world[:3, :3]))
    return found


def _areas(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2)


def _illuminance_lux(lamps: list[_Lamp], point: tuple[float, float, float]) -> float:
    """Return the illuminance of level ground by all lamps, triangle by triangle, whatever stands between."""
    total = 0.0
    for lamp in lamps:
        way = np.array(point) - lamp.corners.mean(axis=1)
        squared = np.sum(way**2, axis=1)
        leaving = np.maximum(np.sum(_areas(lamp.corners) * way, axis=1), 0.0)
        share: Any = 1.0
        if lamp.pattern is not None:
            x, y, z = (way @ lamp.axes).T
            share = lamp.pattern.share(np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y))))
        total += lamp.luminance_cd_m2 * float(np.sum(share * leaving * np.maximum(-way[:, 2], 0.0) / squared**2))
    return total


CASES = [("city", "asset", seed) for seed in (1, 2, 3)] + [("suburb", "asset", 1)]

PASSING = {
    "B50L": (3.43, 0.57, "at most 350"),
    "BR": (-2.5, 1.0, "at most 1 750"),
    "75R": (-1.15, -0.57, "at least 10 100"),
    "75L": (3.43, -0.57, "at most 10 600"),
    "50R": (-1.72, -0.86, "at least 10 100"),
    "50L": (3.43, -0.86, "at most 18 480"),
    "50V": (0.0, -0.86, "at least 5 100"),
    "25L": (9.0, -1.72, "at least 1 700"),
    "25R": (-9.0, -1.72, "at least 1 700"),
    "HV": (0.0, 0.0, "at most 625"),
}
DRIVING = {
    "HV": (0.0, 0.0, "40 500 to 215 000"),
    "2.6° aside": (2.6, 0.0, "at least 20 300"),
    "5.2° aside": (5.2, 0.0, "at least 5 100"),
}
"""Azimuth to the left, elevation [deg] and intensity [cd] of points of UN R112, class B, for traffic on the right."""


def headlamp_table() -> str:
    """Return what the headlamps of the traffic generator throw at the points of the regulation, with the lens's own light."""
    lens = INTENSITY_CD["headlight"]
    rows = []
    for beam, points in (("low", PASSING), ("high", DRIVING)):
        for name, (azimuth_deg, elevation_deg, limit) in points.items():
            cells = []
            for lamp in ("led", "halogen"):
                thrown = float(beam_intensity_cd(beam_patterns(lamp, beam), azimuth_deg, elevation_deg))  # type: ignore[arg-type]
                most = thrown + lens[1]
                cells += [f"{number(thrown + lens[0])} to {number(most)}", number(most / 25.0**2)]
            rows.append([beam, name, f"{0.0 - azimuth_deg:+.2f}°, {elevation_deg:+.2f}°", limit, *cells])
    header = [
        "beam",
        "point",
        "right, up",
        "UN R112 [cd]",
        "LED [cd]",
        "at 25 m, most [lx]",
        "halogen [cd]",
        "at 25 m, most [lx]",
    ]
    return markdown_table(header, rows, left=4)


def main() -> None:
    """Measure streets of both lit styles and report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    assets = assets_of_settings(load_settings())
    rows = []
    for style, lamps, seed in CASES:
        scene = street(recipe(style, street_lamps=lamps, seed=seed), assets)
        light = measure(scene, samples=arguments.samples)
        rows.append(
            [
                style,
                lamps,
                str(seed),
                number(light.height_m),
                number(light.spacing_m),
                number(light.flux_lm),
                number(light.illuminance_lux),
                number(light.luminance_cd_m2),
                light.lighting_class,
                number(light.overall),
                number(light.lengthwise),
            ]
        )
        print(rows[-1], flush=True)
    header = [
        "style",
        "street_lamps",
        "seed",
        "lamp at [m]",
        "every [m]",
        "flux [lm]",
        "E [lx]",
        "L [cd/m²]",
        "class",
        "U0",
        "Ul",
    ]
    table = markdown_table(header, rows, left=2)
    print(table)
    print(headlamp_table())
    if arguments.write:
        page = DOCS.parent / "physics" / "street-lighting.md"
        fill_page(page, "headlamps", headlamp_table())
        command = f"python -m benchmarks.road_lighting --samples {arguments.samples} --write"
        fill_page(page, "results", f"```sh\n{command}\n```\n\n{table}")


if __name__ == "__main__":
    main()
