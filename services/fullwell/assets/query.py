"""What a search for assets, or a draw by a recipe, asks for."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

from fullwell.assets.classes import asset_class
from fullwell.assets.records import AssetManifest, check_tags
from fullwell.core.errors import FieldError
from fullwell.core.hashing import canonical_json

__all__ = ["REVIEW_STATES", "AssetQuery", "ReviewState"]

ReviewState = Literal["pending", "approved", "rejected"]
REVIEW_STATES: tuple[ReviewState, ...] = ("pending", "approved", "rejected")

Span = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class AssetQuery:
    """Conditions that all must hold; empty ones hold always.

    Attributes
    ----------
    asset_class
        A class.
    tags, without_tags
        All of these, none of those.
    licences
        One of these SPDX expressions, letter case ignored.
    states
        One of these review states; empty for any.
    text
        Words that must all begin a word of id, title, class, tags, licence or attribution, letter case ignored.
    length_m, width_m, height_m
        (least, most) extents along x, y, z [m], None for no bound.
    ids
        One of these assets.
    """

    asset_class: str = ""
    tags: tuple[str, ...] = ()
    without_tags: tuple[str, ...] = ()
    licences: tuple[str, ...] = ()
    states: tuple[ReviewState, ...] = ("approved",)
    text: str = ""
    length_m: Span = (None, None)
    width_m: Span = (None, None)
    height_m: Span = (None, None)
    ids: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.asset_class:
            asset_class(self.asset_class, path="class")
        object.__setattr__(self, "tags", check_tags(self.tags))
        object.__setattr__(self, "without_tags", check_tags(self.without_tags, path="without_tags"))
        for state in self.states:
            if state not in REVIEW_STATES:
                raise FieldError(f"state is {state!r}; must be one of {', '.join(REVIEW_STATES)}.", path="state", value=state)
        for name in ("length_m", "width_m", "height_m"):
            low, high = getattr(self, name)
            if low is not None and high is not None and low > high:
                raise FieldError(f"{name} is [{low:g}, {high:g}]; the first must not be above the second.", path=name)

    @property
    def key(self) -> str:
        """Canonical text: equal queries, equal keys. Recipes keep their pins under it."""
        return canonical_json(asdict(self)).decode()

    def matches(self, manifest: AssetManifest, state: ReviewState) -> bool:
        """Return whether a version of an asset meets all conditions: what a catalogue's search must agree with."""
        words = _words(
            " ".join(
                (manifest.id, manifest.title, manifest.asset_class, *manifest.tags)
                + (manifest.licence.spdx, manifest.licence.attribution)
            )
        )
        spans = zip((self.length_m, self.width_m, self.height_m), manifest.size_m, strict=True)
        return (
            (not self.asset_class or manifest.asset_class == self.asset_class)
            and set(self.tags) <= set(manifest.tags)
            and not set(self.without_tags) & set(manifest.tags)
            and (not self.licences or manifest.licence.spdx.casefold() in {name.casefold() for name in self.licences})
            and (not self.states or state in self.states)
            and all(any(word.startswith(wanted) for word in words) for wanted in _words(self.text))
            and all((low is None or size >= low) and (high is None or size <= high) for (low, high), size in spans)
            and (not self.ids or manifest.id in self.ids)
        )


def _words(text: str) -> list[str]:
    return "".join(character if character.isalnum() else " " for character in text.casefold()).split()
