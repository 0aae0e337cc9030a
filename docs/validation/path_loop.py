"""Validate the path loop against Mitsuba's integrator and pbrt-v4: rewrite the tables of path_loop.md, and its figure.

Run: python docs/validation/path_loop.py [--quick]

The scenes are those of tests/physics/render/agreement_scenes.py, here with more samples. The comparison with pbrt-v4 needs
FULLWELL_REFERENCE_DIR; without it, its table stays as it is. --quick takes the tests' samples. Needs matplotlib.
"""

from __future__ import annotations

import io
import json
import os
import sys
import time
from dataclasses import dataclass, replace
from importlib import util
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import stats

from fullwell.core import atomic_write
from fullwell.core.constants import NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import render_radiance
from fullwell.scene import Camera, Film, Lens, look_at

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "tests" / "physics" / "render"))
from agreement import Agreement, compare, mitsuba_image, our_image  # noqa: E402
from agreement_scenes import SCENES, Comparison  # noqa: E402

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

Array = NDArray[np.float64]
IMAGES = 4
SAMPLES, QUICK_SAMPLES = 256, 64
CORNELL_SAMPLES = 1024
BINS = np.linspace(-5, 5, 81).tolist()

SHOWN = {
    "diffuse_box": "diffuse box, area lamp",
    "mirror_ball": "mirror ball of uneven reflectance",
    "glass_ball": "smooth glass ball, caustic",
    "gold_block": "smooth gold",
    "rough_copper": "rough copper, α = 0.1",
    "plastic": "rough plastic, α = 0.2",
    "principled": "principled: half metal, coated",
    "frosted_glass": "rough glass, α = 0.3",
    "sphere_lamp": "sphere as lamp",
    "disk_and_cylinder_lamps": "disk and cylinder as lamps",
    "point_and_spot": "point and spot",
    "directional": "directional light",
    "constant_environment": "constant environment",
    "image_environment": "image environment",
    "many_lamps": "60 lamps",
    "textured_floor": "textured floor",
    "thin_lens": "thin lens, out of focus",
    "smooth_normals": "icosahedron with smooth normals",
    "ball_by_a_bulb": "ball close to a spherical lamp",
    "all_kinds_of_light": "point, directional, dome and bulb",
    "curved_textures": "textured ball, tube, disk, block",
    "bulb_in_glass": "lamp inside a glass ball",
}


@dataclass(frozen=True)
class Result:
    """One scene: how both agree, and our image."""

    agreement: Agreement
    picture: Array


def measured(comparison: Comparison) -> Result:
    ours = np.stack([our_image(comparison, seed) for seed in range(IMAGES)])
    theirs = np.stack([mitsuba_image(comparison, 100 + seed) for seed in range(IMAGES)])
    return Result(compare(ours, theirs), ours.mean(axis=0))


