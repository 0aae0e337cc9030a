"""Write isetcam_golden.md: per file of ISETCam's reference numbers, the values compared and the largest difference.

Run: python docs/validation/isetcam_golden.py   (FULLWELL_REFERENCE_DIR names the folder of reference numbers)
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from fullwell.core import atomic_write

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from isetcam_comparisons import COMPARISONS, DARK_FLOOR, GOLDEN_TOLERANCE, STANDARD_ERRORS, Comparison  # noqa: E402

HEAD = f"""# ISETCam's numbers in compatibility mode

Written by `python docs/validation/isetcam_golden.py`; `tests/golden/test_isetcam_files.py` holds every row to its limit. The
numbers were made by ISETCam of 2021-06-05 (Stanford University, MIT licence) in double precision.

A difference is relative to the value itself, or to {DARK_FLOOR:g} of its array's maximum where the value is smaller than
that: a Fourier transform rounds to a share of the maximum. Limit: {GOLDEN_TOLERANCE:g}. Statistics of random values are
compared in standard errors of the difference, both samples counted. Limit: {STANDARD_ERRORS:g}. Last digits depend on the
processor.

| File | Values | Largest difference | Statistics | Most standard errors |
| --- | ---: | ---: | ---: | ---: |
"""

MISSING = (
    (
        "spectra",
        "`constants.k_J_K`",
        "not used: ISETCam's Planck's law has c2 = 1.438786e-2 m K of its own (`scene_uniform.json`)",
    ),
    ("spectra", "absolute scale of illuminants", "every scene is scaled to its luminance; compared relative to 560 nm"),
    ("spectra", "`display_white_xyz`", "used by the metrics' tests only"),
    ("ip_demosaic", "adaptive Laplacian, GBRG", "ISETCam stops with an error; refused here"),
    ("sensor_noise_stats", "`out_min`, `out_max`, `min_V`, `max_V`", "extremes of random draws have no limit worth testing"),
    ("metrics_color", "`pixel_V_per_lux_s`, `psnr`", "the scene and the pictures they were made from are not stated"),
    ("metrics_color", "`lab1_makecform`", "from a colour library with rounded constants; see the metrics' own tests"),
    (
        "edge_cases",
        "NaN, Inf and errors",
        "refused: one-pixel scene, zero luminance scaled to 100, automatic exposure of black",
    ),
    ("edge_cases", "means with noise at irradiance 0 and 10", "the number of pixels is not stated; taken as 256"),
    ("edge_cases", "`zero_exposure_time`", "its time carries read noise; compared within that of a pixel"),
)


def row(name: str, found: Comparison) -> str:
    """Return a line of the table."""
    largest = f"{found.largest:.1e}" if found.values else ""
    errors = f"{found.most_errors:.1f}" if found.statistics else ""
    return f"| `{name}.json` | {found.values} | {largest} | {found.statistics or ''} | {errors} |\n"


def main() -> None:
    """Compare every file and write the table beside this script."""
    folder = Path(os.environ.get("FULLWELL_REFERENCE_DIR", ROOT.parent / "shared" / "reference"))

    def read(name: str) -> Any:
        return json.loads((folder / name).read_text(encoding="utf-8"))

    rows = [row(name, compare(read)) for name, compare in COMPARISONS.items()]
    missing = "\n## What is not compared\n\n| File | Key | Why |\n| --- | --- | --- |\n"
    missing += "".join(f"| {file} | {key} | {why} |\n" for file, key, why in MISSING)
    atomic_write(Path(__file__).with_suffix(".md"), (HEAD + "".join(rows) + missing).encode())


if __name__ == "__main__":
    main()
