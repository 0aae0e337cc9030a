"""Licences as SPDX expressions: checked where somebody states one, so that a search by licence can rely on its spelling."""

from __future__ import annotations

from typing import Final

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from fullwell.core.errors import FieldError, nearest_names

__all__ = ["COMMON_LICENCES", "check_licence"]

COMMON_LICENCES: Final = (
    "CC0-1.0", "CC-BY-4.0", "CC-BY-3.0", "CC-BY-SA-4.0", "CC-BY-NC-4.0", "CC-BY-ND-4.0", "MIT", "Apache-2.0", "BSD-3-Clause",
    "BSD-2-Clause", "EPL-2.0", "GPL-2.0-or-later", "GPL-3.0-or-later", "LGPL-3.0-or-later", "MPL-2.0", "Unlicense", "ISC",
    "OFL-1.1", "ODbL-1.0", "WTFPL", "Zlib",
)  # fmt: skip
"""What models usually come under, for suggestions; every identifier of the SPDX list is accepted."""
MAX_CHARACTERS: Final = 200


def check_licence(text: str, *, path: str = "licence") -> str:
    """Return an SPDX expression in its canonical spelling, such as "CC0-1.0" or "MIT OR Apache-2.0".

    Terms of one's own are named "LicenseRef-" and a word. Raises FieldError, with the nearest identifiers, for anything else.
    """
    stripped = text.strip()
    try:
        if not stripped or len(stripped) > MAX_CHARACTERS:
            raise InvalidLicenseExpression
        return str(canonicalize_license_expression(stripped))
    except InvalidLicenseExpression:
        close = nearest_names(stripped, COMMON_LICENCES)
        hint = f" Did you mean {' or '.join(close)}?" if close else ""
        raise FieldError(
            f"{path} is {text[:80]!r}; must be an SPDX licence expression, such as CC0-1.0 or CC-BY-4.0, or LicenseRef- and a "
            f"name for other terms.{hint}",
            path=path,
            value=text[:80],
        ) from None
