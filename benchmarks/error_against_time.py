"""Error of the sensor image against CPU time, engine by engine, scene by scene; fills docs/benchmarks/error_against_time.md.

Run: python -m benchmarks.error_against_time [--scene NAME ...] [--size 160x120] [--minutes 30] [--reference-cpu-s 300]
Everything measured is kept in out/benchmarks/error_against_time (--results); the same command goes on where it stopped.
--report-only fills the page and draws the plots from what is there.
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import statistics
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.baselines import MitsubaPath
from benchmarks.engines import Budget, Engine, Result, Stopwatch
from benchmarks.measures import band_relative_mse
from benchmarks.noise_error import NoiseJudge, truth_of
from benchmarks.path_engines import ENGINES, ReferencePath, denoiser_found, path_version
from benchmarks.plots import error_plots
from benchmarks.references import Reference, extend_reference, load_reference
from benchmarks.results import DOCS, Deadline, ResultStore, cost_at_error, fill_page, markdown_table, number
from benchmarks.scenes import SCENES, build_frame
from benchmarks.stages import launch_recordings
from fullwell.schema.frame import FrameDescription

Record = dict[str, Any]

RESULTS = Path("out/benchmarks/error_against_time")
SAMPLES = (16, 64, 256, 1024)
NOISE_RATIOS = (4.0, 2.0, 1.0, 0.5)
_FALLBACK_RATIOS = (16.0, 8.0)
"""For scenes of which even the largest of the others is out of reach."""

MEASURES = {"rms": "rms", "p95": "95th percentile tile", "worst": "worst tile"}
_ADAPTIVE = frozenset({"adaptive", "adaptive-no-skip"})
_PASS_SAMPLES = 64
_WARM_SAMPLES = 8
_REFERENCE_SHARE = 0.6


# Measuring -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Settings:
    """What is to be measured, and how long anything may take."""

    size: tuple[int, int]
    seeds: int
    samples: tuple[int, ...]
    noise_ratios: tuple[float, ...]
    engines: tuple[str, ...]
    reference_cpu_s: float
    mitsuba_reference_cpu_s: float
    most_cpu_s: float

    def budgets(self, engine: str) -> tuple[Budget, ...]:
        """Return an engine's budgets, cheap ones first."""
        if engine in _ADAPTIVE:
            return tuple(Budget(_WARM_SAMPLES, noise_ratio=ratio) for ratio in sorted(self.noise_ratios, reverse=True))
        return tuple(Budget(samples) for samples in sorted(self.samples))


def reference_of(frame: FrameDescription, engine: Engine, cpu_s: float, whole: Deadline) -> Reference | None:
    """Return a reference with an even number of passes, grown until it has cost `cpu_s` or 60 % of the time is used up.

    None where none is asked for and none is there.
    """
    deadline = Deadline(_REFERENCE_SHARE * whole.left_s / 60)
    reference = load_reference(frame, engine, _PASS_SAMPLES)
    while deadline.allows() and cpu_s > 0:
        have = 0.0 if reference is None else reference.cpu_s
        odd = reference is None or reference.passes % 2 == 1
        if have >= cpu_s and not odd:
            break
        seconds = 0.0 if have >= cpu_s else min(30.0, (cpu_s - have) / 2, deadline.left_s)
        reference = extend_reference(frame, engine, seconds=seconds, samples_per_pass=_PASS_SAMPLES)
    if reference is not None and reference.passes % 2:  # time was up: one pass more makes the halves weigh the same
        reference = extend_reference(frame, engine, seconds=0.0, samples_per_pass=_PASS_SAMPLES)
    return reference


