"""References: long runs that are kept by their digest and grow by passes with new seeds whenever there is time.

Run: python -m benchmarks.references --scene NAME --seconds 600 [--size 640x480] [--samples 64]
Kept in FULLWELL_BENCH_CACHE, by default ~/.cache/fullwell-bench.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.baselines import MitsubaPath
from benchmarks.engines import Budget, Engine
from benchmarks.measures import mean_relative_mse
from benchmarks.scenes import SCENES, build_frame
from fullwell.core.files import write_atomically
from fullwell.core.hashing import digest_of
from fullwell.core.rng import seed32
from fullwell.radiometry import RadianceImage
from fullwell.schema.frame import FrameDescription

__all__ = ["Reference", "extend_reference", "load_reference", "reference_folder", "reference_key"]

_FORMAT = 1
_SAVE_EVERY_S = 60.0
"""A crash loses the passes since the last save, never the file: it is renamed into place."""


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """The means of the even and of the odd passes, whose difference tells the reference's own error.

    Attributes
    ----------
    halves
        (2, rows, cols, bands) float32, photon radiance.
    passes
        Number of passes; pass p went into half p % 2 with the seed of its number.
    samples_per_pass, cpu_s
        Camera rays per pixel of one pass, and CPU-seconds so far.
    engine, frame_digest
        Who made it, and of what.
    """

    halves: NDArray[np.float32]
    passes: int
    samples_per_pass: float
    cpu_s: float
    engine: str
    frame_digest: str

    @property
    def image(self) -> NDArray[np.float32]:
        """(rows, cols, bands), the mean over all passes."""
        odd = self.passes // 2
        weights = np.array([self.passes - odd, odd], dtype=np.float64) / max(1, self.passes)
        return np.asarray(self.halves[0] * weights[0] + self.halves[1] * weights[1], dtype=np.float32)

    @property
    def samples(self) -> float:
        """Camera rays per pixel."""
        return self.passes * self.samples_per_pass

    def own_relative_mse(self) -> float:
        """Return an estimate of the mean relative square error of `image`: a quarter of that between its halves."""
        return mean_relative_mse(self.halves[0], self.halves[1]) / 4 if self.passes > 1 else float("inf")

    def radiance(self, frame: FrameDescription) -> RadianceImage:
        """Return the image as the frame's first camera sees it."""
        return RadianceImage(self.image, frame.grid, frame.cameras[0].camera.tangent_pitch)


def reference_folder() -> Path:
    """Return the folder of all references."""
    named = os.environ.get("FULLWELL_BENCH_CACHE", "").strip()
    return Path(named) if named else Path.home() / ".cache" / "fullwell-bench"


def reference_key(frame: FrameDescription, engine: Engine, samples_per_pass: int) -> str:
    """Return the digest that names a reference: recipe with the digests of its files, path length, engine and pass."""
    return digest_of([_FORMAT, frame.recipe_json, frame.index, engine.name, samples_per_pass])


def load_reference(frame: FrameDescription, engine: Engine, samples_per_pass: int) -> Reference | None:
    """Return the reference as far as it has come, or None."""
    path = _path(frame, engine, samples_per_pass)
    if not path.is_file():
        return None
    with np.load(path, allow_pickle=False) as held:
        told = json.loads(str(held["told"]))
        return Reference(halves=held["halves"], **told)


def _path(frame: FrameDescription, engine: Engine, samples_per_pass: int) -> Path:
    return reference_folder() / f"{frame.recipe_name}-{reference_key(frame, engine, samples_per_pass)[:24]}.npz"


def extend_reference(frame: FrameDescription, engine: Engine, *, seconds: float, samples_per_pass: int = 64) -> Reference:
    """Add passes until `seconds` of wall time are used up (at least one pass more), save now and then, and return the result.

    Pass p always has the same seed: what was made in two goes equals what was made in one.
    """
    until, saved = time.monotonic() + seconds, time.monotonic()
    reference = load_reference(frame, engine, samples_per_pass)
    while True:
        reference = _with_pass(reference, frame, engine, samples_per_pass)
        now = time.monotonic()
        if now >= until or now - saved > _SAVE_EVERY_S:
            _save(reference, _path(frame, engine, samples_per_pass))
            saved = now
        if now >= until:
            return reference


def _with_pass(reference: Reference | None, frame: FrameDescription, engine: Engine, samples_per_pass: int) -> Reference:
    """Return the reference with one pass more."""
    number = 0 if reference is None else reference.passes
    result = engine.render(frame, Budget(samples_per_pass, seed=seed32(frame.seed, "reference", number)))
    if reference is None:
        halves = np.stack([result.image, np.zeros_like(result.image)])
        return Reference(halves, 1, result.samples, result.cpu_s, engine.name, digest_of(frame.recipe_json))
    halves, half = reference.halves.copy(), number % 2
    halves[half] += (result.image - halves[half]) / np.float32(number // 2 + 1)
    return replace(reference, halves=halves, passes=number + 1, cpu_s=reference.cpu_s + result.cpu_s)


def _save(reference: Reference, path: Path) -> None:
    names = ("passes", "samples_per_pass", "cpu_s", "engine", "frame_digest")
    told = json.dumps({name: getattr(reference, name) for name in names})
    with write_atomically(path) as partial, partial.open("wb") as stream:
        np.savez(stream, halves=reference.halves, told=np.array(told))


def main() -> None:
    """Extend the references of the scenes asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", choices=sorted(SCENES), action="append")
    parser.add_argument("--seconds", type=float, default=60.0, help="wall time per scene")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--samples", type=int, default=64, help="camera rays per pixel of one pass")
    arguments = parser.parse_args()
    cols, rows = (int(text) for text in arguments.size.split("x"))
    for scene in arguments.scene or SCENES:
        with tempfile.TemporaryDirectory() as folder:
            frame = build_frame(scene, Path(folder), size=(cols, rows))
        reference = extend_reference(frame, MitsubaPath(), seconds=arguments.seconds, samples_per_pass=arguments.samples)
        told = f"{reference.samples:g} samples per pixel, {reference.cpu_s:.0f} CPU-s"
        print(f"{scene}: {told}, own relMSE {reference.own_relative_mse():.2e}", flush=True)


if __name__ == "__main__":
    main()
