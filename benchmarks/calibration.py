"""Is the predicted error honest? Measured against predicted error, tile by tile; fills docs/benchmarks/calibration.md.

Run: python -m benchmarks.calibration [--scene NAME ...] [--size 160x120] [--minutes 20] [--seeds 6] [--noise-ratios 4 2 1]
Everything measured is kept in out/benchmarks/calibration (--results); the same command goes on where it stopped.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.engines import Budget
from benchmarks.error_against_time import reference_of
from benchmarks.noise_error import NoiseJudge, truth_of
from benchmarks.path_engines import ENGINES, ReferencePath, path_version
from benchmarks.plots import calibration_plot
from benchmarks.results import DOCS, Deadline, ResultStore, fill_page, markdown_table, number
from benchmarks.scenes import SCENES, build_frame

Record = dict[str, Any]

RESULTS = Path("out/benchmarks/calibration")
ALLOWED = 0.2
"""How far the mean ratio of measured to predicted error may be from 1."""

_BINS = 8


def measure_scene(
    scene: str,
    size: tuple[int, int],
    noise_ratios: list[float],
    seeds: int,
    *,
    reference_cpu_s: float,
    most_cpu_s: float,
    store: ResultStore,
    deadline: Deadline,
) -> None:
    """Measure the runs of a scene that are missing, coarse ratios first, as far as time allows."""
    with tempfile.TemporaryDirectory() as folder:
        frame = build_frame(scene, Path(folder), size=size)
    reference = reference_of(frame, ReferencePath(), reference_cpu_s, deadline)
    if reference is None:
        return
    judge = NoiseJudge(frame, truth_of(frame, reference, direct=True))
    engine = ENGINES["adaptive"]()
    last: tuple[float, float] | None = None
    for ratio in sorted(noise_ratios, reverse=True):
        for seed in range(seeds):
            expected_s = 0.0 if last is None else last[1] * (last[0] / ratio) ** 2
            if expected_s > most_cpu_s or not deadline.allows(expected_s / 2):
                continue
            key = {"scene": scene, "size": list(size), "path": path_version(), "noise_ratio": ratio, "seed": seed}
            key |= {"reference": reference.samples}
            if store.get(key) is not None:
                continue
            result = engine.render(frame, Budget(4, seed=500 + seed, noise_ratio=ratio))
            error = judge.judge(judge.channels(result))
            assert result.replicas is not None
            predicted = judge.predicted_square(result.replicas)
            last = ratio, result.cpu_s
            store.put(
                key,
                {
                    "measured_square": error.square.tolist(),
                    "predicted_square": predicted.tolist(),
                    "reference_rms": error.reference_rms,
                    "bias": error.bias,
                    "samples": result.samples,
                    "unmet_tiles": result.unmet_tiles,
                },
            )
            told = np.sqrt(np.mean(error.square) / np.mean(predicted))
            print(f"{scene} ratio {ratio:g} seed {seed}: measured / predicted {told:.3f}, {result.cpu_s:.1f} CPU-s", flush=True)


def mean_ratio(measured_square: NDArray[np.float64], predicted_square: NDArray[np.float64]) -> float:
    """Return measured over predicted root mean square error, over all tiles and channels.

    A ratio of means: that of single tiles, of squares that are both uncertain, would be too large on average.
    """
    return float(np.sqrt(max(0.0, float(np.mean(measured_square))) / float(np.mean(predicted_square))))


def binned(
    measured_square: NDArray[np.float64], predicted_square: NDArray[np.float64], count: int = _BINS
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (predicted, measured) root mean squares of `count` bins with equally many tiles, by predicted error."""
    order = np.argsort(predicted_square.ravel())
    parts = [part for part in np.array_split(order, count) if len(part)]
    means = [[float(np.mean(values.ravel()[part])) for part in parts] for values in (predicted_square, measured_square)]
    predicted, measured = np.sqrt(np.maximum(np.array(means), 0.0))
    return predicted, measured


