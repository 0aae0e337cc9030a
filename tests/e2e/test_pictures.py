"""The script that makes the documentation's pictures runs, from the examples alone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_pictures_of_all_examples_can_be_made(tmp_path: Path) -> None:
    script = ROOT / "examples" / "make_pictures.py"
    subprocess.run([sys.executable, str(script), "--quick", str(tmp_path)], check=True, capture_output=True)
    made = {path.name for path in tmp_path.iterdir()}
    shown = {path.name for path in (ROOT / "examples" / "pictures").iterdir()}
    assert shown <= made
    for name in made:
        with Image.open(tmp_path / name) as picture:
            assert picture.width > 1000
