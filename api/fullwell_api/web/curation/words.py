"""Numbers, times and names as the page tells them. No text of an asset is ever taken for markup."""

from __future__ import annotations

import time
from collections.abc import Sequence
from datetime import datetime
from typing import Any, Final

from fullwell.assets.records import Check, MaterialChoice
from fullwell.jobs.asset_records import AssetEntry

__all__ = [
    "CHECK_ICONS",
    "ORIGINS",
    "ago",
    "bytes_text",
    "card",
    "check_order",
    "class_text",
    "is_made_up",
    "metres_text",
    "moment",
    "picture",
    "short_size_text",
    "size_text",
    "turntable_pictures",
]

MINUTE_S: Final = 60
HOUR_S: Final = 3600
DAY_S: Final = 86_400

CHECK_ICONS: Final = {
    "ok": "o_check_circle",
    "mended": "o_build_circle",
    "warning": "o_warning_amber",
    "decide": "o_help_outline",
    "failed": "o_cancel",
}
ORIGINS: Final = {
    "generator": "chosen by its generator",
    "rule": "chosen by a rule for its name",
    "curator": "chosen by a curator",
    "upsampled": "made up from an sRGB colour",
    "texture": "made up from a texture",
}
_CONCERN: Final = ("failed", "decide", "warning", "mended", "ok")


def class_text(name: str) -> str:
    """Return an asset class for people."""
    return name.replace("_", " ")


def metres_text(value_m: float) -> str:
    """Return a length with three digits: 4.62, 12.3, 0.085."""
    return f"{value_m:.1f}" if value_m >= 10 else f"{value_m:.2f}" if value_m >= 0.1 else f"{value_m:.3f}"


def short_size_text(size_m: Sequence[float]) -> str:
    """Return extents with two digits, for small places: "4.6 × 1.8 × 1.4 m"."""
    digits = (0 if extent_m >= 10 else 1 if extent_m >= 1 else 2 for extent_m in size_m)
    return f"{' × '.join(f'{extent_m:.{count}f}' for extent_m, count in zip(size_m, digits, strict=True))} m"


def size_text(size_m: Sequence[float]) -> str:
    """Return extents as "4.62 × 1.80 × 1.44 m"."""
    return f"{' × '.join(metres_text(extent_m) for extent_m in size_m)} m"


def bytes_text(count: int) -> str:
    """Return a number of bytes in the unit that suits it."""
    value = float(count)
    for unit in ("B", "KiB", "MiB"):
        if value < 1024:
            return f"{value:.0f} {unit}" if unit == "B" or value >= 100 else f"{value:.1f} {unit}"
        value /= 1024
    return f"{value:.1f} GiB"


def ago(when_s: float, now_s: float | None = None) -> str:
    """Return how long ago a Unix time [s] was."""
    past_s = max(0.0, (time.time() if now_s is None else now_s) - when_s)
    if past_s < MINUTE_S:
        return "just now"
    for unit, seconds, next_seconds in (("minute", MINUTE_S, HOUR_S), ("hour", HOUR_S, DAY_S), ("day", DAY_S, 60 * DAY_S)):
        if past_s < next_seconds:
            count = int(past_s // seconds)
            return f"{count} {unit}{'' if count == 1 else 's'} ago"
    return moment(when_s)[:10]


def moment(when_s: float) -> str:
    """Return a Unix time [s] in full, in the service's time zone."""
    return f"{datetime.fromtimestamp(when_s).astimezone():%Y-%m-%d %H:%M:%S %Z}"


def picture(look_digest: str, name: str) -> str:
    """Return the address of a preview, below the page's own."""
    return f"pictures/{look_digest}/{name}.png"


def turntable_pictures(look_digest: str, names: Sequence[str]) -> list[str]:
    """Return the addresses of the views that are there, in order of turning."""
    views = sorted((name for name in names if name.startswith("view_")), key=lambda name: (len(name), name))
    return [picture(look_digest, name) for name in views]


def card(entry: AssetEntry) -> dict[str, Any]:
    """Return what the grid shows of an asset. Takes milliseconds for one of many parts: their digest is computed."""
    manifest = entry.manifest
    return {
        "id": entry.id,
        "title": manifest.title,
        "kind": class_text(manifest.asset_class),
        "size": short_size_text(manifest.size_m),
        "state": entry.state,
        "licence": manifest.licence.spdx,
        "decide": manifest.needs_decision and entry.state == "pending",
        "picture": picture(manifest.look_digest, "thumb"),
    }


def check_order(check: Check) -> int:
    """Return a sorting key: what concerns people most comes first."""
    return _CONCERN.index(check.state)


def is_made_up(choice: MaterialChoice) -> bool:
    """Return whether a material's spectrum is a guess from an sRGB colour."""
    return choice.origin in ("upsampled", "texture")
