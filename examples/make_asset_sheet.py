"""Make the contact sheet of the starter library: one rendered picture of each asset, by class.

Run: python examples/make_asset_sheet.py [FILE]   (default: docs/images/assets/contact_sheet.jpg). Takes the assets from this
machine's store: fullwell assets starter --approve --no-previews
"""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw, ImageFilter

from fullwell.assets.query import AssetQuery
from fullwell.assets.records import AssetManifest
from fullwell.core import atomic_write
from fullwell.core.settings import load_settings
from fullwell.dataset.drawing import BACKGROUND, FAINT, INK, font
from fullwell.pipeline import run_frame
from fullwell.pipeline.assets import CataloguedAssets, assets_of_settings
from fullwell.pipeline.previews import preview_recipe
from fullwell.schema import RecipeBuilder, load_recipe
from fullwell.storage import LocalStore

COLUMNS = 10
CELL_PX = (176, 132)
CAPTION_PX = 30


def main(arguments: list[str]) -> None:
    target = Path(arguments[0]) if arguments else Path(__file__).parents[1] / "docs/images/assets/contact_sheet.jpg"
    assets = assets_of_settings(load_settings())
    manifests = [assets.manifest(digest) for _, digest in assets.candidates(AssetQuery())]
    manifests.sort(key=lambda manifest: (manifest.asset_class, manifest.id))
    with tempfile.TemporaryDirectory() as folder:
        pictures = [(manifest, picture(manifest, assets, Path(folder))) for manifest in manifests]
    target.parent.mkdir(parents=True, exist_ok=True)
    buffer = io.BytesIO()
    sheet(pictures).save(buffer, "JPEG", quality=86)
    atomic_write(target, buffer.getvalue())
    print(f"{target}: {len(pictures)} assets in {len({manifest.asset_class for manifest, _ in pictures})} classes")


def picture(manifest: AssetManifest, assets: CataloguedAssets, folder: Path) -> Image.Image:
    """Return the first view of an asset's previews."""
    plain: dict[str, Any] = preview_recipe(manifest).plain()
    plain["cameras"] = plain["cameras"][:1]
    document = load_recipe(plain)
    store = LocalStore(folder)
    run_frame(document, 0, store, manifest.id, builder=RecipeBuilder(document, assets=assets))
    with Image.open(io.BytesIO(store.get(f"{manifest.id}/image.png"))) as image:
        return image.convert("RGB").filter(ImageFilter.MedianFilter(3)).resize(CELL_PX, Image.Resampling.LANCZOS)


def sheet(pictures: list[tuple[AssetManifest, Image.Image]]) -> Image.Image:
    """Return all pictures in rows, each with its id, class and size below."""
    pitch = (CELL_PX[0] + 8, CELL_PX[1] + CAPTION_PX + 8)
    canvas = Image.new("RGB", (COLUMNS * pitch[0] + 8, -(-len(pictures) // COLUMNS) * pitch[1] + 8), BACKGROUND)
    pen = ImageDraw.Draw(canvas)
    for number, (manifest, image) in enumerate(pictures):
        x, y = 8 + number % COLUMNS * pitch[0], 8 + number // COLUMNS * pitch[1]
        canvas.paste(image, (x, y))
        pen.text((x, y + CELL_PX[1] + 2), manifest.id[:26], fill=INK, font=font(12))
        size = " x ".join(f"{side:.3g}" for side in manifest.size_m)
        pen.text((x, y + CELL_PX[1] + 16), f"{manifest.asset_class}, {size} m", fill=FAINT, font=font(10))
    return canvas


if __name__ == "__main__":
    main(sys.argv[1:])