def measure_scene(scene: str, settings: Settings, store: ResultStore, deadline: Deadline) -> None:
    """Measure what is not measured yet of a scene, as far as time allows."""
    with tempfile.TemporaryDirectory() as folder:
        frame = build_frame(scene, Path(folder), size=settings.size)
    engines = {name: MitsubaPath() if name == "mitsuba" else ENGINES[name]() for name in settings.engines}
    own = reference_of(frame, ReferencePath(), settings.reference_cpu_s, deadline)
    if own is None:
        return
    mitsuba = reference_of(frame, MitsubaPath(), settings.mitsuba_reference_cpu_s, deadline)
    judges = _judges(frame, own, mitsuba)
    store.put(_key("reference", scene, settings), _reference_record(own, mitsuba, judges))
    costs: dict[str, tuple[float, float]] = {}
    warm: set[str] = set()
    for seed in range(settings.seeds):
        for name, budget in _in_turns(engines, settings, backwards=seed % 2 == 1):
            key = _key("pooled-run", scene, settings) | {"engine": engines[name].name, "budget": budget.label, "seed": seed}
            known = store.get(key)
            if known is None:
                expected_s = _expected_cpu_s(costs.get(name), budget)
                if expected_s > settings.most_cpu_s or not deadline.allows(expected_s / 2):
                    continue
                first_s = _warmed(engines[name], frame, settings.budgets(name)) if name not in warm else None
                warm.add(name)
                known = _measured(engines[name], frame, budget, seed, judges[name == "mitsuba"])
                known |= {"short": name, "reference": own.samples, "first_call_cpu_s": first_s}
                store.put(key, known)
                told = " ".join(f"{measure} {known[measure]:.3g}" for measure in MEASURES)
                print(f"{scene} {name} {budget.label} seed {seed}: {known['cpu_s']:.2f} CPU-s, {told}", flush=True)
            costs[name] = (budget.noise_ratio or budget.samples_per_pixel, known["cpu_s"])
    del engines
    gc.collect()


def _key(kind: str, scene: str, settings: Settings) -> Record:
    return {"kind": kind, "scene": scene, "size": list(settings.size), "path": path_version()}


_APART = 2.0
"""Times the errors of both together: two references that differ by more are of different models."""


def _judges(frame: FrameDescription, own: Reference, mitsuba: Reference | None) -> dict[bool, NoiseJudge]:
    """Return the judge of this project's engines (False) and that of Mitsuba (True).

    Mitsuba's bands are judged by channels made of bands: averaging responses over bands is no noise. Its own reference is
    taken where it has at least as small an error, and where the two references differ by more than both errors explain: what
    tells the two renderers apart is no noise either.
    """
    judges = {False: NoiseJudge(frame, truth_of(frame, own, direct=True))}
    judges[True] = NoiseJudge(frame, truth_of(frame, own, direct=False))
    if mitsuba is not None:
        other = NoiseJudge(frame, truth_of(frame, mitsuba, direct=False))
        mine, its = _own_error(judges[True]), _own_error(other)
        apart = judges[True].judge(other.truth.channels).raw_rms
        if its <= mine or apart > _APART * math.hypot(mine, its):
            judges[True] = other
    return judges


def _own_error(judge: NoiseJudge) -> float:
    return judge.judge(judge.truth.channels).reference_rms


def _reference_record(own: Reference, mitsuba: Reference | None, judges: dict[bool, NoiseJudge]) -> Record:
    record: Record = {
        "samples": own.samples,
        "cpu_s": own.cpu_s,
        "own_relative_mse": own.own_relative_mse(),
        "noise_ratio_rms": _own_error(judges[False]),
        "bands_against_channels": judges[False].judge(judges[True].truth.channels).raw_rms,
    }
    if mitsuba is not None:
        record |= {"mitsuba_samples": mitsuba.samples, "mitsuba_cpu_s": mitsuba.cpu_s}
        count = mitsuba.image.shape[-1]
        means = [float(reference.image[..., :count].mean(dtype=np.float64)) for reference in (own, mitsuba)]
        record["mean_ratio_to_mitsuba"] = means[0] / means[1]
    return record


def _in_turns(engines: dict[str, Engine], settings: Settings, *, backwards: bool) -> Iterator[tuple[str, Budget]]:
    """Yield the runs of one seed: all engines with their cheapest budget, then the next; every other seed in turned order."""
    names = list(engines)[::-1] if backwards else list(engines)
    for place in range(max(len(settings.budgets(name)) for name in names)):
        for name in names:
            budgets = settings.budgets(name)
            if place < len(budgets):
                yield name, budgets[place]


