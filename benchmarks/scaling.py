"""How cost grows: resolution, triangles, objects, lights, bands, bounces, processes; kernels compiled; overhead of a frame.

Run: python -m benchmarks.scaling [--section NAME ...] [--minutes 30] [--quick]
Each case runs in a process of its own, so that none inherits memory, kernels or a crash. Results are kept in
out/benchmarks/scaling (--results) and fill docs/benchmarks/scaling.md; the same command goes on where it stopped.
--quick takes small cases only.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.fields import lamp_hall, thing_grid, tree_field
from benchmarks.path_engines import path_version, rendered, uncollected
from benchmarks.plots import scaling_plot
from benchmarks.results import DOCS, Deadline, ResultStore, fill_page, markdown_table, number
from benchmarks.scenes import SCENES, build_frame, street
from benchmarks.stages import kernel_misses, stage_times
from fullwell.pipeline import LightCache, render_frame
from fullwell.pipeline.lighting import plan_light
from fullwell.radiometry import WavelengthGrid
from fullwell.render import activate, render_light
from fullwell.scene import Mesh
from fullwell.schema import RecipeBuilder, load_recipe
from fullwell.storage import LocalStore

Record = dict[str, Any]
Case = dict[str, Any]

RESULTS = Path("out/benchmarks/scaling")
_SAMPLES = 16
_STAGES = ("recipe", "plan", "collect surfaces", "acceleration", "materials", "lights", "other set-up", "first launch")
_SMALL = (160, 120)
_LABELS = ("labels.json", "depth.exr", "normals.exr", "instances.png", "semantic.png")


@dataclass(frozen=True, slots=True)
class Section:
    """A series of cases.

    Attributes
    ----------
    run
        Measures a case, in a process of its own.
    cases
        All; with `quick` the first `quick` of them.
    title, xlabel
        Of table and plot; without an `xlabel` there is no plot.
    series
        What is plotted.
    """

    title: str
    run: Callable[[Case], Record]
    cases: tuple[Case, ...]
    quick: int
    xlabel: str = ""
    series: tuple[str, ...] = ("warm",)


# Cases ---------------------------------------------------------------------------------------------------------------


def _resolution(case: Case) -> Record:
    return _measure(lambda folder: _benchmark_recipe(case["scene"], tuple(case["size"]), folder), tuple(case["size"]))


def _triangles(case: Case) -> Record:

    return _measure(lambda folder: tree_field(_SMALL, folder, triangles=case["triangles"]), _SMALL)


def _objects(case: Case) -> Record:

    return _measure(lambda folder: thing_grid(_SMALL, folder, count=case["objects"]), _SMALL)


def _lights(case: Case) -> Record:

    return _measure(lambda folder: lamp_hall(_SMALL, folder, count=case["lights"]), _SMALL, error=True)


def _bands(case: Case) -> Record:

    def changed(frame: Any) -> Any:
        if not case["bands"]:
            return frame
        step_nm = 300.0 / case["bands"]
        grid = WavelengthGrid(400.0 + step_nm / 2, 700.0 - step_nm / 2, step_nm) if case["bands"] > 1 else None
        return replace(frame, grid=grid or WavelengthGrid(550.0, 550.0, 300.0))

    bands = bool(case["bands"])
    return _measure(lambda folder: _benchmark_recipe(case["scene"], _SMALL, folder), _SMALL, change=changed, bands=bands)


def _bounces(case: Case) -> Record:
    def changed(frame: Any) -> Any:
        return replace(frame, quality=replace(frame.quality, max_depth=case["bounces"] + 1))

    return _measure(lambda folder: _benchmark_recipe(case["scene"], _SMALL, folder), _SMALL, change=changed)


def _benchmark_recipe(scene: str, size: tuple[int, int], folder: Path) -> Record:

    return SCENES[scene](size, folder)


def _measure(
    write: Callable[[Path], Record],
    size: tuple[int, int],
    *,
    change: Callable[[Any], Any] = lambda frame: frame,
    bands: bool = False,
    error: bool = False,
) -> Record:
    """Return CPU-seconds of building, loading and rendering a recipe, cold and warm, by stage.

    All skips are on but that of objects out of view, so that what is asked for is what is rendered.
    """

    activate()
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "recipe.json"
        path.write_text(json.dumps(write(Path(name))))
        cpu = time.process_time()
        frame = change(RecipeBuilder(load_recipe(path)).frame(0))
        recipe_s = time.process_time() - cpu
    frame = replace(frame, quality=replace(frame.quality, noise_ratio=None, samples_per_pixel=_SAMPLES))
    cpu = time.process_time()
    planned = plan_light(frame, frame.cameras[0], 0)
    plan_s = time.process_time() - cpu
    request = replace(planned.request, keep_bands=bands, max_depth=frame.quality.max_depth)
    scene, camera = frame.scene, frame.cameras[0].camera
    with uncollected():
        with stage_times() as times, kernel_misses() as kernels:
            cpu = time.process_time()
            render_light(scene, camera, request)
            first_s = time.process_time() - cpu
        render_light(scene, camera, replace(request, seed=1))
        warm = []
        for seed in range(2, 5):
            cpu, wall = time.process_time(), time.perf_counter()
            light = render_light(scene, camera, replace(request, seed=seed))
            warm.append((time.process_time() - cpu, time.perf_counter() - wall))
    warm_s, wall_s = sorted(warm)[1]
    stages = {"recipe": recipe_s, "plan": plan_s, **{k: v for k, v in times.cpu_s.items() if k != "launches"}}
    stages["first launch"] = times.first_cpu_s["launches"]
    faces = sum(len(p.geometry.faces) for item in scene.objects for p in item.parts if isinstance(p.geometry, Mesh))
    record: Record = {
        "triangles": faces,
        "objects": len(scene.objects),
        "samples": light.statistics.samples_per_pixel,
        "first": first_s,
        "warm": warm_s,
        "warm_wall": wall_s,
        "mega_paths_per_cpu_s": size[0] * size[1] * light.statistics.samples_per_pixel / warm_s / 1e6,
        "segments_per_path": light.statistics.segments / (size[0] * size[1] * light.statistics.samples_per_pixel),
        "compiled": kernels.compiled,
        "from_disk": kernels.from_disk,
        "peak_mb": _peak_mb(),
        **{f"stage: {name}": value for name, value in stages.items()},
    }
    if error:
        record["noise_ratio_rms"] = light.statistics.noise_ratio_rms
    return record


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _processes(case: Case) -> Record:
    """Return the throughput of several processes that render the same scene at once, each with so many threads."""
    command = [sys.executable, "-m", "benchmarks.scaling", "--child", json.dumps({"throughput": case})]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(case["processes"])]
    told = [json.loads(child.communicate()[0].splitlines()[-1]) for child in running]
    if any(child.returncode for child in running):
        raise RuntimeError("a process failed")
    span = max(one["ended"] for one in told) - min(one["started"] for one in told)
    frames = sum(one["frames"] for one in told)
    return {"frames": frames, "frames_per_s": frames / span, "cpu_s_per_frame": sum(one["cpu_s"] for one in told) / frames}


def _throughput(case: Case) -> Record:
    """Render frames for some seconds, after a warm-up, and say how many."""

    activate()
    import drjit as dr  # noqa: PLC0415 - loaded with the renderer

    dr.set_thread_count(case["threads"])
    with tempfile.TemporaryDirectory() as name:
        frame = build_frame(case["scene"], Path(name), size=_SMALL)
    frame = replace(frame, quality=replace(frame.quality, noise_ratio=None, samples_per_pixel=_SAMPLES))
    for seed in range(3):
        rendered(frame, skip=True, seed=seed)
    started, cpu, frames = time.time(), time.process_time(), 0
    while time.time() - started < case["seconds"]:
        rendered(frame, skip=True, seed=10 + frames)
        frames += 1
    return {"started": started, "ended": time.time(), "cpu_s": time.process_time() - cpu, "frames": frames}


def _kernels(case: Case) -> Record:
    """Return the kernels that a batch of different streets compiles, in a process whose kernel cache is empty at first."""

    compiled, from_disk, launched, seconds = [], [], [], []
    for seed in case["seeds"]:
        with tempfile.TemporaryDirectory() as name:
            path = Path(name) / "recipe.json"
            path.write_text(json.dumps(getattr(street, case["scene"])((80, 60), Path(name), seed=seed)))
            frame = RecipeBuilder(load_recipe(path)).frame(0)
        noise = {"noise_ratio": case["noise_ratio"], "samples_per_pixel": None, "max_samples_per_pixel": 64}
        frame = replace(frame, quality=replace(frame.quality, **noise))
        cpu = time.process_time()
        with kernel_misses() as kernels:
            rendered(frame, skip=True, seed=seed)
        seconds.append(round(time.process_time() - cpu, 3))
        compiled.append(kernels.compiled)
        from_disk.append(kernels.from_disk)
        launched.append(kernels.launched)
    return {"compiled": compiled, "from_disk": from_disk, "launched": launched, "cpu_s": seconds}


def _frame(case: Case) -> Record:
    """Return where the CPU-seconds of a whole frame go, and those of one that differs in the sensor only."""

    activate()
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        document = SCENES[case["scene"]](tuple(case["size"]), folder)
        document["quality"] = {"max_depth": document["quality"]["max_depth"], **case["quality"]}
        document["outputs"] = [
            "image.png",
            "raw.npz",
            "labels.json",
            "depth.exr",
            "normals.exr",
            "instances.png",
            "semantic.png",
        ]
        document["vary"] = {"repeat": 3}
        path = folder / "recipe.json"
        path.write_text(json.dumps(document))
        cold = RecipeBuilder(load_recipe(path))
        store = LocalStore(folder / "out")
        stack.enter_context(uncollected())
        with kernel_misses() as kernels:
            render_frame(cold.frame(0), store, "cold")  # kernels, recordings, and what is read once
            render_frame(cold.frame(1), store, "cold again")
        # A scene of its own: what is worked out once for each (surfaces, acceleration, labels) is in the frame's time.
        builder = RecipeBuilder(load_recipe(path))
        frames = [builder.frame(index) for index in range(3)]
        cache = LightCache()
        with stage_times() as times:
            cpu, wall = time.process_time(), time.perf_counter()
            manifest = render_frame(frames[0], store, "rendered", cache=cache)
            whole, whole_wall = time.process_time() - cpu, time.perf_counter() - wall
        again = []
        for number, frame in enumerate(frames[1:]):
            cpu = time.process_time()
            other = render_frame(frame, store, f"again {number}", cache=cache)
            again.append((time.process_time() - cpu, other))
    launches = times.cpu_s["launches"]
    labels = sum(stage["cpu_s"] for stage in manifest["run"]["stages"] if "labels" in stage["stage"])
    in_labels = sum(stage["cpu_s"] for stage in manifest["run"]["stages"] if stage["stage"].removeprefix("encode ") in _LABELS)
    resensored, told = min(again, key=lambda pair: pair[0])
    label_stages = sum(stage["cpu_s"] for stage in told["run"]["stages"] if "labels" in stage["stage"])
    return {
        "whole": whole,
        "whole_wall": whole_wall,
        "launches": launches,
        "overhead_share": 1 - launches / whole,
        "labels_share": (labels + in_labels) / whole,
        "resensored": resensored,
        "resensored_share": resensored / whole,
        "resensored_without_labels_share": (resensored - label_stages) / whole,
        "rendered_anew": sum(entry["result"] == "miss" for entry in told["run"]["cache"]),
        "samples_per_pixel": manifest["cameras"][0]["radiance"]["samples_per_pixel"],
        "compiled": kernels.compiled,
        "inner": {name: round(value, 4) for name, value in times.cpu_s.items()},
        "stages": {stage["stage"]: stage["cpu_s"] for stage in manifest["run"]["stages"]},
        "stages_again": {stage["stage"]: stage["cpu_s"] for stage in told["run"]["stages"]},
    }


def _cases(name: str, values: Iterable[Any], **others: Any) -> tuple[Case, ...]:
    return tuple({name: value, **others} for value in values)


_SIZES = ([80, 60], [160, 120], [320, 240], [640, 480])
SECTIONS: dict[str, Section] = {
    "resolution": Section(
        "Resolution",
        _resolution,
        _cases("size", _SIZES, scene="cornell_box") + _cases("size", _SIZES, scene="street_day"),
        2,
    ),
    "triangles": Section(
        "Triangles: a field of trees",
        _triangles,
        _cases("triangles", [10_000, 30_000, 100_000, 300_000, 1_000_000, 2_000_000, 5_000_000]),
        3,
        "triangles",
        ("warm", "stage: recipe", "stage: collect surfaces", "stage: acceleration"),
    ),
    "objects": Section(
        "Placed objects, 400 000 triangles together",
        _objects,
        _cases("objects", [50, 100, 200, 500, 1000, 2000]),
        3,
        "objects",
        ("warm", "stage: recipe", "stage: plan", "stage: collect surfaces", "stage: acceleration", "stage: first launch"),
    ),
    "lights": Section(
        "Lamps, equally bright together",
        _lights,
        _cases("lights", [1, 10, 100, 1000, 10_000]),
        3,
        "lamps",
        ("warm", "stage: recipe", "stage: plan", "stage: collect surfaces", "stage: lights", "stage: first launch"),
    ),
    "bands": Section(
        "Bands kept beside the channels (0: channels only)", _bands, _cases("bands", [0, 1, 8, 31, 61], scene="cornell_box"), 5
    ),
    "bounces": Section(
        "Bounces",
        _bounces,
        _cases("bounces", [1, 2, 3, 4, 8, 16], scene="cornell_box") + _cases("bounces", [1, 2, 4, 8, 16], scene="car_park"),
        3,
    ),
    "processes": Section(
        "Processes at once",
        _processes,
        tuple(
            {"processes": processes, "threads": threads, "scene": "cornell_box", "seconds": 8}
            for processes, threads in ((1, 1), (1, 2), (2, 1), (2, 2))
        ),
        2,
    ),
    "kernels": Section(
        "Kernels compiled by a batch of different streets",
        _kernels,
        tuple({"scene": scene, "seeds": [4, 5, 6, 7, 8, 9], "noise_ratio": 2.0} for scene in ("street_day", "street_night")),
        1,
    ),
    "frame": Section(
        "A whole frame, and one re-sensored",
        _frame,
        (
            {"scene": "cornell_box", "size": [160, 120], "quality": {"samples_per_pixel": 16}},
            {"scene": "street_day", "size": [640, 480], "quality": {"samples_per_pixel": 64}},
            {"scene": "street_night", "size": [640, 480], "quality": {"samples_per_pixel": 64}},
            {"scene": "cornell_box", "size": [640, 480], "quality": {"noise_ratio": 2.0}},
        ),
        1,
    ),
}


# Running -------------------------------------------------------------------------------------------------------------


def run_section(name: str, section: Section, store: ResultStore, deadline: Deadline, *, quick: bool, case_s: float) -> None:
    """Measure the cases of a section that are missing, as far as time allows."""
    for case in section.cases[: section.quick] if quick else section.cases:
        key = _key(name, case)
        if store.get(key) is not None:
            continue
        if not deadline.allows(5.0):
            return
        record = _in_child({"section": name, "case": case}, min(case_s, deadline.left_s), cold=name == "kernels")
        print(name, json.dumps(case), json.dumps(record)[:200], flush=True)
        if record.get("failed") != "time":  # whoever has more time may try again
            store.put(key, record)


def _key(name: str, case: Case) -> Record:

    return {"section": name, "case": case, "path": path_version()}


def _in_child(job: Record, seconds: float, *, cold: bool) -> Record:
    """Run a case in a process of its own, with an empty kernel cache where `cold`; a failure is a record, too."""
    with tempfile.TemporaryDirectory() as home:
        environment = os.environ | ({"HOME": home} if cold else {})
        command = [sys.executable, "-m", "benchmarks.scaling", "--child", json.dumps(job)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=seconds, env=environment, check=False)
        except subprocess.TimeoutExpired:
            return {"failed": "time"}
    if done.returncode:
        return {"failed": f"exit code {done.returncode}", "stderr": done.stderr[-1500:]}
    record: Record = json.loads(done.stdout.splitlines()[-1])
    return record


def _child(job: Record) -> Record:
    if "throughput" in job:
        return _throughput(job["throughput"])
    return SECTIONS[job["section"]].run(job["case"])


# Reporting -----------------------------------------------------------------------------------------------------------

_PLAIN = {
    "triangles": "triangles",
    "samples": "rays per pixel",
    "first": "first call",
    "warm": "later calls",
    "warm_wall": "seconds",
    "mega_paths_per_cpu_s": "million paths per CPU-s",
    "segments_per_path": "segments per path",
    "noise_ratio_rms": "rms noise ratio",
    "compiled": "compiled",
    "peak_mb": "peak MB",
    "frames_per_s": "frames per second",
    "cpu_s_per_frame": "CPU-s per frame",
    "from_disk": "from disk",
    "launched": "launched",
    "cpu_s": "CPU-s",
    "whole": "whole frame",
    "launches": "of it launches",
    "overhead_share": "overhead",
    "labels_share": "labels",
    "resensored": "re-sensored",
    "resensored_share": "share of the whole",
    "resensored_without_labels_share": "share, labels aside",
    "rendered_anew": "rendered anew",
}
_SHARES = frozenset({"overhead_share", "labels_share", "resensored_share", "resensored_without_labels_share"})


def section_report(name: str, section: Section, store: ResultStore) -> str:
    """Return a section's table; times are CPU-seconds of all threads."""
    found = [(case, store.get(_key(name, case))) for case in section.cases]
    found = [(case, record) for case, record in found if record is not None]
    if not found:
        return f"### {section.title}\n\nNot measured yet."
    names = [shown for shown in (*_PLAIN, *(f"stage: {stage}" for stage in _STAGES)) if any(shown in r for _, r in found)]
    header = ["Case", *(_PLAIN.get(shown, shown.removeprefix("stage: ")) for shown in names)]
    rows = []
    for case, record in found:
        what = ", ".join(_case_words(case))
        if "failed" in record:
            rows.append([what, record["failed"], *[""] * (len(names) - 1)])
        else:
            rows.append([what, *(_cell(shown, record.get(shown)) for shown in names)])
    text = f"### {section.title}\n\n{markdown_table(header, rows)}"
    if name == "frame":
        text += "\n\n" + "\n\n".join(_frame_stages(case, record) for case, record in found if "stages" in record)
    return text


