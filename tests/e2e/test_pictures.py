"""The script that makes the documentation's pictures runs, from the examples alone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from assets_in_memory import street_boxes
from fullwell.core.settings import load_settings
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.database import Database
from fullwell.storage import store_from_url

ROOT = Path(__file__).resolve().parents[2]


def fill_store(home: Path) -> None:
    """Put boxes for everything that streets are made of into the embedded asset store below `home`."""
    settings = load_settings(home=home)
    database = Database(settings.database)
    database.upgrade()
    library = AssetLibrary(store_from_url(settings.store), database)
    entries = [library.add(prepared, who="test") for prepared in street_boxes()]
    library.review([entry.id for entry in entries], "approved", who="test")
    database.close()


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_pictures_of_all_examples_can_be_made(tmp_path: Path) -> None:
    script = ROOT / "examples" / "make_pictures.py"
    home = tmp_path / "home"
    fill_store(home)
    command = [sys.executable, str(script), "--quick", str(tmp_path / "pictures")]
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, "FULLWELL_HOME": str(home)})
    tmp_path = tmp_path / "pictures"
    made = {path.name for path in tmp_path.iterdir()}
    shown = {path.name for path in (ROOT / "examples" / "pictures").iterdir()}
    assert shown <= made
    for name in made:
        with Image.open(tmp_path / name) as picture:
            assert picture.width > 1000
