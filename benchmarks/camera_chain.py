"""CPU time of the camera chain, step by step: spectral radiance to a noisy raw image, and a sweep behind one lens.

ISETCam needs about 23 CPU-seconds under Octave for the same task: 480 x 640 x 31 radiance, a diffraction-limited lens, and
a 960 x 1504 RGGB sensor (3 um) with all noise.

Run: python benchmarks/camera_chain.py [--repeats N] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fullwell.core import stream
from fullwell.optics import compute_irradiance
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene import Lens
from fullwell.sensor import FixedExposure, SensorModel, capture, channel_currents, expose, fixed_pattern_stream, sensor

ROWS, COLS = 480, 640
F_NUMBER, FOCAL_LENGTH_M = 4.0, 3.8752293174e-3
EXPOSURE_S = 0.01
AIM_CPU_S = 0.8
AIM_SWEEP_CPU_S = 0.1
ISETCAM_CPU_S = 23.0


def radiance_image() -> RadianceImage:
    """Return a scene with edges, gradients, texture and a bright lamp, about 100 cd/m2; it covers the sensor."""
    rng = stream(0, "benchmark")
    grid = WavelengthGrid()
    y, x = np.mgrid[0:ROWS, 0:COLS]
    pattern = 1.0 + 0.5 * np.sin(x / 7.0) * np.cos(y / 11.0) + (x > COLS / 2) + 0.2 * rng.random((ROWS, COLS))
    pattern[40:60, 60:90] = 200.0
    colour = 1.0 + 0.3 * np.sin(np.arange(grid.count)[None, None, :] / 5.0 + x[..., None] / 200.0)
    photons = (2e15 * pattern[..., None] * colour).astype(np.float32)
    width_m = 1504 * 3e-6 * 1.001
    return RadianceImage(photons, grid, tangent_pitch=width_m / COLS / FOCAL_LENGTH_M)


def lens() -> Lens:
    """Return the diffraction-limited lens, focused at infinity."""
    return Lens("pinhole", FOCAL_LENGTH_M, F_NUMBER, float("inf"), Spectrum.constant(1.0))


def noisy_sensor() -> SensorModel:
    """Return sensor B with every noise switched on, cut to the height that the scene covers."""
    model = sensor("iset-b")
    return replace(model, dsnu_v=1e-3, prnu_fraction=0.01, read_noise_e=max(model.read_noise_e, 5.0))


def cpu_seconds(work: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Return (median CPU-seconds of all threads, last result) after one unmeasured call."""
    result = work()
    times = []
    for _ in range(repeats):
        started = time.process_time()
        result = work()
        times.append(time.process_time() - started)
    return statistics.median(times), result


def main() -> None:
    """Measure, print a table, and write the numbers where asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    radiance, optics, model = radiance_image(), lens(), noisy_sensor()
    steps: dict[str, float] = {}
    steps["optics: camera equation, falloff"], _ = cpu_seconds(
        lambda: compute_irradiance(radiance, optics, terms=("relative_illumination",)), arguments.repeats
    )
    everything, optical = cpu_seconds(lambda: compute_irradiance(radiance, optics), arguments.repeats)
    steps["optics: diffraction"] = everything - steps["optics: camera equation, falloff"]
    steps["sensor: bands to channels"], currents = cpu_seconds(lambda: channel_currents(optical, model.cfa), arguments.repeats)

    def read(light: Any, time_s: float, number: int) -> Any:
        rng = stream(0, "sensor", number)
        return capture(light, model, time_s, rng=rng, fixed_pattern_rng=fixed_pattern_stream(model))

    steps["sensor: pixels, noise, ADC"], _ = cpu_seconds(lambda: read(currents, EXPOSURE_S, 0), arguments.repeats)
    whole, raw = cpu_seconds(
        lambda: expose(
            compute_irradiance(radiance, optics),
            model,
            FixedExposure(EXPOSURE_S),
            rng=stream(0, "sensor", 0),
            fixed_pattern_rng=fixed_pattern_stream(model),
        ),
        arguments.repeats,
    )
    sweep, _ = cpu_seconds(
        lambda: [read(currents, EXPOSURE_S * 2.0 ** (k / 2 - 2), k) for k in range(10)], max(1, arguments.repeats // 2)
    )
    print(f"radiance {ROWS} x {COLS} x {radiance.grid.count} -> raw {raw.rows} x {raw.cols}, median of {arguments.repeats}\n")
    for name, seconds in steps.items():
        print(f"{name:36s} {seconds:7.3f} CPU-s  {100 * seconds / whole:5.1f} %")
    ratio = ISETCAM_CPU_S / whole
    print(f"{'whole chain':36s} {whole:7.3f} CPU-s   (aim {AIM_CPU_S}; ISETCam about {ISETCAM_CPU_S:g}: {ratio:.0f} x)")
    print(f"{'one of ten exposures behind the lens':36s} {sweep / 10:7.3f} CPU-s   (aim {AIM_SWEEP_CPU_S})")
    if arguments.json:
        document = {"steps_cpu_s": steps, "whole_cpu_s": whole, "sweep_each_cpu_s": sweep / 10}
        arguments.json.write_text(json.dumps(document, indent=2) + "\n")


if __name__ == "__main__":
    main()
