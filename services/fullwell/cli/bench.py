"""`fullwell bench`: how fast this installation renders, on two scenes that come with it."""

from __future__ import annotations

import gc
import importlib.util
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fullwell.core.errors import FieldError, NotFoundError, unknown_name_message

if TYPE_CHECKING:
    from fullwell.pipeline import FrameProgress
    from fullwell.render import RenderedLight
    from fullwell.schema.frame import FrameDescription

__all__ = ["BenchReport", "SceneReport", "bench_scenes", "register"]

NOISE_RATIO = 0.5
_SAMPLES = 64
_MOST_SAMPLES = 1 << 18
_MOST_PX = 1 << 22

Recipe = dict[str, Any]


def register(app: typer.Typer) -> None:
    """Add the command of this module to `app`."""
    app.command()(bench)


def bench(
    scenes: Annotated[str | None, typer.Option(help="Scenes, separated by commas; default: all.", metavar="NAMES")] = None,
    size: Annotated[str, typer.Option(help="Columns x rows.", metavar="SIZE")] = "160x120",
    minutes: Annotated[float, typer.Option(help="Wall time of all of it, about.", min=0.05)] = 10.0,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the report there as JSON; with --full, the folder of results.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Report as JSON.")] = False,
    full: Annotated[
        bool, typer.Option("--full", help="Run the benchmarks of the source checkout instead; they fill docs/benchmarks.")
    ] = False,
) -> None:
    """Measure throughput, compiled kernels, the cost of a given accuracy and the overhead of a frame, in CPU-seconds."""
    if full:
        raise typer.Exit(_run_full(scenes, size, minutes, output))
    from fullwell.core.files import write_atomically

    report = bench_scenes(_names(scenes), _size(size), seconds=60 * minutes, told=None if as_json else _tell)
    text = json.dumps(asdict(report), indent=2)
    if output is not None:
        output.parent.mkdir(parents=True, exist_ok=True)
        with write_atomically(output) as partial:
            partial.write_text(text + "\n", encoding="utf-8")
    if as_json:
        print(text)
    else:
        _print(report)


def _tell(message: str) -> None:
    print(message, file=sys.stderr, flush=True)


def _names(scenes: str | None) -> list[str]:
    known = list(_SCENES)
    names = known if scenes is None else [name.strip() for name in scenes.split(",") if name.strip()]
    for name in names:
        if name not in known:
            raise FieldError(unknown_name_message("scene", name, known), path="--scenes", value=name)
    return names


def _size(text: str) -> tuple[int, int]:
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.strip().isdigit() for part in parts):
        raise FieldError(f"--size is {text!r}; must be columns x rows, such as 160x120.", path="--size", value=text)
    cols, rows = (int(part) for part in parts)
    if not (cols >= 8 and rows >= 8 and cols * rows <= _MOST_PX):
        message = f"--size is {text!r}; must be at least 8x8 and at most {_MOST_PX} pixels."
        raise FieldError(message, path="--size", value=text)
    return cols, rows


# The report ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SceneReport:
    """What was measured on one scene. Times are CPU-seconds of all threads unless they say otherwise.

    Attributes
    ----------
    scene, size_px, variant
        What was rendered, (columns, rows), and the renderer's variant.
    build_cpu_s, first_cpu_s
        Of resolving the recipe, and of the first rendering, with everything that is compiled or recorded once.
    kernels_compiled, kernels_compiled_later
        During the first three renderings and a frame, and during all later ones, which should compile none; None where
        nothing is compiled.
    paths, paths_cpu_s, mega_paths_per_cpu_s
        Of a rendering with equal samples, set-up included.
    noise_ratio, target_cpu_s, target_wall_s, target_samples
        Cost of sampling until the error is that share of the sensor's noise: samples per pixel on average.
    target_met, reached_noise_ratio
        Whether time sufficed, and the predicted ratio of the worst tile.
    frame_cpu_s, frame_shares
        A whole frame with picture and labels at equal samples, and the parts of it, which add up to 1.
    """

    scene: str
    size_px: tuple[int, int]
    variant: str
    build_cpu_s: float
    first_cpu_s: float
    kernels_compiled: int | None
    kernels_compiled_later: int | None
    paths: int
    paths_cpu_s: float
    mega_paths_per_cpu_s: float
    noise_ratio: float
    target_cpu_s: float
    target_wall_s: float
    target_samples: float
    target_met: bool
    reached_noise_ratio: float
    frame_cpu_s: float
    frame_shares: dict[str, float]


@dataclass(frozen=True, slots=True)
class BenchReport:
    """All scenes, with the versions that were measured."""

    versions: dict[str, str]
    scenes: list[SceneReport] = field(default_factory=list)


