"""Radiance images kept in memory between frames: a sweep over exposures or sensors renders once."""

from __future__ import annotations

from collections import OrderedDict

from fullwell.radiometry import RadianceImage
from fullwell.render import RenderStatistics

__all__ = ["RadianceCache"]

_MAX_BYTES = 1 << 30


class RadianceCache:
    """The most recently used radiance images by content key, up to `max_bytes`. Not for use by several threads at once."""

    def __init__(self, max_bytes: int = _MAX_BYTES) -> None:
        self._max_bytes = max_bytes
        self._entries: OrderedDict[str, tuple[RadianceImage, RenderStatistics]] = OrderedDict()

    def get(self, key: str) -> tuple[RadianceImage, RenderStatistics] | None:
        """Return the image of a key and what it took to render, or None."""
        entry = self._entries.get(key)
        if entry is not None:
            self._entries.move_to_end(key)
        return entry

    def put(self, key: str, image: RadianceImage, statistics: RenderStatistics) -> None:
        """Keep an image; the least recently used ones make room. One larger than the cache is not kept."""
        if image.photons.nbytes > self._max_bytes:
            return
        self._entries[key] = (image, statistics)
        self._entries.move_to_end(key)
        while sum(kept.photons.nbytes for kept, _ in self._entries.values()) > self._max_bytes:
            self._entries.popitem(last=False)