def _expected_cpu_s(last: tuple[float, float] | None, budget: Budget) -> float:
    """Return what a run may cost, from the engine's last: in proportion to samples, or to the inverse square of the ratio."""
    if last is None:
        return 0.0
    amount, cpu_s = last
    if budget.noise_ratio is not None:
        return cpu_s * (amount / budget.noise_ratio) ** 2
    return cpu_s * budget.samples_per_pixel / amount


def _warmed(engine: Engine, frame: FrameDescription, budgets: tuple[Budget, ...]) -> float:
    """Make an engine load and compile what it keeps, and return the CPU-seconds of its very first call.

    Mitsuba's samplers have kernels of their own for each number of samples, up to that of a pass.
    """
    watch = Stopwatch()
    engine.render(frame, budgets[0])
    first_s = watch.read()[0]
    for budget in [budgets[0], *(other for other in budgets if other.noise_ratio is None)]:  # the first two calls record
        if budget.samples_per_pixel <= _PASS_SAMPLES:
            engine.render(frame, Budget(budget.samples_per_pixel, seed=900, noise_ratio=budget.noise_ratio))
    return first_s


def _measured(engine: Engine, frame: FrameDescription, budget: Budget, seed: int, judge: NoiseJudge) -> Record:
    asked = Budget(budget.samples_per_pixel, seed=100 + seed, noise_ratio=budget.noise_ratio)
    recordings = launch_recordings()
    result, first_s = engine.render(frame, asked), None
    if launch_recordings() > recordings:  # a number of lanes that this process has not met yet: once for all frames of a batch
        first_s, result = result.cpu_s, engine.render(frame, asked)
    error = judge.judge(judge.channels(result))
    record: Record = {
        "cpu_s": result.cpu_s,
        "recorded_cpu_s": first_s,
        "wall_s": result.wall_s,
        "samples": result.samples,
        "unmet_tiles": result.unmet_tiles,
        "noise_ratio": budget.noise_ratio,
        **error.summary(),
        # Of every tile and channel, so that seeds can be pooled: a tile's error is an expectation, not one firefly.
        "tile_squares": [[float(f"{value:.5g}") for value in channel.ravel()] for channel in error.square],
        **_band_errors(result, judge),
    }
    if result.replicas is not None:
        square = judge.predicted_square(result.replicas).max(axis=0)
        record |= {"predicted_rms": float(np.sqrt(square.mean())), "predicted_worst": float(np.sqrt(square.max()))}
    return record


def _band_errors(result: Result, judge: NoiseJudge) -> Record:
    if result.kind != "bands":
        return {}
    by_band = band_relative_mse(result.image, judge.truth.bands)
    return {"relative_mse": float(by_band.mean()), "relative_mse_by_band": [float(value) for value in by_band]}


# Reporting -----------------------------------------------------------------------------------------------------------

Curves = dict[str, list[Record]]
PAIRS = (("mitsuba", "adaptive", 3.0), ("uniform", "adaptive", 2.0), ("uniform-channels", "adaptive", None))
"""What is compared: costs of the first over those of the second; the aim for the street scenes."""


def collect(store: ResultStore, size: tuple[int, int], path: str) -> tuple[dict[str, Curves], dict[str, Record]]:
    """Return the runs by scene and engine, and the references by scene, of one version of the path loop and one size."""
    runs: dict[str, Curves] = {}
    references: dict[str, Record] = {}
    for key, record in store.all():
        if key["size"] != list(size) or key["path"] != path:
            continue
        if key["kind"] == "reference":
            references[key["scene"]] = record
        elif key["kind"] == "pooled-run":
            runs.setdefault(key["scene"], {}).setdefault(record["short"], []).append(record | {"seed": key["seed"]})
    return {scene: runs[scene] for scene in SCENES if scene in runs}, references


