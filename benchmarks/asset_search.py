"""How long searches, facets and changes take in a catalogue of 10,000 assets, on SQLite or the database of an address.

    python -m benchmarks.asset_search [--assets 10000] [--repeats 15] [--database URL] [--no-page]

Fills a new catalogue, times about twenty kinds of questions warm, then additions and decisions, and puts the tables into
docs/assets-store.md. A database that is named must be empty but for the schema.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np

from benchmarks.results import fill_page, markdown_table, number
from fullwell.assets.classes import ASSET_CLASSES
from fullwell.assets.query import AssetQuery, ReviewState
from fullwell.assets.records import (
    AssetManifest,
    Check,
    LevelRecord,
    LicenceRecord,
    MaterialChoice,
    PartRecord,
    PreparedAsset,
    SourceRecord,
)
from fullwell.assets.store import blob_key
from fullwell.core import canonical_json, sha256_hex
from fullwell.core.rng import stream
from fullwell.jobs.asset_files import AssetFile
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.asset_records import AssetOrder
from fullwell.jobs.database import Database
from fullwell.storage import LocalStore

PAGE = Path(__file__).resolve().parents[1] / "docs" / "assets-store.md"
LIMIT_MS = 50.0

COLOURS = ("red", "blue", "white", "black", "silver", "green", "grey", "beige", "yellow", "orange")
KINDS = ("old", "modern", "clean", "dirty", "urban", "rural", "summer", "winter", "small", "large")
MAKERS = [f"maker-{index}" for index in range(60)]
LICENCES = ("CC0-1.0", "CC-BY-4.0", "MIT", "Apache-2.0", "CC-BY-SA-4.0", "EPL-2.0")
STATES: tuple[ReviewState, ...] = ("pending", "approved", "rejected")
ANY = AssetQuery(states=())

Question = Callable[[], Any]


def manifest_of(index: int, rng: np.random.Generator) -> AssetManifest:
    """Return a manifest as ingestion makes them: three levels, a dozen parts, eight checks, six tags."""
    name = sorted(ASSET_CLASSES)[int(rng.integers(len(ASSET_CLASSES)))]
    kind = ASSET_CLASSES[name]
    size_m = tuple(float(rng.uniform(low, high)) for low, high in (kind.length_m, kind.width_m, kind.height_m))
    tags = (str(rng.choice(COLOURS)), *(str(tag) for tag in rng.choice(KINDS, 3, replace=False)), str(rng.choice(MAKERS)))
    licence = str(rng.choice(LICENCES))
    shape = sha256_hex(f"level {index}".encode())
    parts = tuple(
        PartRecord(f"part_{number}", 900, 1.5, MaterialChoice("rule", "paint/red"), paintable=number == 0)
        for number in range(12)
    )
    checks = tuple(Check(f"check {number}", "ok", "All is as it should be here.", {"value": 1.0}) for number in range(8))
    return AssetManifest(
        id=f"{name}-{tags[0]}-{index:05d}",
        title=f"{tags[0].title()} {name.replace('_', ' ')} number {index} in the style of {tags[-1]}",
        asset_class=name,
        tags=tags,
        size_m=(size_m[0], size_m[1], size_m[2]),
        levels=tuple(LevelRecord(10_000 // 4**level, shape, 100_000 // 4**level, 0.002 * level) for level in range(3)),
        parts=parts,
        licence=LicenceRecord(licence, f"Author {index % 97} of {tags[-1]}", f"https://example.org/{index}"),
        source=SourceRecord("generator", "benchmark", parameters={"seed": index, "height_m": size_m[2]}),
        attributes={"front_overhang_m": 0.8},
        checks=checks,
    )


def files_of(count: int) -> Iterator[tuple[AssetManifest, list[AssetFile]]]:
    """Yield assets and their files: each is imported, three in four are decided about, one in five is edited later."""
    rng = stream(5, "asset search benchmark")
    for index in range(count):
        manifest, micros = manifest_of(index, rng), 1_700_000_000_000_000 + index * 1_000_000
        files = [AssetFile.of_version(manifest.id, 1, line=1, digest=manifest.digest, who="importer", micros=micros)]
        decision = STATES[int(rng.choice(3, p=(0.25, 0.65, 0.1)))]
        if decision != "pending":
            files.append(
                AssetFile.of_event(manifest.id, 1, line=1, kind=decision, who="curator", micros=micros + 10, detail="looked at")
            )
        yield manifest, files
        if index % 5 == 0:
            edited = manifest.with_changes(tags=(*manifest.tags, "checked"))
            yield (
                edited,
                [AssetFile.of_version(manifest.id, 2, line=1, digest=edited.digest, who="curator", micros=micros + 20)],
            )


def fill(store: LocalStore, count: int) -> None:
    """Write version and event files with their manifests; the level files are not read by any search."""
    for manifest, files in files_of(count):
        store.put(blob_key(manifest.digest), canonical_json(manifest.document()))
        for file in files:
            store.put(file.key, file.content())


def questions(library: AssetLibrary) -> dict[str, Question]:
    """Return what is timed, by what it is called in the table."""
    last = ""
    for _ in range(max(library.search(ANY, limit=50).total // 50 - 1, 0)):
        last = library.search(ANY, cursor=last, limit=50).next_cursor

    first = library.search(ANY, limit=1).entries[0].id

    def search(query: AssetQuery, **named: Any) -> Question:
        return lambda: library.search(query, **named)

    by_order = {f"all, by {order}": search(ANY, order=order) for order in get_args(AssetOrder)}
    narrow = AssetQuery("car", ("red", "urban"), ("dirty",), ("cc0-1.0", "mit"), ("approved",), "maker", (3.0, 5.0))
    return {
        **by_order,
        "all, last page": search(ANY, cursor=last),
        "all, 500 on the page": search(ANY, limit=500),
        "approved": search(AssetQuery()),
        "class": search(AssetQuery("tree", states=())),
        "one tag": search(AssetQuery(tags=("red",), states=())),
        "three tags": search(AssetQuery(tags=("red", "urban", "old"), states=())),
        "without two tags": search(AssetQuery(without_tags=("red", "urban"), states=())),
        "licence": search(AssetQuery(licences=("mit", "cc0-1.0"), states=())),
        "size": search(AssetQuery(length_m=(1.0, 4.0), height_m=(1.0, None), states=())),
        "text, one letter": search(AssetQuery(text="a", states=())),
        "text, two words": search(AssetQuery(text="red build", states=())),
        "text, three words, newest": search(AssetQuery(text="number style maker", states=()), order="newest"),
        "text that nothing has": search(AssetQuery(text="zeppelin", states=())),
        "a thousand ids": search(AssetQuery(ids=tuple(f"car-red-{index:05d}" for index in range(1000)), states=())),
        "everything at once": search(narrow),
        "facets of all": lambda: library.facets(ANY),
        "facets of approved": lambda: library.facets(AssetQuery()),
        "facets of a text": lambda: library.facets(AssetQuery(text="a", states=())),
        "facets of everything at once": lambda: library.facets(narrow),
        "candidates of a class": lambda: library.candidates(AssetQuery("car")),
        "candidates of all": lambda: library.candidates(AssetQuery()),
        "one asset": lambda: library.get(first),
        "an unknown asset": lambda: _failing(lambda: library.get("car-rad-00100")),
    }


def _failing(question: Question) -> None:
    try:
        question()
    except Exception:
        return
    raise AssertionError("the question should have failed")


def timed_ms(question: Question) -> tuple[float, float]:
    """Return the time and the processor time that a question takes [ms]."""
    started, cpu_started = time.perf_counter(), time.process_time()
    question()
    return 1e3 * (time.perf_counter() - started), 1e3 * (time.process_time() - cpu_started)


def changes(library: AssetLibrary) -> dict[str, list[tuple[float, float]]]:
    """Return the times and processor times of changes [ms], in the full catalogue."""
    rng = stream(6, "asset search benchmark")
    prepared = []
    for index in range(100):
        content = f"level {index}".encode() * 8000
        digest = sha256_hex(content)
        levels = (LevelRecord(10_000, digest, len(content)),)
        manifest = manifest_of(index, rng).with_changes(id=f"added-{index:03d}", levels=levels)
        prepared.append(PreparedAsset(manifest, {digest: content}))
    added = [timed_ms(lambda asset=asset: library.add(asset, who="importer")) for asset in prepared]  # type: ignore[misc]
    again = [timed_ms(lambda asset=asset: library.add(asset, who="importer")) for asset in prepared]  # type: ignore[misc]
    ids = [asset.manifest.id for asset in prepared]
    return {
        "add one asset with a level of 64 kB": added,
        "add what is there already": again,
        "approve one": [timed_ms(lambda: library.review(ids[:1], "approved", who="curator", reason="good"))],
        "approve 100 in one call": [timed_ms(lambda: library.review(ids, "approved", who="curator", reason="fine"))],
        "tag 100 in one call": [timed_ms(lambda: library.edit(ids, who="curator", add_tags=("seen",)))],
    }


def table_of(times: dict[str, list[tuple[float, float]]], what: str) -> str:
    """Return a table of medians and worst cases [ms]."""
    rows = [
        [name, *(number(of([wall_ms for wall_ms, _ in pairs])) for of in (statistics.median, max))]
        + [number(statistics.median([cpu_ms for _, cpu_ms in pairs]))]
        for name, pairs in times.items()
    ]
    return markdown_table([what, "median [ms]", "worst [ms]", "processor, median [ms]"], rows)


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--assets", type=int, default=10_000)
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--database", default="")
    parser.add_argument("--no-page", action="store_true", help="print only")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        store = LocalStore(Path(folder) / "store")
        database = Database(options.database or f"sqlite:///{folder}/catalogue.sqlite3")
        database.upgrade()
        library = AssetLibrary(store, database)
        fill(store, options.assets)
        reindexing = [timed_ms(library.reindex)]
        asked = {}
        for name, question in questions(library).items():
            question()
            asked[name] = [timed_ms(question) for _ in range(options.repeats)]
        changed = changes(library)
        changed["collect garbage, dry run"] = [timed_ms(lambda: library.collect_garbage(dry_run=True, min_age_s=0.0))]
        changed["reindex all from the object store"] = reindexing
        database.close()
    tables = {"searches": table_of(asked, "question"), "changes": table_of(changed, "change")}
    for name, table in tables.items():
        print(table, end="\n\n")
        if not options.no_page:
            fill_page(PAGE, name, table)
    over = [name for name, pairs in asked.items() if statistics.median([wall_ms for wall_ms, _ in pairs]) > LIMIT_MS]
    print(f"Over {LIMIT_MS:g} ms: {', '.join(over) or 'none'}.")


if __name__ == "__main__":
    main()