def report(store: ResultStore, size: tuple[int, int], command: str) -> tuple[str, dict[str, Any]]:
    """Return the page's table, and the bins by scene."""
    runs: dict[tuple[str, float], list[Record]] = {}
    for key, record in store.all():
        if key["size"] == list(size) and key["path"] == path_version():
            runs.setdefault((key["scene"], key["noise_ratio"]), []).append(record)
    rows, bins = [], {}
    order = list(SCENES)
    for scene, ratio in sorted(runs, key=lambda pair: (order.index(pair[0]), -pair[1])):
        same = runs[scene, ratio]
        measured, predicted = (np.array([record[f"{name}_square"] for record in same]) for name in ("measured", "predicted"))
        ratios = [mean_ratio(m, p) for m, p in zip(measured, predicted, strict=True)]
        whole = mean_ratio(measured, predicted)
        worst = mean_ratio(measured.max(axis=1), predicted.max(axis=1))
        without = _without_worst(measured, predicted)
        shown = [f"{float(np.sqrt(np.mean(predicted))):.3g}", f"{whole:.3f}", f"{min(ratios):.2f}-{max(ratios):.2f}"]
        shown += [f"{without:.3f}", f"{worst:.3f}", f"{np.mean([record['bias'] for record in same]):+.3f}"]
        verdict = "yes" if abs(whole - 1) <= ALLOWED else "no"
        reference = number(float(np.mean([record["reference_rms"] for record in same])))
        rows.append([f"`{scene}`", f"{ratio:g}", str(len(same)), *shown, reference, verdict])
    for scene in order:
        parts = [record for (name, _), same in runs.items() if name == scene for record in same]
        if parts:
            measured, predicted = (
                np.array([record[f"{name}_square"] for record in parts]) for name in ("measured", "predicted")
            )
            bins[scene] = binned(measured, predicted)
    header = [
        "Scene", "Noise ratio", "runs", "predicted rms", "measured / predicted", "range over runs",
        "without the worst 1 % of tiles", "of the worst channels", "bias", "reference's own error", f"within {ALLOWED:.0%}",
    ]  # fmt: skip
    made = f"{size[0]} x {size[1]} pixels, path loop {path_version()}. Made by\n\n```sh\n{command}\n```"
    return f"{made}\n\n{markdown_table(header, rows)}", bins


def _without_worst(measured: NDArray[np.float64], predicted: NDArray[np.float64], share: float = 0.01) -> float:
    """Return the mean ratio without the tiles of the largest predicted and those of the largest measured errors."""
    limits = np.quantile(measured, 1 - share), np.quantile(predicted, 1 - share)
    kept = (measured <= limits[0]) & (predicted <= limits[1])
    return mean_ratio(measured[kept], predicted[kept])


def main() -> None:
    """Measure, keep, report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", choices=sorted(SCENES), action="append")
    parser.add_argument("--size", default="160x120")
    parser.add_argument("--minutes", type=float, default=20.0, help="wall time of all scenes together")
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--noise-ratios", type=float, nargs="+", default=[4.0, 2.0, 1.0])
    parser.add_argument("--reference-cpu-s", type=float, default=300.0, help="per scene")
    parser.add_argument("--most-cpu-s", type=float, default=60.0, help="runs that would cost more are left out")
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder of the page and the plot")
    parser.add_argument("--report-only", action="store_true")
    arguments = parser.parse_args()
    cols, rows = (int(text) for text in arguments.size.split("x"))
    store, whole = ResultStore(arguments.results), Deadline(arguments.minutes)
    scenes = arguments.scene or list(SCENES)
    for left, scene in zip(range(len(scenes), 0, -1), scenes, strict=True):
        if not arguments.report_only:
            measure_scene(
                scene,
                (cols, rows),
                arguments.noise_ratios,
                arguments.seeds,
                reference_cpu_s=arguments.reference_cpu_s,
                most_cpu_s=arguments.most_cpu_s,
                store=store,
                deadline=Deadline(whole.left_s / 60 / left),
            )
    command = f"python -m benchmarks.calibration --size {arguments.size} --seeds {arguments.seeds}"
    command += (
        f" --reference-cpu-s {arguments.reference_cpu_s:g} --noise-ratios {' '.join(f'{r:g}' for r in arguments.noise_ratios)}"
    )
    text, bins = report(store, (cols, rows), command)
    fill_page(arguments.docs / "calibration.md", "results", text)
    if bins:
        calibration_plot(bins, arguments.docs / "calibration.png")


if __name__ == "__main__":
    main()