def pooled(records: list[Record], seeds: list[int]) -> list[tuple[float, dict[str, float]]]:
    """Return (mean CPU-seconds, errors by measure) of each budget of which all `seeds` were run, cheap ones first.

    Squared errors of each tile and channel are averaged over seeds before the worst channel and tile are looked for: the
    worst tile is the one whose expected error is largest, not the one that met a firefly.
    """
    budgets: dict[float, list[Record]] = {}
    for record in records:
        if record["seed"] in seeds:
            budgets.setdefault(record["noise_ratio"] or record["samples"], []).append(record)
    points = []
    for same in budgets.values():
        if len(same) == len(seeds):
            square = np.mean([record["tile_squares"] for record in same], axis=0).max(axis=0)
            tiles = np.sqrt(np.maximum(square, 0.0))
            rms = float(np.sqrt(max(0.0, float(square.mean()))))
            errors = {"rms": rms, "p95": float(np.percentile(tiles, 95)), "worst": float(tiles.max())}
            points.append((statistics.fmean(record["cpu_s"] for record in same), errors))
    return sorted(points, key=lambda point: point[0])


def paired_ratio(first: list[Record], second: list[Record], measure: str) -> tuple[float, float, float, float] | None:
    """Return (error, ratio of CPU-seconds first / second at equal error, least and largest of it with one seed left out).

    The error is the smallest that the second reaches and the first comes near. Both are pooled over the seeds that both have,
    whose runs were made in turns.
    """
    seeds = sorted({record["seed"] for record in first} & {record["seed"] for record in second})
    if not seeds:
        return None
    for _, errors in reversed(pooled(second, seeds)):
        whole = _ratio_at(first, second, measure, seeds, errors[measure])
        if whole is not None:
            parts = [[other for other in seeds if other != seed] for seed in seeds] if len(seeds) > 1 else []
            others = [_ratio_at(first, second, measure, part, errors[measure]) for part in parts]
            ratios = [whole, *(ratio for ratio in others if ratio is not None)]
            return errors[measure], whole, min(ratios), max(ratios)
    return None


def _ratio_at(first: list[Record], second: list[Record], measure: str, seeds: list[int], error: float) -> float | None:
    costs = []
    for part in (first, second):
        points = pooled(part, seeds)
        costs.append(cost_at_error([cpu_s for cpu_s, _ in points], [errors[measure] for _, errors in points], error))
    return None if costs[0] is None or costs[1] is None else costs[0] / costs[1]


def report(store: ResultStore, size: tuple[int, int], path: str, command: str) -> str:
    """Return the tables of the page."""
    runs, references = collect(store, size, path)
    text = [f"{size[0]} x {size[1]} pixels, path loop {path}. Made by\n\n```sh\n{command}\n```", _pair_table(runs)]
    text.append(_reference_table(references))
    text.append(_run_table(runs))
    text.append("\n".join(f"![{scene}: error against CPU-seconds](error_{scene}.png)" for scene in runs))
    return "\n\n".join(text)


def _pair_table(runs: dict[str, Curves]) -> str:
    rows = []
    for scene, curves in runs.items():
        for first, second, aim in PAIRS:
            if not (curves.get(first) and curves.get(second)):
                continue
            cells = []
            for measure in MEASURES:
                found = paired_ratio(curves[first], curves[second], measure)
                cells.append("-" if found is None else "{1:.2f} ({2:.2f}-{3:.2f}) at {0:.2g}".format(*found))
            cells.append(f"{aim:g}" if aim is not None and scene.startswith("street") else "")
            rows.append([f"`{scene}`", f"{first} / {second}", *cells])
    header = ["Scene", "CPU-seconds of", *(f"at equal {title}" for title in MEASURES.values()), "aim, worst tile"]
    told = (
        "Ratios of CPU-seconds at equal error, squared errors of every tile averaged over seeds first; in brackets the range "
        "with one seed left out; and the error in units of the sensor's noise.\n\n"
    )
    return told + markdown_table(header, rows, left=2)


def _reference_table(references: dict[str, Record]) -> str:
    rows = [
        [
            f"`{scene}`",
            f"{record['samples']:.0f}",
            number(record["cpu_s"]),
            number(record["noise_ratio_rms"]),
            number(record["bands_against_channels"]),
            f"{record['mitsuba_samples']:.0f}" if "mitsuba_samples" in record else "-",
            number(record.get("mean_ratio_to_mitsuba"), 5),
        ]
        for scene, record in sorted(references.items(), key=lambda pair: list(SCENES).index(pair[0]))
    ]
    header = [
        "Reference of", "rays per pixel", "CPU-s", "own error, rms noise ratio", "bands against channels, rms noise ratio",
        "Mitsuba's: rays per pixel", "mean radiance over Mitsuba's",
    ]  # fmt: skip
    return markdown_table(header, rows)


