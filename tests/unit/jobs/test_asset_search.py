"""Searches agree with AssetQuery.matches, page by page, in every order; facets count what searches find."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fullwell.assets.query import REVIEW_STATES, AssetQuery
from fullwell.assets.records import LicenceRecord
from fullwell.core import FieldError
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.asset_records import AssetEntry, AssetOrder
from fullwell.jobs.database import Database
from fullwell.storage import LocalStore
from stored_assets import prepared_asset

ANY = AssetQuery(states=())
TITLES = ("Rote Straße", "Ünder the BRIDGE", "車 car", "a-b_c.d", "Oak%tree_", "x" * 190, "İstanbul tram", "1st 2nd")
CLASSES = ("car", "van", "tree", "bus")
TAGS = ("red", "blue", "old", "urban", "sedan")
LICENCES = ("MIT", "mit", "CC0-1.0", "CC-BY-4.0")
SIZES_M = (0.5, 1.0, 1.5, 4.0, 1e-3, 0.1 + 0.2)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetLibrary]:
    folder = tmp_path_factory.mktemp("assets")
    database = Database(f"sqlite:///{folder}/assets.sqlite3")
    database.upgrade()
    library = AssetLibrary(LocalStore(folder / "store"), database)
    fill(library)
    yield library
    database.close()


def fill(library: AssetLibrary) -> None:
    for index in range(40):
        manifest: dict[str, Any] = {
            "title": TITLES[index % len(TITLES)],
            "asset_class": CLASSES[index % len(CLASSES)],
            "tags": tuple(tag for position, tag in enumerate(TAGS) if (index >> position) & 1),
            "licence": LicenceRecord(LICENCES[index % 3 if index < 30 else 3], f"Autor {index % 7} & Söhne"),
            "size_m": (SIZES_M[index % 6], SIZES_M[index % 5], SIZES_M[index % 4]),
        }
        asset_id = f"{CLASSES[index % 4]}-{index:02d}.{TAGS[index % 5]}"
        library.add(prepared_asset(asset_id, str(index).encode(), **manifest), who="ada")
        if (decision := REVIEW_STATES[index % 3]) != "pending":
            library.review([asset_id], decision, who="cara", reason="so it is")
        if index % 8 == 0:
            library.edit([asset_id], who="cara", add_tags=("edited",), asset_class="lorry")
        if index % 11 == 3:
            library.add(prepared_asset(asset_id, b"newer", **manifest), who="ada")
        if index % 13 == 5:
            library.retire(asset_id, who="cara")


def everything(library: AssetLibrary) -> list[AssetEntry]:
    return list(library.search(ANY, limit=500).entries)


def subsets(values: tuple[Any, ...], most: int = 3) -> st.SearchStrategy[tuple[Any, ...]]:
    return st.lists(st.sampled_from(values), max_size=most, unique=True).map(tuple)


BOUND = st.none() | st.sampled_from(SIZES_M) | st.floats(0, 5)
SPAN = st.tuples(BOUND, BOUND).filter(lambda span: None in span or span[0] <= span[1])
WORDS = st.sampled_from(
    ("", "c", "ca", "car", "RED", "strasse", "STRASSE", "straße", "ünder", "under", "車", "söhne autor", "mit", "CC-BY", "cc 4")
    + ("oak%", "%", "_", "b_c", "1st", "x" * 120, "x" * 195, "i\u0307stanbul", "istanbul", "tram 3", "\U0010ffff", "'; drop")
) | st.text(max_size=4)
QUERIES = st.builds(
    AssetQuery,
    asset_class=st.sampled_from(("", "", *CLASSES, "lorry", "deer")),
    tags=subsets((*TAGS, "edited", "unused"), 2),
    without_tags=subsets((*TAGS, "edited", "unused"), 2),
    licences=subsets((*LICENCES, "Cc0-1.0", "GPL")),
    states=subsets(REVIEW_STATES),
    text=WORDS,
    length_m=SPAN,
    width_m=SPAN,
    height_m=SPAN,
    ids=subsets(("car-00.red", "van-01.blue", "tree-02.old", "bus-03.urban", "car-04.sedan", "nothing")),
)
SETTINGS = settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.slow
@SETTINGS
@given(query=QUERIES)
def test_a_search_finds_exactly_what_matches(library: AssetLibrary, query: AssetQuery) -> None:
    expected = [entry for entry in everything(library) if query.matches(entry.manifest, entry.state)]
    page = library.search(query, limit=500)
    assert list(page.entries) == expected
    assert page.total == len(expected)
    assert page.next_cursor == ""


@SETTINGS
@given(query=QUERIES)
def test_facets_count_what_another_choice_would_show(library: AssetLibrary, query: AssetQuery) -> None:
    entries = everything(library)

    def matching(**changes: Any) -> list[AssetEntry]:
        other = replace(query, **changes)
        return [entry for entry in entries if other.matches(entry.manifest, entry.state)]

    facets = library.facets(query)
    assert facets["class"] == Counter(entry.manifest.asset_class for entry in matching(asset_class=""))
    assert facets["state"] == Counter(entry.state for entry in matching(states=()))
    assert facets["tag"] == Counter(tag for entry in matching() for tag in entry.manifest.tags)
    licences = Counter(entry.manifest.licence.spdx.casefold() for entry in matching(licences=()))
    assert {name.casefold(): number for name, number in facets["licence"].items()} == licences


@pytest.fixture(scope="module")
def versions(library: AssetLibrary) -> list[tuple[AssetEntry, ...]]:
    return [library.versions(entry.id) for entry in everything(library)]


@SETTINGS
@given(query=QUERIES)
def test_draws_choose_from_the_newest_version_in_an_accepted_state(
    library: AssetLibrary, versions: list[tuple[AssetEntry, ...]], query: AssetQuery
) -> None:
    expected = []
    for entries in versions:
        accepted = [entry for entry in entries if not query.states or entry.state in query.states]
        if accepted and query.matches(accepted[0].manifest, accepted[0].state):
            expected.append((accepted[0].id, accepted[0].digest))
    assert library.candidates(query) == tuple(sorted(expected))


SORT_KEYS: dict[str, Any] = {
    "id": lambda entry: entry.id,
    "newest": lambda entry: (-entry.created_at, entry.id),
    "title": lambda entry: (entry.manifest.title.casefold(), entry.id),
    "class": lambda entry: (entry.manifest.asset_class, entry.id),
    "size": lambda entry: (-max(entry.manifest.size_m), entry.id),
    "triangles": lambda entry: (-entry.manifest.levels[0].triangles, entry.id),
}


@pytest.mark.parametrize("order", get_args(AssetOrder))
@pytest.mark.parametrize("limit", [1, 7, 35])
def test_pages_put_together_are_the_whole_in_order(library: AssetLibrary, order: AssetOrder, limit: int) -> None:
    found: list[AssetEntry] = []
    cursor, pages = "", 0
    while True:
        page = library.search(ANY, cursor=cursor, limit=limit, order=order)
        found += page.entries
        pages += 1
        assert page.total == len(everything(library))
        if not (cursor := page.next_cursor):
            break
    assert found == sorted(everything(library), key=SORT_KEYS[order])
    assert pages == math.ceil(len(found) / limit)


def test_pages_stay_in_place_when_assets_come_in_between(tmp_path: Path, database: Database) -> None:
    library = AssetLibrary(LocalStore(tmp_path / "store"), database)
    for name in ("b", "d", "f"):
        library.add(prepared_asset(name), who="ada")
    first = library.search(ANY, limit=2)
    for name in ("a", "e"):
        library.add(prepared_asset(name), who="ada")
    second = library.search(ANY, limit=2, cursor=first.next_cursor)
    assert [entry.id for entry in (*first.entries, *second.entries)] == ["b", "d", "e", "f"]


@pytest.mark.parametrize("cursor", ["x", "!!!!", "e30", "W10", "WyJpZCIsMSwyXQ", "bnVsbA", "WyJuZXdlc3QiLDEuMCwiYSJd", "é"])
def test_a_cursor_of_another_search_is_refused(library: AssetLibrary, cursor: str) -> None:
    with pytest.raises(FieldError, match="cursor"):
        library.search(ANY, cursor=cursor)


def test_limits_and_orders_are_checked(library: AssetLibrary) -> None:
    for limit in (0, -1, 501):
        with pytest.raises(FieldError, match="limit"):
            library.search(ANY, limit=limit)
    with pytest.raises(FieldError, match="order"):
        library.search(ANY, order="price")  # type: ignore[arg-type]
    with pytest.raises(FieldError, match="ids"):
        library.search(AssetQuery(ids=tuple(str(index) for index in range(10_001))))


def test_a_search_on_the_chosen_database_agrees_too(tmp_path: Path, database: Database) -> None:
    library = AssetLibrary(LocalStore(tmp_path / "store"), database)
    fill(library)
    entries = everything(library)
    for text in ("", "strasse", "車", "c", "cc 4", "%", "x" * 120, "\U0010ffff"):
        for query in (AssetQuery(text=text, states=()), AssetQuery("car", ("red",), ("old",), ("mit",), text=text)):
            expected = [entry.id for entry in entries if query.matches(entry.manifest, entry.state)]
            assert [entry.id for entry in library.search(query, limit=500).entries] == expected
    assert [entry.id for entry in entries] == sorted(entry.id for entry in entries)
