"""A named collection that answers an unknown name with the nearest known one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

from fullwell.core.errors import FieldError, unknown_name_message

__all__ = ["Registry"]

T = TypeVar("T")


class Registry(Generic[T]):
    """Names to factories. Entries are made on first use; lookups ignore case."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._factories: dict[str, Callable[[], T]] = {}
        self._made: dict[str, T] = {}
        self._by_folded: dict[str, str] = {}

    def register(self, name: str, factory: Callable[[], T]) -> None:
        """Add an entry; registering a name twice is a programming error."""
        folded = name.casefold()
        if folded in self._by_folded:
            raise ValueError(f"{self._kind} {name!r} is registered twice")
        self._by_folded[folded] = name
        self._factories[name] = factory

    def get(self, name: str, *, path: str = "") -> T:
        """Return the entry, or raise FieldError that names the nearest known ones."""
        canonical = self._by_folded.get(name.casefold())
        if canonical is None:
            raise FieldError(unknown_name_message(self._kind, name, self._factories), path=path, value=name)
        if canonical not in self._made:
            self._made[canonical] = self._factories[canonical]()
        return self._made[canonical]

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name.casefold() in self._by_folded

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(self._factories))

    def __len__(self) -> int:
        return len(self._factories)
