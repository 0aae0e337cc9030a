"""Addresses of the curation page: what a link says is what is searched for, whatever people do to it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fullwell.assets.classes import ASSET_CLASSES
from fullwell_api.web.curation.addresses import View, parse_view

ORDERS = ("newest", "title", "size")

sizes = st.one_of(st.none(), st.floats(0, 500).map(lambda value: float(f"{value:g}")))
spans = st.tuples(sizes, sizes).filter(lambda span: None in span or span[0] <= span[1])
tags = st.lists(st.from_regex(r"[a-z0-9][a-z0-9_-]{0,8}", fullmatch=True), max_size=4, unique=True)
words = st.text(st.characters(exclude_categories=("Cs", "Cc")), max_size=20)
views = st.builds(
    View,
    state=st.sampled_from(("", "all", "pending", "approved", "rejected")),
    asset_class=st.sampled_from(("", *ASSET_CLASSES)),
    tags=tags.map(lambda names: tuple(sorted(names))),
    licences=st.lists(words.filter(bool), max_size=3, unique=True).map(lambda names: tuple(sorted(names))),
    text=words.map(str.strip),
    length=spans,
    width=spans,
    height=spans,
    order=st.sampled_from(("", *ORDERS)),
    asset=st.sampled_from(("", "sedan-01", "a.b_c")),
    version=st.integers(0, 10**7),
    compare=st.integers(0, 10**7),
)


@given(views)
def test_a_view_survives_its_address(view: View) -> None:
    assert parse_view(view.address(), ORDERS) == view


@given(st.text(max_size=200))
def test_any_query_string_gives_a_view_that_can_be_searched(query: str) -> None:
    parse_view(query, ORDERS).query()


@pytest.mark.parametrize(
    "query",
    [
        "class=carr",
        "tag=No+Tag",
        "state=waiting",
        "sort=shoe-size",
        "asset=../../etc/passwd",
        "version=-1",
        "version=%F0%9D%9F%99",
        "compare=1e3",
        "length=9:1",
        "height=nan:inf",
        "width=-3:",
    ],
)
def test_what_makes_no_sense_is_left_out(query: str) -> None:
    assert parse_view(query, ORDERS) == View()


def test_an_empty_view_has_no_query_string() -> None:
    assert View().address() == ""


def test_states_other_than_the_three_ask_for_any() -> None:
    assert View(state="all").query().states == ()
    assert View(state="pending").query().states == ("pending",)


def test_a_choice_made_twice_is_taken_back() -> None:
    view = View(tags=("red",))
    assert view.toggled("tag", "old").tags == ("old", "red")
    assert view.toggled("tag", "red") == View()
    assert view.toggled("class", "car").toggled("class", "van").asset_class == "van"
    assert view.toggled("licence", "MIT").toggled("licence", "MIT") == view


def test_opening_another_asset_forgets_the_version_looked_at() -> None:
    view = View(state="pending", asset="a", version=3, compare=1)
    assert view.opened("b") == View(state="pending", asset="b")


def test_state_and_open_asset_are_no_filters() -> None:
    assert not View(state="pending", order="size", asset="a", version=2).is_filtered
    assert View(length=(None, 3.0)).is_filtered
    assert not View(text="x", state="rejected").unfiltered().is_filtered