def bench_scenes(
    names: list[str], size: tuple[int, int], *, seconds: float, told: Callable[[str], None] | None = None
) -> BenchReport:
    """Measure the built-in scenes of those names at (columns, rows), in about `seconds` of wall time.

    `told` is called with a line before each scene.
    """
    import importlib.metadata

    versions = {name: importlib.metadata.version(name) for name in ("fullwell", "mitsuba", "drjit")}
    report = BenchReport(versions)
    until = time.monotonic() + seconds
    for number, name in enumerate(names):
        if told is not None:
            told(f"{name}, {size[0]} x {size[1]} ...")
        share_s = (until - time.monotonic()) / (len(names) - number)
        report.scenes.append(_scene(name, size, max(1.0, share_s)))
    return report


def _scene(name: str, size: tuple[int, int], seconds: float) -> SceneReport:
    from fullwell.schema import build_frame, load_recipe

    ended = time.monotonic() + seconds
    cpu = time.process_time()
    frame = build_frame(load_recipe(_SCENES[name](size)))
    build_s = time.process_time() - cpu
    equal = replace(frame, quality=replace(frame.quality, noise_ratio=None, samples_per_pixel=_SAMPLES))
    with _kernels_compiled() as first_kernels:
        first = _cost(lambda: _light(equal, seed=0))
        for seed in (1, 2):  # the first two calls record what later ones replay
            _light(equal, seed=seed)
        _frame_shares(equal)  # what a process reads once, and the labels' own kernels
    with _kernels_compiled() as later_kernels:
        runs = [_cost(lambda: _light(equal, seed=3)), _cost(lambda: _light(equal, seed=4))]
        paths_s, light = min(run[0] for run in runs), runs[0][2]
        frame_s, shares = _frame_shares(equal)
        quality = replace(
            frame.quality,
            noise_ratio=NOISE_RATIO,
            samples_per_pixel=None,
            max_samples_per_pixel=_MOST_SAMPLES,
            time_limit_s=max(0.5, (ended - time.monotonic()) / 2),  # a round that has begun may take as long again
        )
        target_s, target_wall_s, reached = _cost(lambda: _light(replace(frame, quality=quality), seed=5))
    statistics = reached.statistics
    paths = round(light.statistics.samples_per_pixel * size[0] * size[1])
    return SceneReport(
        scene=name,
        size_px=size,
        variant=statistics.variant,
        build_cpu_s=build_s,
        first_cpu_s=first[0],
        kernels_compiled=first_kernels.count,
        kernels_compiled_later=later_kernels.count,
        paths=paths,
        paths_cpu_s=paths_s,
        mega_paths_per_cpu_s=paths / paths_s / 1e6,
        noise_ratio=NOISE_RATIO,
        target_cpu_s=target_s,
        target_wall_s=target_wall_s,
        target_samples=statistics.samples_per_pixel,
        target_met=statistics.unmet_tiles == 0,
        reached_noise_ratio=statistics.noise_ratio_max,
        frame_cpu_s=frame_s,
        frame_shares=shares,
    )


# Measuring -----------------------------------------------------------------------------------------------------------


def _cost(render: Callable[[], RenderedLight]) -> tuple[float, float, RenderedLight]:
    """Return (CPU-seconds, seconds, light); garbage is collected before, not within."""
    with _no_collection():
        cpu, wall = time.process_time(), time.perf_counter()
        light = render()
        return time.process_time() - cpu, time.perf_counter() - wall, light


@contextmanager
def _no_collection() -> Iterator[None]:
    gc.collect()
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _light(frame: FrameDescription, *, seed: int) -> RenderedLight:
    from fullwell.pipeline.lighting import plan_light
    from fullwell.render import render_light

    planned = plan_light(frame, frame.cameras[0], 0)
    return render_light(planned.scene, frame.cameras[0].camera, replace(planned.request, seed=seed))


def _frame_shares(frame: FrameDescription) -> tuple[float, dict[str, float]]:
    """Return the CPU-seconds of a whole frame, and the shares of rendering proper and of all else that is known apart."""
    from fullwell.pipeline import render_frame
    from fullwell.storage import LocalStore

    marks: list[tuple[str, float, float]] = []

    def mark(progress: FrameProgress) -> None:
        marks.append((progress.stage, progress.fraction, time.process_time()))

    with tempfile.TemporaryDirectory() as folder, _no_collection():
        started = time.process_time()
        manifest = render_frame(frame, LocalStore(Path(folder)), "frame", progress=mark)
        whole = time.process_time() - started
    rendering = [cpu for stage, _, cpu in marks if stage == "render"]
    # Told once before the renderer is called, once when the scene is loaded, and then after each launch.
    tracing = rendering[-1] - rendering[1] if len(rendering) > 2 else 0.0
    parts = {"plan": rendering[0] - started, "tracing": tracing}
    for stage in manifest["run"]["stages"]:
        kind = "encode" if stage["stage"].startswith("encode") else stage["stage"].rpartition(": ")[2]
        parts[kind] = parts.get(kind, 0.0) + stage["cpu_s"]
    parts["set-up"] = max(0.0, parts.pop("render", 0.0) - tracing)
    parts["other"] = max(0.0, whole - sum(parts.values()))
    total = sum(parts.values())
    return whole, {name: value / total for name, value in sorted(parts.items(), key=lambda pair: -pair[1])}


