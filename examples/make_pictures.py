"""Make the pictures that stand beside the examples: one of all products, and for sweeps one of all frames.

Streets draw from this machine's asset store: fullwell assets starter --approve --no-previews

Run: python examples/make_pictures.py [--quick] [--only TEXT] [FOLDER]   (default: examples/pictures; --quick renders tiny ones)
"""

from __future__ import annotations

import io
import json
import sys
import tempfile
from pathlib import Path

from PIL import Image, ImageDraw

from fullwell.core import atomic_write
from fullwell.core.settings import load_settings
from fullwell.dataset.contact import picture_of_products
from fullwell.pipeline import LightCache, render_frame
from fullwell.pipeline.assets import assets_of_settings
from fullwell.schema import RecipeBuilder, load_recipe
from fullwell.schema.assets import asks_for_assets, pin_assets
from fullwell.storage import LocalStore

HERE = Path(__file__).parent
WIDTH_PX = 1212
"""Width of a picture on a documentation page."""

QUICK = {"quality": "{samples_per_pixel: 2}"}


def main(arguments: list[str]) -> None:
    quick = "--quick" in arguments
    only = arguments[arguments.index("--only") + 1] if "--only" in arguments else ""
    folders = [Path(word) for word in arguments if not word.startswith("--") and word != only]
    target = folders[0] if folders else HERE / "pictures"
    for recipe in sorted(HERE.glob("[0-9][0-9]_*.yaml")):
        if only in recipe.stem:
            make(recipe, target, overrides=QUICK if quick else {})


def make(recipe: Path, target: Path, *, overrides: dict[str, str]) -> None:
    """Render every frame of a recipe and write its pictures."""
    document, assets = load_recipe(recipe, overrides=overrides), None
    if asks_for_assets(document):
        assets = assets_of_settings(load_settings())
        document = pin_assets(document, assets)
    builder, cache = RecipeBuilder(document, base_dir=document.base_dir, assets=assets), LightCache()
    varied: list[dict[str, object]] = []
    with tempfile.TemporaryDirectory() as folder:
        store = LocalStore(Path(folder))
        for index in range(document.frame_count()):
            frame = builder.frame(index)  # one at a time: eight streets do not fit into the memory of a small machine
            render_frame(frame, store, f"{index}", cache=cache)
            varied.append(dict(frame.varied))
        first = {info.key.partition("/")[2]: store.get(info.key) for info in store.list("0/")}
        images = [Image.open(io.BytesIO(first_picture(store, f"{index}/"))) for index in range(len(varied))]
    save(picture_of_products(first, f"{document.name}, frame 0"), target / f"{recipe.stem}.png")
    if len(varied) > 1:
        save(strip(images, [caption_of(values, varied) for values in varied]), target / f"{recipe.stem}_frames.jpg")


def caption_of(values: dict[str, object], of_all: list[dict[str, object]]) -> str:
    """Return what a frame varies; of mappings the entries that are not the same in all frames."""
    words = []
    for path, value in values.items():
        if not str(value).startswith("{"):
            words.append(f"{path.rpartition('.')[2]} {value}")
            continue
        mappings = [json.loads(str(other[path])) for other in of_all]
        words += [f"{k} {v:g}" for k, v in json.loads(str(value)).items() if any(other.get(k) != v for other in mappings)]
    return ", ".join(words)


def first_picture(store: LocalStore, prefix: str) -> bytes:
    """Return the picture of a frame, of its first sensor by name where it has several."""
    return store.get(next(info.key for info in store.list(prefix) if info.key.endswith("image.png")))


def strip(images: list[Image.Image], captions: list[str]) -> bytes:
    """Return all frames side by side, four to a row, with what varies below each."""
    columns = min(4, len(images))
    cell_width = WIDTH_PX // columns
    cell_height = round(cell_width * images[0].height / images[0].width) + 22
    sheet = Image.new("RGB", (columns * cell_width, -(-len(images) // columns) * cell_height), "white")
    draw = ImageDraw.Draw(sheet)
    for number, (image, caption) in enumerate(zip(images, captions, strict=True)):
        x, y = number % columns * cell_width, number // columns * cell_height
        sheet.paste(image.convert("RGB").resize((cell_width - 8, cell_height - 26), Image.Resampling.LANCZOS), (x + 4, y + 2))
        draw.text((x + 6, y + cell_height - 20), caption, fill="black")
    buffer = io.BytesIO()
    sheet.save(buffer, "PNG")
    return buffer.getvalue()


def save(content: bytes, target: Path) -> None:
    """Write a picture at documentation size: diagrams as PNG with a palette, photographs as JPEG. The repository keeps it."""
    picture = Image.open(io.BytesIO(content)).convert("RGB")
    if picture.width > WIDTH_PX:
        picture = picture.resize((WIDTH_PX, round(picture.height * WIDTH_PX / picture.width)), Image.Resampling.LANCZOS)
    buffer = io.BytesIO()
    if target.suffix == ".jpg":
        picture.save(buffer, "JPEG", quality=88)
    else:
        picture.quantize(256, method=Image.Quantize.MEDIANCUT).save(buffer, "PNG", optimize=True)
    atomic_write(target, buffer.getvalue())
    print(target)


if __name__ == "__main__":
    main(sys.argv[1:])
