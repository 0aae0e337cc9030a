"""Model files damaged at random, seeded: what ingestion must refuse or survive."""

from __future__ import annotations

import random
import re
import shutil
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

__all__ = ["KINDS", "Mutation", "MutationGround", "mutated"]

_NUMBER: Final = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_WILD_NUMBERS: Final = (
    b"0", b"-1", b"-0", b"NaN", b"-Infinity", b"1e400", b"1e-400", b"2147483647", b"4294967296", b"-9223372036854775808",
    b"18446744073709551616", b"99999999999999999999999999", b"0.5", b"true", b"null", b"[]", b'""',
)  # fmt: skip


def _flip(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    # Headers matter most: half of the changes go there.
    reach = len(changed) if rng.random() < 0.5 else min(len(changed), 512)
    for _ in range(rng.choice((1, 4, 32))):
        changed[rng.randrange(reach)] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _truncate(content: bytes, rng: random.Random) -> bytes:
    return content[: rng.randrange(len(content))]


def _swap(content: bytes, rng: random.Random) -> bytes:
    size = rng.choice((4, 64, 1024))
    if len(content) < 4 * size:
        return content[::-1]
    first, second = sorted(rng.sample(range(0, len(content) - size, size), 2))
    changed = bytearray(content)
    changed[first : first + size], changed[second : second + size] = (
        content[second : second + size],
        content[first : first + size],
    )
    return bytes(changed)


def _insert(content: bytes, rng: random.Random) -> bytes:
    where = rng.randrange(len(content))
    return content[:where] + rng.randbytes(rng.choice((1, 7, 300, 20_000))) + content[where:]


def _number(content: bytes, rng: random.Random) -> bytes:
    """Change numbers in the JSON of a GLB file, in text, or 32-bit words of anything else."""
    if content[:4] == b"glTF" and len(content) > 20:
        length = struct.unpack("<I", content[12:16])[0]
        text = _numbers_in_text(content[20 : 20 + length], rng)
        text += b" " * (-len(text) % 4)
        rest = content[20 + length :]
        return content[:8] + struct.pack("<II", 20 + len(text) + len(rest), len(text)) + content[16:20] + text + rest
    if b"\0" not in content[:4096]:
        return _numbers_in_text(content, rng)
    changed = bytearray(content)
    for _ in range(rng.choice((1, 4))):
        where = rng.randrange(max(len(changed) - 8, 1))
        word = rng.choice((b"\xff" * 8, b"\0" * 8, b"\xff\xff\xff\x7f", b"\0\0\xc0\x7f", b"\0\0\0\x80"))
        changed[where : where + len(word)] = word
    return bytes(changed)


def _numbers_in_text(text: bytes, rng: random.Random) -> bytes:
    places = list(_NUMBER.finditer(text))
    for place in sorted(rng.sample(places, min(rng.choice((1, 2, 5)), len(places))), key=lambda m: -m.start()):
        text = text[: place.start()] + rng.choice(_WILD_NUMBERS) + text[place.end() :]
    return text


KINDS: Final[dict[str, Callable[[bytes, random.Random], bytes]]] = {
    "bits flipped": _flip,
    "truncated": _truncate,
    "pieces swapped": _swap,
    "bytes inserted": _insert,
    "numbers changed": _number,
}


def mutated(content: bytes, kind: str, rng: random.Random) -> bytes:
    """Return a file's content damaged in one of the ways of `KINDS`."""
    return KINDS[kind](content, rng)


@dataclass(frozen=True, slots=True)
class Mutation:
    """One damaged file in its place among whole ones: the folder, the model to read, what was damaged, and how."""

    folder: Path
    main: str
    damaged: str
    kind: str


class MutationGround:
    """Copies of sample folders in which one file at a time is damaged.

    Parameters
    ----------
    samples
        (folder, models to read in it) to copy; nothing is changed there.
    scratch
        An empty folder for the copies.
    """

    def __init__(self, samples: list[tuple[Path, list[str]]], scratch: Path) -> None:
        self._targets: list[tuple[Path, str, str]] = []
        for number, (folder, mains) in enumerate(samples):
            copy = scratch / str(number)
            shutil.copytree(folder, copy)
            for file in copy.rglob("*"):
                file.chmod(0o755 if file.is_dir() else 0o644)
            copy.chmod(0o755)
            others = [f.relative_to(copy).as_posix() for f in copy.rglob("*") if f.is_file()]
            shared = sorted(set(others) - set(mains))
            # The models themselves half of the time, what they refer to the other half.
            self._targets += [(copy, main, main) for main in mains]
            self._targets += [(copy, main, other) for other in shared for main in mains[:1] if _worth_damaging(other)]

    def mutations(self, count: int, seed: int) -> Iterator[Mutation]:
        """Yield so many damaged files, one at a time: each is whole again when the next is asked for."""
        rng = random.Random(seed)
        mains = [target for target in self._targets if target[1] == target[2]]
        others = [target for target in self._targets if target[1] != target[2]]
        for number in range(count):
            folder, main, damaged = rng.choice(others if others and rng.random() < 0.35 else mains)
            kind = list(KINDS)[number % len(KINDS)]
            file = folder / damaged
            whole = file.read_bytes()
            file.write_bytes(mutated(whole, kind, rng))
            try:
                yield Mutation(folder, main, damaged, kind)
            finally:
                file.write_bytes(whole)


def _worth_damaging(name: str) -> bool:
    return Path(name).suffix.lower() in {".usd", ".usda", ".usdc", ".mtl", ".png", ".jpg", ".bin"}
