"""Blender Cycles on the CPU as a peer: the same triangles, colours as linear sRGB, lamps as emission, the same camera.

Cycles is a development tool here, no dependency: Blender is under the GPL and large. Put it into an environment of its own,

    python3.11 -m venv ~/bpy-venv && ~/bpy-venv/bin/pip install bpy==5.0.1

and name its interpreter in FULLWELL_BENCH_BPY (default ~/bpy-venv/bin/python). Then
python -m benchmarks.cycles [--scene NAME] [--size 80x60] [--samples 256] [--seeds 3] [--reference-samples 8192]
prints for each scene the CPU-seconds that Cycles (RGB) needs over those of the path loop (31 bands, equal samples) for the same
relative error of the luminance, twice: without bias (nothing clamped, no glossy filter, caustics), and with samples clamped by
both, Cycles with its glossy filter too, as Blender sets it. Each renderer is judged by its own long run with the same settings;
what a clamped run loses is the mean of that over the mean of the one without bias. Times are those beyond a run of the fewest
samples (of Cycles the median of seven): no start-up, no planning. Below 256 samples Cycles' own start is most of its time.

What is not the same: three colours instead of spectra, so colours of light after several bounces; the sun and sky are a sampled
image and a disc; rough plastic and metals are Blender's Principled BSDF. Each renderer is compared with its own long run, so
these differences do not count as noise.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.engines import Budget, Engine, Result, Stopwatch
from benchmarks.measures import luminance, luminance_relative_mse
from benchmarks.path_engines import OwnPath, path_version, rendered, with_budget
from benchmarks.references import extend_reference, load_reference
from benchmarks.scenes import SCENES, build_frame
from fullwell.radiometry import Spectrum, illuminant, normal_reflectance, tristimulus
from fullwell.render import REPLICAS, activate
from fullwell.scene import (
    Conductor,
    ConstantEnvironment,
    Dielectric,
    Diffuse,
    DirectionalLight,
    Material,
    Mirror,
    Part,
    Principled,
    RoughPlastic,
    SceneDescription,
    SunSky,
    Texture,
)
from fullwell.scene.tessellate import mesh_of, transform_mesh
from fullwell.schema.frame import FrameDescription

__all__ = ["CyclesEngine", "export_scene", "linear_srgb"]

_CHILD = Path(__file__).with_name("cycles_child.py")
_XYZ_TO_SRGB = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)
"""IEC 61966-2-1:1999."""
_UNIT_CD_M2 = 100.0
"""Luminance of Cycles' 1.0."""
_FIREFLIES = 0.01
"""Share of the pixels that the trimmed error leaves out."""
_CLAMP = 10.0
"""Times white, where samples are clamped: Blender's own setting, of which white is 1."""
_SEEN_PERCENTILE = 99.0
"""Pixels above it (lamps seen directly) do not count."""
_PASS_SAMPLES = 64
_SUN_DIAMETER_DEG = 0.5358
_SKY_ROWS = 96


# Colours -------------------------------------------------------------------------------------------------------------


def linear_srgb(spectrum: Spectrum, *, reflectance: bool) -> list[float]:
    """Return linear sRGB: of a reflectance under D65, of a light in units of 100 cd m^-2; negative values become 0."""
    if not reflectance:
        return [max(0.0, float(value)) for value in _XYZ_TO_SRGB @ tristimulus(spectrum) / _UNIT_CD_M2]
    light = illuminant("D65")
    seen = Spectrum(light.wavelength_nm, light.values * spectrum.at(light.wavelength_nm), outside="zero", source="")
    rgb = _XYZ_TO_SRGB @ (tristimulus(seen) / tristimulus(light)[1])
    return [min(1.0, max(0.0, float(value))) for value in rgb]


def _colour(value: Spectrum | Texture) -> list[float]:
    if isinstance(value, Texture):
        raise TypeError("textures are not exported to Cycles; the benchmark scenes have none")
    return linear_srgb(value, reflectance=True)


def _under_coat(reflectance: Spectrum | Texture, index: float) -> list[float]:
    """Return what the base looks like through its coat, whose inside sends light back: rho (1 - F) / (1 - rho F).

    Blender's base colour is that after all passes. F, the diffuse reflectance from inside, is the fit of Egan and Hilgeman
    (1973).
    """
    inside = -1.4399 / index**2 + 0.7099 / index + 0.6681 + 0.0636 * index
    return [value * (1 - inside) / (1 - value * inside) for value in _colour(reflectance)]