@dataclass(slots=True)
class _Compiled:
    """Kernels compiled in a block; None where none are counted."""

    count: int | None = None


@contextmanager
def _kernels_compiled() -> Iterator[_Compiled]:
    from fullwell.render import activate

    compiled = _Compiled()
    if not str(activate().variant()).startswith("llvm"):
        yield compiled
        return
    drjit: Any = sys.modules["drjit"]  # the renderer has loaded it; nothing else here does
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
        drjit.kernel_history_clear()
        try:
            yield compiled
        finally:
            history = drjit.kernel_history([drjit.KernelType.JIT])
            compiled.count = sum(not kernel["cache_hit"] for kernel in history)


# The scenes ----------------------------------------------------------------------------------------------------------


def _cornell_box(size: tuple[int, int]) -> Recipe:
    """Return a closed room with two blocks and one lamp: mostly light that was reflected several times."""

    def wall(name: str, material: str, corners_m: list[list[float]]) -> Recipe:
        return {"id": name, "class": "room", "geometry": {"kind": "quad", "corners_m": corners_m}, "material": material}

    def block(name: str, height_m: float, angle_deg: float, centre_m: list[float]) -> Recipe:
        turn = {"rotate_deg": {"axis": "z", "angle_deg": angle_deg}, "translate_m": centre_m}
        shape = {"kind": "cube", "size_m": [0.6, 0.6, height_m]}
        return {"id": name, "class": "block", "geometry": shape, "material": "white", "transform": turn}

    objects = [
        wall("floor", "white", [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]]),
        wall("ceiling", "white", [[-1, 1, 1], [1, 1, 1], [1, -1, 1], [-1, -1, 1]]),
        wall("back", "white", [[-1, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]]),
        wall("left", "red", [[-1, -1, -1], [-1, 1, -1], [-1, 1, 1], [-1, -1, 1]]),
        wall("right", "green", [[1, 1, -1], [1, -1, -1], [1, -1, 1], [1, 1, 1]]),
        block("short_block", 0.6, -17, [0.335, -0.38, -0.7]),
        block("tall_block", 1.2, 18.25, [-0.33, 0.28, -0.4]),
    ]
    lamp = _lamp("lamp", (0.0, -0.01, 0.99), 0.5, 1500.0, "blackbody:3000K")
    scene = {"materials": _MATERIALS, "objects": objects, "lights": [lamp]}
    return _recipe("bench-cornell-box", scene, {"origin_m": [0, -3.9, 0], "target_m": [0, 0, 0]}, size)


def _many_lamps(size: tuple[int, int]) -> Recipe:
    """Return a hall with 30 glossy and matt balls under 196 lamps of three kinds."""
    lamps, side = [], 14
    for number in range(side * side):
        row, column = divmod(number, side)
        place = (1.4 * (column - (side - 1) / 2), 1.4 * row, 3.0 + 0.3 * math.sin(number))
        lamps.append(_lamp(f"lamp_{number}", place, 0.08, 40_000.0, ("A", "D65", "LED-B3")[number % 3]))
    floor = [[-30, -10, 0], [30, -10, 0], [30, 50, 0], [-30, 50, 0]]
    objects: list[Recipe] = [
        {"id": "floor", "class": "room", "geometry": {"kind": "quad", "corners_m": floor}, "material": "white"}
    ]
    for number in range(30):
        row, column = divmod(number, 6)
        ball = {"kind": "sphere", "radius_m": 0.7}
        at: Recipe = {"translate_m": [2.6 * (column - 2.5) + 0.4 * (row % 2), 3.0 * row, 0.7]}
        material = ("glossy", "red", "green", "white")[number % 4]
        objects.append({"id": f"ball_{number}", "class": "ball", "geometry": ball, "material": material, "transform": at})
    scene = {"materials": _MATERIALS, "objects": objects, "lights": lamps}
    return _recipe("bench-many-lamps", scene, {"origin_m": [0, -9.0, 5.0], "target_m": [0, 5.0, 0.0]}, size)


_MATERIALS: Recipe = {
    "white": {"kind": "diffuse", "reflectance": 0.75},
    "red": {"kind": "diffuse", "reflectance": "colorchecker:red"},
    "green": {"kind": "diffuse", "reflectance": "colorchecker:green"},
    "glossy": {"kind": "rough_plastic", "reflectance": "colorchecker:blue", "roughness": 0.15},
}