def _case_words(case: Case) -> Iterable[str]:
    for name, value in case.items():
        if name == "scene":
            yield f"`{value}`"
        elif name == "size":
            yield "x".join(map(str, value))
        elif name == "quality":
            yield ", ".join(f"{key.replace('_', ' ')} {quality:g}" for key, quality in value.items())
        elif name not in {"seconds", "seeds"}:
            yield f"{value:,} {name}".replace(",", " ") if isinstance(value, int) else f"{name.replace('_', ' ')} {value:g}"


def _cell(name: str, value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(f"{one:g}" for one in value)
    if name in _SHARES and value is not None:
        return f"{value:.1%}"
    return f"{value:,}".replace(",", " ") if isinstance(value, int) else number(value)


def _frame_stages(case: Case, record: Record) -> str:
    inner = sorted(record["inner"].items(), key=lambda pair: -pair[1])
    rows = [[f"render: {name}", number(value), f"{value / record['whole']:.1%}", ""] for name, value in inner]
    names = dict.fromkeys([*record["stages"], *record["stages_again"]])
    for name in names:
        once, again = record["stages"].get(name), record["stages_again"].get(name)
        share = "" if once is None else f"{once / record['whole']:.1%}"
        rows.append([name, number(once), share, number(again)])
    what = ", ".join(_case_words(case))
    return f"Stages, {what}:\n\n" + markdown_table(["Stage", "CPU-s", "share", "re-sensored, CPU-s"], rows)


def plot_section(name: str, section: Section, store: ResultStore, folder: Path) -> None:
    """Draw a section that has an axis."""
    if not section.xlabel:
        return
    key = next(iter(section.cases[0]))
    found = [(case[key], store.get(_key(name, case))) for case in section.cases]
    points = [(x, record) for x, record in found if record is not None and "failed" not in record]
    if len(points) > 1:
        series = {
            _PLAIN.get(s, s.removeprefix("stage: ")): [record.get(s, 0.0) for _, record in points] for s in section.series
        }
        scaling_plot(section.title, section.xlabel, [x for x, _ in points], series, folder / f"scaling_{name}.png")


def main() -> None:
    """Measure, keep, report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--section", choices=list(SECTIONS), action="append")
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--case-seconds", type=float, default=300.0, help="wall time of one case")
    parser.add_argument("--quick", action="store_true", help="small cases only")
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder of the page and the plots")
    parser.add_argument("--report-only", action="store_true")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child is not None:
        print(json.dumps(_child(json.loads(arguments.child))))
        return
    store, deadline = ResultStore(arguments.results), Deadline(arguments.minutes)
    for name in arguments.section or SECTIONS:
        if not arguments.report_only:
            run_section(name, SECTIONS[name], store, deadline, quick=arguments.quick, case_s=arguments.case_seconds)

    command = "python -m benchmarks.scaling" + (" --quick" if arguments.quick else "")
    made = f"Path loop {path_version()}, {_SAMPLES} rays per pixel and {_SMALL[0]} x {_SMALL[1]} pixels where nothing "
    made += "else is said.\n"
    made += f"Made by\n\n```sh\n{command}\n```"
    parts = [made, *(section_report(name, section, store) for name, section in SECTIONS.items())]
    fill_page(arguments.docs / "scaling.md", "results", "\n\n".join(parts))
    for name, section in SECTIONS.items():
        plot_section(name, section, store, arguments.docs)


if __name__ == "__main__":
    main()