def _run_table(runs: dict[str, Curves]) -> str:
    rows = []
    for scene, curves in runs.items():
        for engine, records in curves.items():
            budgets: dict[float, list[Record]] = {}
            for record in records:
                budgets.setdefault(record["noise_ratio"] or record["samples"], []).append(record)
            for budget, same in sorted(budgets.items(), key=lambda pair: statistics.median(r["cpu_s"] for r in pair[1])):
                asked = f"ratio {budget:g}" if same[0]["noise_ratio"] else f"{budget:g} rays"
                ((cpu_s, errors),) = pooled(same, sorted(record["seed"] for record in same))
                told = [number(cpu_s), _median(same, "samples"), *(number(errors[name]) for name in MEASURES)]
                told += [_median(same, name) for name in ("worst", "relative_mse", "bias")]
                rows.append([f"`{scene}`", engine, asked, str(len(same)), *told])
    header = [
        "Scene", "Engine", "Budget", "seeds", "CPU-s", "rays per pixel", "rms", "95 % tile", "worst tile",
        "worst tile of one run", "relMSE of bands", "bias",
    ]  # fmt: skip
    return markdown_table(header, rows, left=3)


def _median(records: list[Record], name: str) -> str:
    values = [record[name] for record in records if record.get(name) is not None]
    return number(statistics.median(values)) if values else "-"


# Command -------------------------------------------------------------------------------------------------------------


def main() -> None:
    """Measure, keep, report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = ["mitsuba", *ENGINES]
    parser.add_argument("--scene", choices=sorted(SCENES), action="append")
    parser.add_argument("--engine", choices=names, action="append")
    parser.add_argument("--size", default="160x120")
    parser.add_argument("--minutes", type=float, default=30.0, help="wall time of all scenes together")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--samples", type=int, nargs="+", default=list(SAMPLES))
    parser.add_argument("--noise-ratios", type=float, nargs="+", default=[*_FALLBACK_RATIOS, *NOISE_RATIOS])
    parser.add_argument("--reference-cpu-s", type=float, default=300.0, help="per scene")
    parser.add_argument("--mitsuba-reference-cpu-s", type=float, default=0.0, help="per scene; 0 for none but what there is")
    parser.add_argument("--most-cpu-s", type=float, default=120.0, help="runs that would cost more are left out")
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder of the page and the plots")
    parser.add_argument("--report-only", action="store_true")
    parser.add_argument("--path", default=path_version(), help="version of the path loop to report; default: the present one")
    arguments = parser.parse_args()
    engines = tuple(arguments.engine or [name for name in names if name != "denoised" or denoiser_found()])
    cols, rows = (int(text) for text in arguments.size.split("x"))
    settings = Settings(
        (cols, rows),
        arguments.seeds,
        tuple(arguments.samples),
        tuple(arguments.noise_ratios),
        engines,
        arguments.reference_cpu_s,
        arguments.mitsuba_reference_cpu_s,
        arguments.most_cpu_s,
    )
    store = ResultStore(arguments.results)
    scenes = arguments.scene or list(SCENES)
    if not arguments.report_only:
        whole = Deadline(arguments.minutes)
        for number_left, scene in zip(range(len(scenes), 0, -1), scenes, strict=True):
            # A scene gets its share of what is left, so that the last is not left out.
            measure_scene(scene, settings, store, Deadline(whole.left_s / 60 / number_left))
    command = f"python -m benchmarks.error_against_time --size {arguments.size} --seeds {arguments.seeds}"
    command += f" --reference-cpu-s {arguments.reference_cpu_s:g} --most-cpu-s {arguments.most_cpu_s:g}"
    fill_page(arguments.docs / "error_against_time.md", "results", report(store, settings.size, arguments.path, command))
    runs, _ = collect(store, settings.size, arguments.path)
    error_plots(runs, arguments.docs, MEASURES)
    raw = [{"key": key, "record": record} for key, record in store.all()]
    (arguments.results / "all.jsonl").write_text("".join(json.dumps(entry) + "\n" for entry in raw))


if __name__ == "__main__":
    main()
