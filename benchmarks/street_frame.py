"""A day frame of a city street, 640 x 480 with labels, end to end: processor time of each stage.

Run: python -m benchmarks.street_frame [--spp 64] [--write]; takes the assets of this machine's store
(fullwell assets starter --approve --no-previews). --write fills docs/benchmarks/streets.md.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.results import DOCS, fill_page, markdown_table, number
from benchmarks.stages import StageTimes, stage_times
from fullwell.core.settings import load_settings
from fullwell.pipeline import StageStore, run_frame
from fullwell.pipeline.assets import assets_of_settings
from fullwell.schema import KeptScene, RecipeBuilder, load_recipe
from fullwell.schema.assets import pin_assets
from fullwell.storage import LocalStore

EXAMPLE = Path(__file__).parents[1] / "examples/10_street_by_day.yaml"
OUTPUTS = ["image.png", "raw.npz", "depth.exr", "instances.png", "semantic.png", "labels.json", "driving.json"]
ORDER = (
    "assemble",
    "load",
    "plan",
    "render: surfaces",
    "render: acceleration",
    "render: lights, materials",
    "render: rays",
    "render: the rest",
    "optics",
    "sensor",
    "isp",
    "labels",
)


def recipe(samples_per_pixel: int, seed: int) -> dict[str, Any]:
    """Return example 10 with a sensor of 640 x 480 pixels and that many rays for each pixel at most."""
    plain = load_recipe(EXAMPLE).plain()
    plain["seed"] = seed
    sensor = plain["cameras"][0]["sensors"][0]
    sensor |= {"rows": 480, "cols": 640}
    plain["outputs"] = OUTPUTS
    plain["quality"] |= {"noise_ratio": 1.0, "max_samples_per_pixel": samples_per_pixel}
    return plain


@contextmanager
def conversion_times(times: StageTimes) -> Iterator[None]:
    """Time making the street, and turning its assets into objects, within the block."""
    from fullwell.schema import building  # noqa: PLC0415
    from fullwell.schema.conversion import scenes, traffic  # noqa: PLC0415

    places = [
        (module, name, stage)
        for name, stage in (("street_view", "assemble"), ("street_objects", "load"))
        for module in (building, scenes, traffic)
        if hasattr(module, name)
    ]
    before = [getattr(module, name) for module, name, _ in places]
    try:
        for (module, name, stage), function in zip(places, before, strict=True):
            setattr(module, name, times.timed(stage, function))
        yield
    finally:
        for (module, name, _), function in zip(places, before, strict=True):
            setattr(module, name, function)


def by_stage(manifest: dict[str, Any], times: StageTimes, whole_cpu_s: float) -> dict[str, float]:
    """Return CPU-seconds by stage; what no stage names is "the rest"."""
    inner = times.cpu_s
    found = {name: inner.get(name, 0.0) for name in ("assemble", "load", "plan")}
    found["render: surfaces"] = inner.get("collect surfaces", 0.0)
    found["render: acceleration"] = inner.get("acceleration", 0.0)
    rendered = sum(entry["cpu_s"] for entry in manifest["run"]["stages"] if entry["stage"].endswith(": render"))
    found["render: lights, materials"] = inner.get("lights", 0.0) + inner.get("materials", 0.0)
    found["render: rays"] = inner.get("launches", 0.0)
    found["render: the rest"] = rendered - sum(time for name, time in found.items() if name.startswith("render: "))
    for entry in manifest["run"]["stages"]:
        last = entry["stage"].rpartition(": ")[2]
        name = "encode" if entry["stage"].startswith("encode") else last
        if name != "render":
            found[name] = found.get(name, 0.0) + entry["cpu_s"]
    found["the rest"] = whole_cpu_s - sum(found.values())
    return found


def frame_of(
    folder: Path, arguments: argparse.Namespace, kept: KeptScene, *, contrast: float, prefix: str
) -> tuple[RecipeBuilder, dict[str, Any]]:
    """Make the frame with another contrast of its picture, from a recipe of its own; light goes to the folder's stage cache."""
    plain = recipe(arguments.spp, arguments.seed)
    plain["cameras"][0]["sensors"][0]["isp"] = {"tone": {"contrast": contrast}}
    assets, store = assets_of_settings(load_settings()), LocalStore(folder)
    document = pin_assets(load_recipe(plain), assets)
    builder = RecipeBuilder(document, base_dir=EXAMPLE.parent, assets=assets, kept=kept)
    stages = StageStore(store, max_bytes=1 << 32)
    return builder, run_frame(document, 0, store, prefix, builder=builder, stages=stages)


def again_cpu_s(folder: Path, arguments: argparse.Namespace, kept: KeptScene, *, contrast: float) -> float:
    """Return the processor time of a further recipe with the same light."""
    started = time.process_time()
    frame_of(folder, arguments, kept, contrast=contrast, prefix=f"again {contrast}")
    return time.process_time() - started


def in_another_process_cpu_s(folder: Path, arguments: argparse.Namespace) -> float:
    """Return the processor time of a new process that makes such a frame."""
    options = ["--spp", str(arguments.spp), "--seed", str(arguments.seed), "--again", str(folder)]
    command = [sys.executable, "-m", "benchmarks.street_frame", *options]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()[-1])


def main() -> None:
    """Make one frame and report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spp", type=int, default=64, help="rays for each pixel at most (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=10)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--again", metavar="FOLDER", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.again:
        frame_of(Path(arguments.again), arguments, KeptScene(), contrast=1.05, prefix="other process")
        print(time.process_time())
        return
    kept = KeptScene()
    with tempfile.TemporaryDirectory() as folder:
        with stage_times() as times, conversion_times(times):
            wall, cpu = time.perf_counter(), time.process_time()
            builder, manifest = frame_of(Path(folder), arguments, kept, contrast=1.0, prefix="frame")
            wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        again = min(again_cpu_s(Path(folder), arguments, kept, contrast=1.0 + number / 100) for number in (1, 2, 3))
        elsewhere = in_another_process_cpu_s(Path(folder), arguments)
    found = by_stage(manifest, times, cpu)
    named = [name for name in ORDER if name in found]
    rows = [[name, number(found[name])] for name in (*named, *(name for name in found if name not in named))]
    rows.append(["all", number(cpu)])
    objects, triangles = _size(builder)
    table = markdown_table(["Stage", "CPU-s"], rows)
    peak_gib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    note = (
        f"{objects} objects, {triangles / 1e6:.1f} million triangles, at most {arguments.spp} rays for each pixel; "
        f"{number(wall)} s by the clock, {number(peak_gib)} GiB at most."
    )
    reused = (
        f"Another recipe with the same light, of which only the picture's contrast differs: {number(again)} CPU-s in the same "
        f"process ({again / cpu:.1%} of the frame), {number(elsewhere)} CPU-s in a new one ({elsewhere / cpu:.1%}), starting "
        "Python, reading the assets and making the street included."
    )
    print(note, table, reused, sep="\n\n")
    if arguments.write:
        command = f"```sh\npython -m benchmarks.street_frame --spp {arguments.spp} --write\n```"
        fill_page(DOCS / "streets.md", "frame", f"{command}\n\n{note}\n\n{table}\n\n{reused}")


def _size(builder: RecipeBuilder) -> tuple[int, int]:
    scene = builder.frame(0).scene
    triangles = sum(len(getattr(part.geometry, "faces", ())) for item in scene.objects for part in item.parts)
    return len(scene.objects), triangles


if __name__ == "__main__":
    main()