def _lamp(name: str, place_m: tuple[float, float, float], side_m: float, luminance_cd_m2: float, spd: str) -> Recipe:
    """Return a square that shines downwards."""
    return {
        "name": name,
        "kind": "area",
        "class": "lamp",
        "geometry": {"kind": "rectangle", "size_m": [side_m, side_m]},
        "transform": {
            "rotate_deg": {"axis": "x", "angle_deg": 180},
            "translate_m": [round(coordinate, 4) for coordinate in place_m],
        },
        "luminance_cd_m2": luminance_cd_m2,
        "spd": spd,
    }


def _recipe(name: str, scene: Recipe, pose: Recipe, size: tuple[int, int]) -> Recipe:
    cols, rows = size
    exposure = {"auto": {"method": "percentile", "percentile": 97, "level": 0.7}}
    sensor = {"name": "main", "model": "imx363", "rows": rows, "cols": cols, "exposure": exposure}
    lens = {"kind": "pinhole", "hfov_deg": 50, "f_number": 2}
    return {
        "schema": "fullwell/recipe/v1",
        "name": name,
        "seed": 1,
        "scene": scene,
        "cameras": [{"name": "main", "pose": pose, "lens": lens, "sensors": [sensor]}],
        "outputs": ["image.png", "raw.npz", "depth.exr", "instances.png", "semantic.png", "labels.json"],
        "quality": {"noise_ratio": NOISE_RATIO, "max_depth": 8},
    }


_SCENES: dict[str, Callable[[tuple[int, int]], Recipe]] = {"cornell_box": _cornell_box, "many_lamps": _many_lamps}


# The checkout's benchmarks -------------------------------------------------------------------------------------------


def _checkout() -> Path | None:
    """Return the folder that holds `benchmarks/`, or None where this is no source checkout."""
    found = importlib.util.find_spec("benchmarks")
    here = [Path(found.origin).parents[1]] if found is not None and found.origin else []
    for folder in (*here, Path(__file__).resolve().parents[3]):
        if (folder / "benchmarks" / "error_against_time.py").is_file():
            return folder
    return None


def _run_full(scenes: str | None, size: str, minutes: float, output: Path | None) -> int:
    """Run the checkout's benchmark of error against time, and return its exit code."""
    root = _checkout()
    if root is None:
        raise NotFoundError("--full needs a source checkout: benchmarks/ is not part of the package. Leave --full out.")
    cols, rows = _size(size)
    command = [sys.executable, "-m", "benchmarks.error_against_time", "--size", f"{cols}x{rows}", "--minutes", f"{minutes:g}"]
    for name in scenes.split(",") if scenes else []:
        command += ["--scene", name.strip()]
    if output is not None:
        command += ["--results", str(output.resolve())]
    return subprocess.run(command, cwd=root, check=False).returncode


# The table -----------------------------------------------------------------------------------------------------------


def _print(report: BenchReport) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    versions = ", ".join(f"{name} {version}" for name, version in report.versions.items())
    table = Table("what", *(scene.scene for scene in report.scenes), title=versions)
    for what, cell in _ROWS:
        table.add_row(what, *(cell(scene) for scene in report.scenes))
    for part in dict.fromkeys(part for scene in report.scenes for part in scene.frame_shares):
        table.add_row(f"  of it {part}", *(f"{scene.frame_shares.get(part, 0.0):.1%}" for scene in report.scenes))
    console.print(table)


def _kernels(scene: SceneReport) -> str:
    if scene.kernels_compiled is None:
        return "none needed"
    return f"{scene.kernels_compiled}, later {scene.kernels_compiled_later}"


def _target(scene: SceneReport) -> str:
    told = f"{scene.target_cpu_s:.2f} CPU-s, {scene.target_samples:.0f} paths per pixel"
    return told if scene.target_met else f"not in {told}: worst tile {scene.reached_noise_ratio:.2g}"


_ROWS: tuple[tuple[str, Callable[[SceneReport], str]], ...] = (
    ("size", lambda scene: f"{scene.size_px[0]} x {scene.size_px[1]}, {scene.variant}"),
    ("throughput", lambda scene: f"{scene.mega_paths_per_cpu_s:.2f} million paths per CPU-s"),
    ("resolve the recipe", lambda scene: f"{scene.build_cpu_s:.2f} CPU-s"),
    ("first rendering", lambda scene: f"{scene.first_cpu_s:.2f} CPU-s"),
    ("kernels compiled", _kernels),
    (f"to {NOISE_RATIO:g} of the sensor's noise", _target),
    (f"whole frame, {_SAMPLES} paths per pixel", lambda scene: f"{scene.frame_cpu_s:.2f} CPU-s"),
)
