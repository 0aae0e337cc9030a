"""Words in the names of parts: what "wheelFrontLeft_02" and "/car/geo/_8_windowMax" are about."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection

__all__ = ["has_words", "normal_word", "words_of"]

_LETTERS = re.compile(r"[^\W\d_]+")
_SHORTEST_START, _SHORTEST_END = 5, 6
"""Letters of a word that may be glued to another: "wheelfl" and "frontwindow" count, "entire" is no tire."""


def normal_word(word: str) -> str:
    """Return a word in lower case without its plural s."""
    folded = word.casefold()
    return folded[:-1] if len(folded) > 3 and folded.endswith("s") and not folded.endswith("ss") else folded


def words_of(name: str) -> tuple[str, ...]:
    """Return the words of a name, split at case, digits and punctuation, in lower case and without plural s."""
    return tuple(normal_word(piece) for letters in _LETTERS.findall(name) for piece in _humps(letters))


def has_words(words: Collection[str], wanted: str) -> bool:
    """Return whether all words of `wanted` are there, in any order; long ones may be the start or end of another."""
    return all(any(_is_word(word, normal_word(part)) for word in words) for part in wanted.split())


def _humps(letters: str) -> list[str]:
    """Return the pieces of camel case: "frontLight" are two, "LEDLamp" too."""
    starts = [
        place
        for place in range(1, len(letters))
        if letters[place].isupper()
        and (letters[place - 1].islower() or (place + 1 < len(letters) and letters[place + 1].islower()))
    ]
    return [letters[first:last] for first, last in itertools.pairwise([0, *starts, len(letters)])]


def _is_word(word: str, wanted: str) -> bool:
    if word == wanted:
        return True
    starts = len(wanted) >= _SHORTEST_START and word.startswith(wanted)
    return starts or (len(wanted) >= _SHORTEST_END and word.endswith(wanted))