def _metal(material: Conductor) -> list[float]:
    nm = np.arange(380.0, 781.0, 5.0)
    return linear_srgb(
        Spectrum(nm, normal_reflectance(material.eta.at(nm), material.k.at(nm)), outside="hold", source=""), reflectance=True
    )


def _index(index: float | Spectrum) -> float:
    return index if isinstance(index, float) else float(index.at(550.0))


def _material(material: Material) -> dict[str, Any]:
    """Return what the child builds: Blender's roughness is the square root of GGX alpha."""
    match material:
        case Diffuse():
            return {"kind": "diffuse", "color": _colour(material.reflectance)}
        case RoughPlastic():
            return {
                "kind": "principled",
                "color": _under_coat(material.reflectance, material.interior_index),
                "roughness": material.roughness**0.5,
                "ior": material.interior_index,
                "metallic": 0.0,
            }
        case Principled():
            return {
                "kind": "principled",
                "color": _under_coat(material.base_color, 1.5) if material.metallic < 1 else _colour(material.base_color),
                "roughness": material.roughness,
                "ior": 1.5,
                "metallic": material.metallic,
            }
        case Conductor():
            return {
                "kind": "principled",
                "color": _metal(material),
                "roughness": material.roughness**0.5,
                "ior": 1.5,
                "metallic": 1.0,
            }
        case Mirror():
            return {"kind": "principled", "color": _colour(material.reflectance), "roughness": 0.0, "ior": 1.5, "metallic": 1.0}
        case Dielectric():
            return {
                "kind": "glass",
                "ior": _index(material.interior_index) / _index(material.exterior_index),
                "roughness": material.roughness**0.5,
            }


# Scene ---------------------------------------------------------------------------------------------------------------


def export_scene(frame: FrameDescription, folder: Path) -> None:
    """Write scene.json and scene.npz: triangles joined by material, in the camera's place and the world's directions."""
    rig = frame.cameras[0]
    centre = rig.camera.camera_to_world[:3, 3]
    meshes, materials = _joined(frame.scene, centre)
    arrays: dict[str, NDArray[Any]] = {}
    for number, (vertices, faces, normals) in enumerate(meshes):
        arrays |= {
            f"v{number}": vertices.astype(np.float32),
            f"f{number}": faces.astype(np.int32),
            f"n{number}": normals.astype(np.float32),
        }
    document = {"materials": materials, "camera": _camera(frame), "lights": _lights(frame, arrays)}
    np.savez(folder / "scene.npz", **arrays)  # type: ignore[arg-type]
    (folder / "scene.json").write_text(json.dumps(document))


def _joined(scene: SceneDescription, centre: NDArray[np.float64]) -> tuple[list[Any], list[dict[str, Any]]]:
    """Return (vertices, faces, normals) of each material and the materials; parts that look the same are one."""
    groups: dict[str, list[Any]] = {}
    recentre = np.eye(4)
    recentre[:3, 3] = -centre
    for item in scene.objects:
        for part in item.parts:
            described = _material(part.material)
            if part.emission is not None:
                described = {"kind": "emission", "color": linear_srgb(part.emission.radiance, reflectance=False)}
            groups.setdefault(json.dumps(described), []).append(_triangles(part, recentre @ item.to_world @ part.to_object))
    meshes = []
    for parts in groups.values():
        starts = np.cumsum([0, *(len(part[0]) for part in parts)])
        faces = np.concatenate([part[1] + start for part, start in zip(parts, starts, strict=False)])
        meshes.append((np.concatenate([part[0] for part in parts]), faces, np.concatenate([part[2] for part in parts])))
    return meshes, [json.loads(key) for key in groups]


