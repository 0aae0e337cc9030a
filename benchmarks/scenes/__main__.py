"""Write scenes as recipes with their meshes, to render or to look at.

Run: python -m benchmarks.scenes OUT_FOLDER [--scene NAME] [--size 640x480] [--samples 32], then
fullwell render OUT_FOLDER/NAME/recipe.json
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.scenes import DEFAULT_SIZE, SCENES, write_recipe


def main() -> None:
    """Write what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scene", choices=sorted(SCENES), action="append")
    parser.add_argument("--size", default="x".join(map(str, DEFAULT_SIZE)), help="columns x rows")
    parser.add_argument("--samples", type=int)
    arguments = parser.parse_args()
    cols, rows = (int(text) for text in arguments.size.split("x"))
    for name in arguments.scene or SCENES:
        print(write_recipe(name, arguments.folder / name, size=(cols, rows), samples_per_pixel=arguments.samples))


if __name__ == "__main__":
    main()
