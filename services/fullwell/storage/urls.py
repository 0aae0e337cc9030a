"""Stores from addresses: file:///path or s3://key:secret@host:port/bucket."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import SplitResult, parse_qsl, unquote, urlsplit

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.storage.local import LocalStore
from fullwell.storage.protocol import ObjectStore

__all__ = ["redacted_url", "store_from_url"]

_FORM = "file:///absolute/path or s3://KEY:SECRET@host:port/bucket?secure=0"
_OPTIONS = ("secure", "region", "public", "public_secure")
_TRUTH = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}


def store_from_url(url: str, path: str = "store_url") -> ObjectStore:
    """Return the store at an address; nothing is opened or written yet.

    Parameters
    ----------
    url
        ``file:///absolute/path`` or ``s3://KEY:SECRET@host:port/bucket``, with these options after a "?": secure (1, default,
        or 0 for plain HTTP), region (us-east-1), public (host:port that presigned URLs name), public_secure. Special
        characters in keys are percent-encoded.
    path
        The field that asked, for the error.

    Raises
    ------
    FieldError
        The address is not understood. The message never holds the secret.
    """
    scheme, separator, rest = url.partition("://")
    if separator and scheme.casefold() == "file":
        return LocalStore(_folder(rest, path))
    if separator and scheme.casefold() == "s3":
        return _s3_store(url, path)
    raise _not_understood(url, path, "it must start with file:// or s3://")


def redacted_url(url: str) -> str:
    """Return a store's address without its keys, for logs."""
    scheme, separator, rest = url.partition("://")
    if not separator:
        return "..."
    return f"{scheme}://***@{rest.rpartition('@')[2]}" if "@" in rest else url


def _folder(rest: str, path: str) -> Path:
    folder = unquote(rest.removeprefix("localhost"))
    if not folder.startswith("/") or "\0" in folder:
        raise _not_understood(f"file://{rest}", path, "the path must be absolute")
    return Path(folder)


def _s3_store(url: str, path: str) -> ObjectStore:
    from fullwell.storage.s3 import S3Store  # noqa: PLC0415 - the S3 client costs start-up time that folders do not need

    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        raise _not_understood(url, path, "host or port is malformed; percent-encode special characters of the keys") from None
    bucket = parts.path.strip("/")
    if not parts.hostname or not parts.username or not parts.password:
        raise _not_understood(url, path, "key, secret or host is missing")
    if not bucket or "/" in bucket:
        raise _not_understood(url, path, "it must name exactly one bucket")
    options = _options(parts, path)
    host = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    public_secure = options.get("public_secure")
    return S3Store(
        f"{host}:{port}" if port else host,
        unquote(parts.username),
        unquote(parts.password),
        bucket,
        secure=_truth("secure", options.get("secure", "1"), path),
        region=options.get("region", "us-east-1"),
        public_endpoint=options.get("public"),
        public_secure=None if public_secure is None else _truth("public_secure", public_secure, path),
    )


def _options(parts: SplitResult, path: str) -> dict[str, str]:
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    for name in options:
        if name not in _OPTIONS:
            raise FieldError(unknown_name_message("option of the store address", name, _OPTIONS), path=path, value=name)
    return options


def _truth(name: str, text: str, path: str) -> bool:
    if text.casefold() not in _TRUTH:
        raise FieldError(f"{name} is {text!r} in the store address; must be 0 or 1.", path=path, value=text)
    return _TRUTH[text.casefold()]


def _not_understood(url: str, path: str, reason: str) -> FieldError:
    shown = redacted_url(url)
    return FieldError(f"the store address {shown!r} is not understood: {reason}. Write {_FORM}.", path=path, value=shown)