def _triangles(part: Part, to_world: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Return vertices, faces and vertex normals; a flat mesh has its corners taken apart."""
    mesh = transform_mesh(to_world, mesh_of(part.geometry))
    faces = mesh.faces.astype(np.int64)
    if mesh.normals is not None:
        return mesh.vertices_m, faces, mesh.normals
    corners = mesh.vertices_m[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return corners.reshape(-1, 3), np.arange(faces.size).reshape(-1, 3), np.repeat(normals, 3, axis=0)


def _camera(frame: FrameDescription) -> dict[str, Any]:
    camera = frame.cameras[0].camera
    pose = camera.camera_to_world.copy()
    pose[:3, 3] = 0.0
    pose[:3, 1:3] *= -1.0  # Blender's camera looks along -z, y up
    thin = camera.lens.kind == "thin_lens"
    return {
        "pose": pose.tolist(),
        "rows": camera.film.rows,
        "cols": camera.film.cols,
        "angle_x": float(2 * np.arctan(camera.film.cols * camera.tangent_pitch / 2)),
        "pupil_radius_m": camera.lens.pupil_diameter_m / 2 if thin else 0.0,
        "focus_m": float(min(camera.lens.focus_distance_m, 1e6)) if thin else 0.0,
        "max_depth": frame.quality.max_depth,
    }


def _lights(frame: FrameDescription, arrays: dict[str, NDArray[Any]]) -> list[dict[str, Any]]:
    lights: list[dict[str, Any]] = []
    for light in frame.scene.lights:
        match light:
            case ConstantEnvironment():
                lights.append({"kind": "constant", "color": linear_srgb(light.radiance, reflectance=False)})
            case DirectionalLight():
                colour = linear_srgb(light.irradiance, reflectance=False)
                lights.append({"kind": "sun", "direction": list(light.direction), "color": colour, "angle": 0.0})
            case SunSky():
                sky, sun = _sampled_sky(light)
                arrays["sky"] = sky
                direction = [-float(x) for x in np.asarray(light.sun_direction) / np.linalg.norm(light.sun_direction)]
                lights.append({"kind": "sky"})
                lights.append(
                    {"kind": "sun", "direction": direction, "color": sun, "angle": float(np.radians(_SUN_DIAMETER_DEG))}
                )
            case _:
                raise TypeError(f"{type(light).__name__} is not exported to Cycles; the benchmark scenes have none")
    return lights


def _sampled_sky(light: SunSky) -> tuple[NDArray[np.float32], list[float]]:
    """Return our renderer's sky as an image (rows, cols, 3) from the nadir up, and the sun's irradiance, linear sRGB."""
    x, y, z = np.asarray(light.sun_direction, dtype=np.float64) / np.linalg.norm(light.sun_direction)
    described = {"type": "sunsky", "sun_direction": [x, y, z], "turbidity": light.turbidity, "albedo": light.ground_albedo}
    rows, cols = _SKY_ROWS, 2 * _SKY_ROWS
    tilt = np.pi * ((np.arange(rows) + 0.5) / rows - 0.5)
    # Blender's equirectangular projection: the left edge is at -x of azimuth pi, azimuth falls to the right.
    azimuth = np.pi - 2 * np.pi * (np.arange(cols) + 0.5) / cols
    a, t = np.meshgrid(azimuth, tilt)
    towards = np.stack([np.cos(t) * np.cos(a), np.cos(t) * np.sin(a), np.sin(t)], axis=-1).reshape(-1, 3)
    sky = _environment_rgb(described | {"sun_scale": 0.0, "sky_scale": light.sky_weight}, towards)
    radius = np.radians(_SUN_DIAMETER_DEG / 2)
    side = np.cross([x, y, z], [0, 0, 1.0])
    side /= np.linalg.norm(side)
    other = np.cross(side, [x, y, z])
    rng = np.random.Generator(np.random.Philox(1))
    share, turn = np.sqrt(rng.random(2048)) * radius * 0.999, rng.random(2048) * 2 * np.pi
    disc = np.array([x, y, z]) + share[:, None] * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other)
    disc /= np.linalg.norm(disc, axis=1, keepdims=True)
    sun = _environment_rgb(described | {"sun_scale": light.sun_weight, "sky_scale": 0.0}, disc).mean(axis=0)
    return sky.reshape(rows, cols, 3).astype(np.float32), (sun * 2 * np.pi * (1 - np.cos(radius))).tolist()


def _environment_rgb(described: dict[str, Any], towards: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the radiance (n, 3) of an environment emitter towards directions, linear sRGB in units of 100 cd m^-2."""
    import drjit as dr  # noqa: PLC0415 - loaded with the renderer

    mi = activate()
    emitter = mi.load_dict({"type": "scene", "sky": described}).environment()
    si = dr.zeros(mi.SurfaceInteraction3f, len(towards))
    si.wi = mi.Vector3f(*(-np.ascontiguousarray(column, dtype=np.float32) for column in towards.T))
    nm = np.arange(400.0, 717.0, 10.0)
    radiance = []
    for first in range(0, len(nm), 4):
        si.wavelengths = mi.Spectrum(*(float(w) for w in nm[first : first + 4]))
        radiance += [np.broadcast_to(np.array(emitter.eval(si)[k]), len(towards)) for k in range(4)]
    weights = np.stack([tristimulus(Spectrum(nm, np.eye(len(nm))[k], outside="zero", source="")) for k in range(len(nm))])
    return np.asarray(np.maximum(np.stack(radiance, axis=1) @ weights @ _XYZ_TO_SRGB.T / _UNIT_CD_M2, 0.0))


# Engine --------------------------------------------------------------------------------------------------------------


@dataclass(eq=False)
class CyclesEngine:
    """Cycles in a child process. The time is that of a render of N samples less one of a single sample: no start-up.

    `clamp_indirect_cd_m2` limits what a bounce adds to a sample's luminance, 0 for no limit; `filter_glossy` widens highlights
    that diffuse surfaces see. Both are biased; Blender's own settings are 10 times white, and 1.
    """

    light_tree: bool = True
    clamp_indirect_cd_m2: float = 0.0
    filter_glossy: float = 0.0
    python: str = os.environ.get("FULLWELL_BENCH_BPY") or str(Path.home() / "bpy-venv" / "bin" / "python")

    @property
    def name(self) -> str:
        """Name and settings."""
        name = f"cycles {'light tree' if self.light_tree else 'no light tree'}"
        if self.clamp_indirect_cd_m2 or self.filter_glossy:
            name += f" clamp {self.clamp_indirect_cd_m2:.6g} filter {self.filter_glossy:g}"
        return name

    def render(self, frame: FrameDescription, budget: Budget) -> Result:
        """Return the luminance [cd m^-2] of the frame's first camera, (rows, cols, 1)."""
        return self.render_all(frame, [budget])[0]

    def render_all(self, frame: FrameDescription, budgets: list[Budget]) -> list[Result]:
        """Return what `render` does for each budget; the scene is loaded once."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            export_scene(frame, folder)
            task = {
                "runs": [{"samples": budget.samples_per_pixel, "seed": budget.seed % 2**31} for budget in budgets],
                "light_tree": self.light_tree,
                "clamp_indirect": self.clamp_indirect_cd_m2 / _UNIT_CD_M2,
                "filter_glossy": self.filter_glossy,
            }
            (folder / "task.json").write_text(json.dumps(task))
            watch = Stopwatch()
            command = [self.python, "-P", str(_CHILD), str(folder)]  # -P: our cycles.py must not hide Blender's own
            child = subprocess.run(command, capture_output=True, text=True, check=False)
            whole_s = watch.read()[0]
            if child.returncode:
                raise RuntimeError(f"Cycles failed: {(child.stderr or child.stdout)[-2000:]}")
            told = json.loads((folder / "told.json").read_text())
            pictures = np.load(folder / "rgb.npy").astype(np.float64)
        weights = np.linalg.inv(_XYZ_TO_SRGB)[1] * _UNIT_CD_M2
        setup_s = whole_s - sum(told["cpu_s"])
        return [
            Result(
                "luminance",
                (rgb[..., :3] @ weights)[..., None].astype(np.float32),
                cpu_s - told["one_sample_cpu_s"],
                wall_s - told["one_sample_wall_s"],
                budget.samples_per_pixel,
                setup_s,
            )
            for budget, rgb, cpu_s, wall_s in zip(budgets, pictures, told["cpu_s"], told["wall_s"], strict=True)
        ]


@dataclass(eq=False)
class ClampedPath:
    """The path loop with equal samples and 31 bands, single samples clamped to `saturation` times what saturates a pixel."""

    saturation: float

    @property
    def name(self) -> str:
        """Name and version."""
        return f"fullwell uniform clamp {self.saturation:g} path-{path_version()} {activate().variant()}"

    def render(self, frame: FrameDescription, budget: Budget) -> Result:
        """Return the bands."""
        clamped = replace(frame, quality=replace(frame.quality, max_sample_saturation=self.saturation))
        return OwnPath("uniform", skip=False, adaptive=False).render(clamped, budget)


def _luminance(result: Result, frame: FrameDescription) -> NDArray[np.float64]:
    if result.kind == "bands":
        return luminance(result.image, frame.grid)
    return np.asarray(result.image[..., 0], dtype=np.float64)


def _saturating_cd_m2(frame: FrameDescription) -> float:
    """Return the luminance that saturates a pixel of the sensor, at the exposure it chooses, for light like the picture's."""
    quick = with_budget(frame, Budget(64, seed=5))
    plan, light = rendered(quick, skip=False, seed=5)
    (_, sensors), *_ = plan.request.targets
    weights = dict(frame.group_weights)
    limits = sensors.saturation(light.channels(weights))
    seen = light.channels(weights).mean(axis=(1, 2))
    mean = float(luminance(light.radiance(weights).photons, frame.grid).mean())
    return mean * float(np.min(limits / seen))


def _efficiency(engine: Engine, frame: FrameDescription, *, samples: int, seeds: int, reference_samples: int) -> dict[str, Any]:
    """Return relMSE of the luminance after `samples`, against the engine's own long run, and their product with the time."""
    budgets = [Budget(samples, seed=1234567 + seed) for seed in range(seeds)]
    start_s = 0.0
    if isinstance(engine, CyclesEngine):  # each call starts a process and loads the scene: one for all
        long, *results = engine.render_all(frame, [Budget(reference_samples, seed=99), *budgets])
        truth, known = long.image[..., 0].astype(np.float64), long.samples
    else:
        reference = load_reference(frame, engine, _PASS_SAMPLES)
        while reference is None or reference.samples < reference_samples:
            reference = extend_reference(frame, engine, seconds=10.0, samples_per_pass=_PASS_SAMPLES)
        truth, known = luminance(reference.image, frame.grid), reference.samples
        for count in (
            samples,
            REPLICAS,
            REPLICAS,
        ):  # the first calls compile, record and load; the last tells what set-up costs
            start_s = engine.render(frame, Budget(count, seed=7654321)).cpu_s
        results = [engine.render(frame, budget) for budget in budgets]
    # The long run's error is in the difference too; both are means of samples of the same kind.
    share = 1.0 / (1.0 + samples / known)
    images = [_luminance(result, frame) for result in results]
    errors, usual = (
        [
            share * luminance_relative_mse(image, truth, clip_percentile=_SEEN_PERCENTILE, trimmed_fraction=part)
            for image in images
        ]
        for part in (0.0, _FIREFLIES)
    )
    time_s, error, trimmed = (float(np.mean(values)) for values in ([r.cpu_s - start_s for r in results], errors, usual))
    return {
        "engine": engine.name,
        "samples": samples,
        "reference_samples": known,
        "cpu_s": round(time_s, 3),
        "luminance_relmse": error,
        "relmse_of_seeds": [float(f"{value:.4g}") for value in errors],
        "cpu_s_times_relmse": time_s * error,
        "cpu_s_times_median_relmse": time_s * float(np.median(errors)),
        "trimmed_relmse": trimmed,
        "cpu_s_times_trimmed_relmse": time_s * trimmed,
        "mean_luminance": float(truth[truth <= np.percentile(truth, _SEEN_PERCENTILE)].mean()),
    }


def main() -> None:
    """Compare both engines on the scenes asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", choices=sorted(SCENES), action="append")
    parser.add_argument("--size", default="80x60")
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--reference-samples", type=int, default=8192)
    arguments = parser.parse_args()
    cols, rows = (int(text) for text in arguments.size.split("x"))
    for scene in arguments.scene or SCENES:
        with tempfile.TemporaryDirectory() as folder:
            frame = build_frame(scene, Path(folder), size=(cols, rows))
        white_cd_m2 = _saturating_cd_m2(frame)
        sides: dict[str, tuple[Engine, Engine]] = {
            "unbiased": (CyclesEngine(), OwnPath("uniform", skip=False, adaptive=False)),
            "clamped": (CyclesEngine(clamp_indirect_cd_m2=_CLAMP * white_cd_m2, filter_glossy=1.0), ClampedPath(_CLAMP)),
        }
        means: dict[str, list[float]] = {}
        for side, engines in sides.items():
            told = [
                _efficiency(
                    engine,
                    frame,
                    samples=arguments.samples,
                    seeds=arguments.seeds,
                    reference_samples=arguments.reference_samples,
                )
                for engine in engines
            ]
            ratios = {
                f"cpu_cycles_over_fullwell_at_equal_{e}": _ratio(told, e) for e in ("relmse", "median_relmse", "trimmed_relmse")
            }
            means[side] = [row["mean_luminance"] for row in told]
            kept = [mean / unbiased for mean, unbiased in zip(means[side], means["unbiased"], strict=True)]
            told[0]["light_kept"], told[1]["light_kept"] = kept
            head = {"scene": scene, "size": arguments.size, "side": side, "white_cd_m2": white_cd_m2}
            print(json.dumps(head | ratios | {"cycles": told[0], "fullwell": told[1]}), flush=True)


def _ratio(told: list[dict[str, Any]], error: str) -> float:
    """Return the quotient of time times error, first over second: the quotient of times at equal error."""
    first, second = (float(row[f"cpu_s_times_{error}"]) for row in told)
    return first / second


if __name__ == "__main__":
    main()
