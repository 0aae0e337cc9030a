"""Ingestion: time for every sample, and what becomes of damaged files.

Run: python -m benchmarks.ingestion [--samples DIR] [--mutations 300] [--seed 1] [--write]
Prints two tables; --write puts them into docs/assets-ingestion.md.
"""

from __future__ import annotations

import argparse
import os
import shutil
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.mutations import KINDS, MutationGround
from benchmarks.results import DOCS, fill_page, markdown_table
from fullwell.assets import packaged_model, packaged_model_names
from fullwell.assets.ingest import IngestError, IngestLimits, IngestOptions, IngestProcess, prepare_file, read_level
from fullwell.assets.model import LoadedModel, LoadedPart, ModelError
from fullwell.assets.records import PreparedAsset

__all__ = ["SAMPLES", "Outcome", "Sample", "damaged_outcomes", "make_samples", "packaged_samples", "shared_samples"]

SAMPLES = Path(os.environ.get("FULLWELL_SAMPLES_DIR", Path(__file__).parents[2] / "shared" / "samples"))
PAGE = DOCS.parent / "assets-ingestion.md"

_CLASS_WORDS = {
    "building": "building", "tree": "tree", "grass": "grass", "road": "road", "pavement": "road", "motorcycle": "motorcycle",
    "truckflat": "lorry", "truck": "van", "ambulance": "emergency_vehicle", "sedan": "car", "van": "van", "minibus": "van",
    "car-": "car", "human": "pedestrian", "tram": "tram", "tl": "traffic_light",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Sample:
    """A model to take in: where it lies, and what a person would say of it."""

    folder: Path
    main: str

    @property
    def name(self) -> str:
        return Path(self.main).stem

    @property
    def options(self) -> IngestOptions:
        name = self.name.lower()
        kind = next((kind for word, kind in _CLASS_WORDS.items() if word in name), "other")
        return IngestOptions(id=name.replace("_", "-"), title=self.name, asset_class=kind)


def shared_samples(folder: Path) -> list[Sample]:
    """Return every model of the samples folder; of the USD kit the whole vehicles and the wheels."""
    models = [Sample(file.parent, file.name) for file in sorted(folder.glob("kenney_*/*.glb"))]
    kit = folder / "usd_mini_car_kit"
    layers = sorted(kit.rglob("*FullAsset.usda")) + [kit / "assets" / "wheels" / "wheelVariants.usda"]
    return models + [Sample(kit, file.relative_to(kit).as_posix()) for file in layers]


def packaged_samples() -> list[Sample]:
    """Return the models that the eclipse-sumo package ships; none where it is not installed."""
    files = [packaged_model(name).path for name in packaged_model_names()]
    return [Sample(file.parent, file.name) for file in files]


# Times ---------------------------------------------------------------------------------------------------------------


def _timed(process: IngestProcess, sample: Sample) -> tuple[float, PreparedAsset]:
    started = time.perf_counter()
    prepared = process.prepare(sample.folder, sample.main, sample.options)
    return time.perf_counter() - started, prepared


def _time_table(samples: list[Sample]) -> str:
    rows = []
    with IngestProcess() as process:
        _timed(process, samples[0])  # the process and its libraries are there from now on
        _timed(process, samples[-1])
        for sample in samples:
            seconds, prepared = _timed(process, sample)
            manifest = prepared.manifest
            states = Counter(check.state for check in manifest.checks)
            levels = " / ".join(str(level.triangles) for level in manifest.levels)
            error = f"{max(level.error_m for level in manifest.levels):.2g}"
            size = " x ".join(f"{side:.3g}" for side in manifest.size_m)
            found = ", ".join(f"{states[state]} {state}" for state in ("mended", "warning", "decide") if states[state])
            rows.append([sample.name, manifest.asset_class, f"{seconds:.2f}", size, levels, error, found])
    return markdown_table(["model", "class", "time [s]", "size [m]", "triangles", "error [m]", "checks"], rows)


# Figure --------------------------------------------------------------------------------------------------------------


def _figure(folder: Path, file: Path) -> None:
    """Draw what became of a few samples: finest level above, coarser below, all in the pose of the store."""
    import matplotlib as mpl  # noqa: PLC0415

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    wanted = (
        "vehicle-motorcycle",
        "sedanFullAsset",
        "ambulanceFullAsset",
        "building-small-c",
        "humanResting",
        "car-normal-citrus",
    )
    samples = [s for s in shared_samples(folder) + packaged_samples() if s.name in wanted]
    figure, axes = plt.subplots(2, len(samples), figsize=(3 * len(samples), 5.6), subplot_kw={"projection": "3d"})
    for column, sample in enumerate(samples):
        prepared = prepare_file(sample.folder, sample.main, sample.options, isolated=True)
        levels = prepared.manifest.levels
        for row, level in enumerate((levels[0], levels[-1])):
            axis = axes[row][column]
            _draw(axis, read_level(prepared.blobs[level.sha256]))
            axis.set_title(f"{sample.name}\n{level.triangles} triangles, {100 * level.error_m:.1f} cm", fontsize=9)
    figure.tight_layout()
    figure.savefig(file, dpi=80)


def _draw(axis: Any, model: LoadedModel) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # noqa: PLC0415

    triangles = np.concatenate([part.vertices_m[part.faces] for part in model.parts])
    colours = np.concatenate([_face_colours(part) for part in model.parts])
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    shade = 0.55 + 0.45 * np.clip(np.abs(normal @ np.array([0.6, 0.3, 0.75])), 0, 1)
    axis.add_collection3d(Poly3DCollection(triangles, facecolors=np.clip(colours * shade[:, None], 0, 1)))
    half = float((model.bounds_m[1] - model.bounds_m[0]).max()) / 2
    middle = model.bounds_m.mean(axis=0)
    for name, centre in zip("xyz", middle, strict=True):
        getattr(axis, f"set_{name}lim")(centre - 0.72 * half, centre + 0.72 * half)
    axis.set_box_aspect((1, 1, 1))
    axis.view_init(elev=22, azim=-38)
    axis.set_axis_off()


def _face_colours(part: LoadedPart) -> NDArray[np.float64]:
    if part.base_color_texture is None or part.uv is None:
        return np.tile(part.base_color_srgb, (len(part.faces), 1))
    rows, cols = part.base_color_texture.shape[:2]
    u, v = part.uv[part.faces].mean(axis=1).T
    return part.base_color_texture[((1 - v) * rows).astype(int) % rows, (u * cols).astype(int) % cols] / 255.0


# Damaged files -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one damaged file: "ingested", or the cause of its error; the message; how long it took."""

    damaged: str
    kind: str
    result: str
    message: str
    seconds: float


def make_samples(folder: Path, out: Path) -> list[tuple[Path, list[str]]]:
    """Write samples in the other formats, made from the vehicles: OBJ with MTL, glTF, PLY, STL, binary USD, USDZ, zip.

    Returns (folder, models in it) pairs.
    """
    import trimesh  # noqa: PLC0415
    from pxr import Usd, UsdUtils  # noqa: PLC0415

    truck = trimesh.load_scene(folder / "kenney_vehicles" / "vehicle-truck-red.glb")
    sedan = folder / "usd_mini_car_kit" / "assets" / "vehicles" / "sedan" / "asset" / "sedanFullAsset.usda"
    names = ("obj", "gltf", "ply", "stl", "usdc", "usdz", "zip")
    places = {name: out / name for name in names}
    for place in places.values():
        place.mkdir(parents=True)
    for suffix in ("obj", "gltf", "ply", "stl"):
        truck.export(places[suffix] / f"truck.{suffix}")
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # the packager looks for its own renamed files on the way
    layer = Usd.Stage.Open(str(sedan)).Flatten()
    UsdUtils.ModifyAssetPaths(layer, lambda path: Path(path).name)
    layer.Export(str(places["usdc"] / "sedan.usdc"))
    for texture in (folder / "usd_mini_car_kit" / "textures").rglob("*.jpg"):
        shutil.copy(texture, places["usdc"])
    UsdUtils.CreateNewUsdzPackage(str(places["usdc"] / "sedan.usdc"), str(places["usdz"] / "sedan.usdz"))
    quiet.TakeUncoalescedDiagnostics()
    shutil.make_archive(str(places["zip"] / "truck"), "zip", places["obj"])
    return [(places[name], [("sedan." if name.startswith("usd") else "truck.") + name]) for name in names]


@contextmanager
def _ground(folder: Path) -> Iterator[MutationGround]:
    samples = [
        (folder / "kenney_city", [f.name for f in sorted((folder / "kenney_city").glob("*.glb"))]),
        (folder / "kenney_vehicles", [f.name for f in sorted((folder / "kenney_vehicles").glob("*.glb"))]),
        (
            folder / "usd_mini_car_kit",
            [sample.main for sample in shared_samples(folder) if sample.folder.name == "usd_mini_car_kit"],
        ),
    ]
    with tempfile.TemporaryDirectory(prefix="fullwell-mutations-") as scratch:
        samples += make_samples(folder, Path(scratch) / "made")
        yield MutationGround(samples, Path(scratch) / "damaged")


def damaged_outcomes(folder: Path, count: int, seed: int, process: IngestProcess) -> Iterator[Outcome]:
    """Take in `count` damaged copies of the samples in `folder`, and yield what becomes of each."""
    with _ground(folder) as ground:
        for mutation in ground.mutations(count, seed):
            started = time.perf_counter()
            options = Sample(mutation.folder, mutation.main).options
            try:
                process.prepare(mutation.folder, mutation.main, options)
                result, message = "ingested", ""
            except (IngestError, ModelError) as error:
                result, message = getattr(error, "cause", "refused"), str(error)
            yield Outcome(mutation.damaged, mutation.kind, result, message, time.perf_counter() - started)


def _outcome_table(outcomes: list[Outcome]) -> str:
    results = sorted({outcome.result for outcome in outcomes}, key=lambda r: (r != "refused", r != "ingested", r))
    counts = Counter((outcome.kind, outcome.result) for outcome in outcomes)
    rows = [[kind, *(str(counts[kind, result]) for result in results)] for kind in KINDS]
    totals = Counter(outcome.result for outcome in outcomes)
    rows.append(["all", *(str(totals[result]) for result in results)])
    return markdown_table(["damage", *results], rows)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=Path, default=SAMPLES)
    parser.add_argument("--mutations", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    times = _time_table(shared_samples(options.samples) + packaged_samples())
    print(times, flush=True)
    with IngestProcess(IngestLimits(wall_s=60.0, cpu_s=60.0)) as process:
        outcomes = []
        for outcome in damaged_outcomes(options.samples, options.mutations, options.seed, process):
            outcomes.append(outcome)
            if outcome.result not in ("refused", "ingested"):
                print(f"{outcome.damaged}: {outcome.kind}: {outcome.result}: {outcome.message}", flush=True)
    table = _outcome_table(outcomes) if outcomes else ""
    slowest = max((outcome.seconds for outcome in outcomes), default=0.0)
    note = f"The slowest took {slowest:.1f} s." if outcomes else ""
    print(f"{table}\n\n{note}")
    if options.write:
        _figure(options.samples, PAGE.parent / "images" / "ingestion_levels.png")
        fill_page(PAGE, "times", times)
        if outcomes:
            fill_page(PAGE, "outcomes", f"{table}\n\n{note}")


if __name__ == "__main__":
    main()