def scene_table(results: dict[str, Result]) -> str:
    lines = [
        "| scene | difference of the mean | standard error | worst band | error of a tile | worst tile | mean square |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, result in results.items():
        found = result.agreement
        lines.append(
            f"| {SHOWN[name]} | {100 * found.difference.mean():+.3f} % | {100 * found.error.mean():.3f} % "
            f"| {np.abs(found.means).max():.1f} | {100 * found.tile_error:.2f} % | {found.worst_tile:.1f} "
            f"| {found.squares.mean():.2f} |"
        )
    return "\n".join(lines)


def summary(results: dict[str, Result]) -> str:
    scores = np.concatenate([result.agreement.tiles[result.agreement.tiles != 0] for result in results.values()])
    limit = float(stats.norm.isf((1 - (1 - 1e-3) ** (1 / scores.size)) / 2))
    return (
        f"All {scores.size:,} scores together: root mean square {np.sqrt(np.mean(scores**2)):.3f}, "
        f"{100 * np.mean(np.abs(scores) > 2):.1f} % beyond 2 (4.6 % by chance), "
        f"{100 * np.mean(np.abs(scores) > 3):.2f} % beyond 3 (0.27 %), "
        f"the largest {np.abs(scores).max():.2f} (beyond {limit:.2f} once in a thousand times)."
    )


def cornell_table(folder: Path) -> str:
    """Return the comparison with the reference's block means (see tests/golden/render/test_cornell_radiance.py)."""
    spec = util.spec_from_file_location("cornell", ROOT / "tests" / "golden" / "render" / "test_cornell_radiance.py")
    assert spec is not None
    assert spec.loader is not None
    cornell = util.module_from_spec(spec)
    spec.loader.exec_module(cornell)
    numbers: dict[str, Any] = json.loads((folder / "render" / "cornell_scene.json").read_text())
    blocks: dict[str, Any] = json.loads((folder / "render" / "cornell_3000K_blocks.json").read_text())
    expected, expected_error = np.array(blocks["block_mean"]), np.array(blocks["block_standard_error"])
    focal_m, size, grid = 5e-3, 96, WavelengthGrid(400, 700, 10)
    lens = Lens("pinhole", focal_m, 4.0, np.inf, Spectrum.constant(1.0))
    pose = look_at(np.array([0, -3.9, 0]), np.zeros(3), np.array([0, 0, 1.0]))
    camera = Camera("main", pose, lens, Film(size, size, 2 * focal_m * np.tan(np.radians(39.3 / 2)) / size))
    scene, images = cornell.cornell_scene(numbers), []
    for seed in range(IMAGES):
        image, _ = render_radiance(scene, camera, grid, samples_per_pixel=CORNELL_SAMPLES // IMAGES, max_depth=8, seed=seed)
        watts = image.photons.astype(float) * PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M / grid.centres_nm
        images.append(watts.reshape(6, 16, 6, 16, grid.count).mean(axis=(1, 3)))
    ours, own_error = np.mean(images, axis=0), np.std(images, axis=0, ddof=1).mean() / np.sqrt(IMAGES)
    relative = ours / expected - 1
    scores = (ours - expected) / np.hypot(own_error, expected_error)
    return "\n".join(
        [
            "| Cornell box, 3000 K, 36 blocks × 31 bands | |",
            "| --- | --- |",
            f"| mean difference | {100 * relative.mean():+.3f} % |",
            f"| worst band, mean over blocks | {100 * np.abs(relative.mean(axis=(0, 1))).max():.2f} % |",
            f"| worst block, mean over bands | {100 * np.abs(relative.mean(axis=2)).max():.2f} % |",
            f"| root mean square of block bands | {100 * np.sqrt(np.mean(relative**2)):.2f} % |",
            f"| standard error of pbrt's numbers, of ours | {100 * np.mean(expected_error / expected):.2f} %, "
            f"{100 * own_error / expected.mean():.2f} % |",
            f"| root mean square of the scores | {np.sqrt(np.mean(scores**2)):.2f} |",
        ]
    )


def figure(results: dict[str, Result]) -> bytes:
    columns = 6
    rows = -(-len(results) // columns)
    drawing = plt.figure(figsize=(11, 1.65 * rows + 2.4))
    layout = drawing.add_gridspec(rows + 1, columns, height_ratios=[1.0] * rows + [1.6])
    for number, (name, result) in enumerate(results.items()):
        axes = drawing.add_subplot(layout[number // columns, number % columns])
        axes.imshow(_as_seen(result.picture))
        axes.set_title(SHOWN[name], fontsize=7)
        axes.axis("off")
    scores = np.concatenate([result.agreement.tiles[result.agreement.tiles != 0] for result in results.values()])
    axes = drawing.add_subplot(layout[rows, :])
    x = np.linspace(-5, 5, 201)
    axes.hist(
        scores, bins=np.linspace(-5, 5, 81).tolist(), density=True, color="0.75", label=f"{scores.size:,} tiles and bands"
    )
    axes.plot(x, stats.norm.pdf(x), "k-", lw=1, label="noise alone")
    axes.set(yscale="log", ylim=(1e-5, 1), xlim=(-5, 5), xlabel="difference / standard error")
    axes.legend(fontsize=8)
    drawing.tight_layout()
    drawn, packed = io.BytesIO(), io.BytesIO()
    drawing.savefig(drawn, dpi=110, metadata={"Software": None})
    plt.close(drawing)
    Image.open(drawn).convert("RGB").quantize(192, method=Image.Quantize.MEDIANCUT).save(packed, "PNG", optimize=True)
    return packed.getvalue()


def _as_seen(picture: Array) -> Array:
    """Return rough red, green and blue of ten bands from 420 to 690 nm: for orientation, not for measurement."""
    rgb = np.stack([picture[..., band].mean(axis=-1) for band in (slice(6, 9), slice(3, 6), slice(0, 3))], axis=-1)
    rgb = rgb / rgb.mean(axis=(0, 1))
    return np.asarray(np.clip(rgb / np.percentile(rgb, 97), 0, 1) ** (1 / 2.2))


def put(page: str, name: str, content: str) -> str:
    """Return the page with what stands between the comments of this name replaced."""
    start, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    before, rest = page.split(start)
    return f"{before}{start}\n{content}\n{end}{rest.split(end)[1]}"


def main(arguments: list[str]) -> None:
    quick = "--quick" in arguments
    results = {}
    for name, make in SCENES.items():
        started = time.perf_counter()
        results[name] = measured(replace(make(), samples=QUICK_SAMPLES if quick else SAMPLES))
        print(f"{name}: {time.perf_counter() - started:.0f} s", flush=True)
    tables = {"scenes": scene_table(results), "scores": summary(results)}
    folder = Path(os.environ.get("FULLWELL_REFERENCE_DIR", ROOT.parent / "shared" / "reference"))
    if (folder / "render" / "cornell_scene.json").is_file():
        tables["cornell"] = cornell_table(folder)
    print("\n\n".join(tables.values()))
    if quick:
        return
    target = HERE / "path_loop.md"
    page = target.read_text()
    for name, content in tables.items():
        page = put(page, name, content)
    atomic_write(target, page.encode())
    atomic_write(HERE / "figures" / "path_loop.png", figure(results))


if __name__ == "__main__":
    main(sys.argv[1:])
