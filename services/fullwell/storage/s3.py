"""An S3 server as object store, through the minio client."""

from __future__ import annotations

import contextlib
import io
import threading
import uuid
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, BinaryIO
from urllib.parse import parse_qs, urlsplit

import urllib3
from minio import Minio
from minio.deleteobjects import DeleteObject
from minio.error import InvalidResponseError, MinioException, S3Error, ServerError
from urllib3.util import Retry, Timeout

from fullwell.core.errors import ConflictError, FieldError, FullwellError, NotFoundError, StorageError
from fullwell.core.files import write_atomically
from fullwell.storage.protocol import CHUNK_BYTES, ObjectInfo, check_key, check_prefix, guess_content_type, reading

__all__ = ["S3Store"]

CONNECT_TIMEOUT_S = 3.0
READ_TIMEOUT_S = 60.0
PART_BYTES = 16 << 20
MAX_PRESIGNED_S = 7 * 24 * 3600

_ABSENT = frozenset({"NoSuchKey", "NoSuchBucket", "NoSuchObject", "NoSuchVersion"})
_CONFLICT = frozenset({"PreconditionFailed", "ConditionalRequestConflict"})
_FOLDER_CONFLICT = frozenset(
    {"ObjectParentIsFile", "ExistingObjectIsDirectory", "XMinioParentIsObject", "XMinioObjectExistsAsDirectory"}
)
_REFUSED = frozenset({"AccessDenied", "SignatureDoesNotMatch", "InvalidAccessKeyId", "InvalidAccessKey", "InvalidToken"})
_WRITER = "writer"


class _CreatingPool(urllib3.PoolManager):
    """Sends ``If-None-Match: *`` with the request that makes an object appear: the client library has no such argument.

    That is the PUT of a whole object, or the POST that completes a multipart upload, never the PUT of a part. The header is
    not signed, which S3 allows for all but ``x-amz-`` headers.
    """

    def urlopen(self, method: str, url: str, redirect: bool = True, **kw: Any) -> Any:  # type: ignore[override]
        query = parse_qs(urlsplit(url).query, keep_blank_values=True)
        creates = (method == "PUT" and "partNumber" not in query) or (method == "POST" and "uploadId" in query)
        if creates:
            headers = urllib3.HTTPHeaderDict(kw.get("headers") or {})
            headers["If-None-Match"] = "*"
            kw["headers"] = headers
        return super().urlopen(method, url, redirect, **kw)


class S3Store:
    """Objects in one bucket of an S3 server. The bucket is made on the first write where it is missing.

    Parameters
    ----------
    endpoint
        host or host:port, without a scheme.
    access_key, secret_key
        Neither is ever part of a message or of the representation.
    bucket
        Its name.
    secure
        Whether to speak HTTPS.
    region
        For signatures.
    public_endpoint
        What presigned URLs name, where clients reach the server by another name than this process.
    public_secure
        Whether presigned URLs are HTTPS; as `secure` where not given.
    """

    def __init__(
        self,
        endpoint: str,
        access_key: str,
        secret_key: str,
        bucket: str,
        *,
        secure: bool = True,
        region: str = "us-east-1",
        public_endpoint: str | None = None,
        public_secure: bool | None = None,
    ) -> None:
        self.endpoint, self.bucket, self.secure, self.region = endpoint, bucket, secure, region

        def client(host: str, pool: urllib3.PoolManager, https: bool) -> Minio:
            return Minio(host, access_key, secret_key, secure=https, region=region, http_client=pool)

        try:
            self._client = client(endpoint, urllib3.PoolManager(**_pool_options()), secure)
            self._creator = client(endpoint, _CreatingPool(**_pool_options()), secure)
            public_https = secure if public_secure is None else public_secure
            self._public = client(public_endpoint or endpoint, urllib3.PoolManager(), public_https)
        except ValueError as error:
            raise FieldError(
                f"the S3 endpoint {endpoint!r} is not usable: {error}. Write host or host:port.",
                path="store_url",
                value=endpoint,
            ) from None
        self._bucket_lock = threading.Lock()
        self._bucket_seen = False

    def __repr__(self) -> str:
        return f"S3Store({self._address()!r}, bucket={self.bucket!r})"

    def put(
        self, key: str, content: bytes | BinaryIO, content_type: str | None = None, *, if_absent: bool = False
    ) -> ObjectInfo:
        """Store `content`; see ObjectStore.put. Streams and large contents go up in parts of 16 MiB."""
        check_key(key)
        self._ensure_bucket()
        kind = content_type or guess_content_type(key)
        if isinstance(content, bytes | bytearray | memoryview):
            source: BinaryIO = io.BytesIO(content)
            length, part_size = len(content), PART_BYTES
        else:
            source, length, part_size = content, -1, PART_BYTES
        counted = _Counting(source)
        writer = uuid.uuid4().hex
        client = self._creator if if_absent else self._client
        try:
            with self._translating("write", key):
                result = client.put_object(
                    self.bucket,
                    key,
                    counted,
                    length,
                    content_type=kind,
                    metadata={_WRITER: writer} if if_absent else None,
                    part_size=part_size,
                    num_parallel_uploads=1,
                )
        except ConflictError:
            if if_absent and self._is_written_by(key, writer):
                return self.stat(key)
            raise
        return ObjectInfo(key, counted.size, _bare(result.etag), result.last_modified or datetime.now(tz=UTC), kind)

    def put_file(self, key: str, file: Path, content_type: str | None = None, *, if_absent: bool = False) -> ObjectInfo:
        """Store the content of a file; see ObjectStore.put_file."""
        with reading(file) as source:
            return self.put(key, source, content_type, if_absent=if_absent)

    def get(self, key: str) -> bytes:
        """Return the content; see ObjectStore.get."""
        return b"".join(self.stream(key))

    def stream(self, key: str) -> Iterator[bytes]:
        """Return the content in pieces; see ObjectStore.stream."""
        check_key(key)
        with self._translating("read", key):
            response = self._client.get_object(self.bucket, key)

        def pieces() -> Iterator[bytes]:
            try:
                with self._translating("read", key):
                    yield from response.stream(CHUNK_BYTES)
            finally:
                response.close()
                response.release_conn()

        return pieces()

    def fetch_to(self, key: str, target: Path) -> None:
        """Write the content to a file; see ObjectStore.fetch_to."""
        pieces = self.stream(key)
        with write_atomically(target) as partial, partial.open("wb") as sink:
            for piece in pieces:
                sink.write(piece)

    def stat(self, key: str) -> ObjectInfo:
        """Return what is known about an object; see ObjectStore.stat."""
        check_key(key)
        with self._translating("read", key):
            found = self._client.stat_object(self.bucket, key)
        kind = found.content_type or guess_content_type(key)
        return ObjectInfo(key, int(found.size or 0), _bare(found.etag), found.last_modified or datetime.now(tz=UTC), kind)

    def exists(self, key: str) -> bool:
        """Return whether an object has this key."""
        try:
            self.stat(key)
        except NotFoundError:
            return False
        return True

    def list(self, prefix: str = "") -> Iterator[ObjectInfo]:
        """Return objects by prefix; see ObjectStore.list."""
        return self._listing(check_prefix(prefix))

    def _listing(self, prefix: str) -> Iterator[ObjectInfo]:
        try:
            with self._translating("list", prefix):
                for found in self._client.list_objects(self.bucket, prefix=prefix, recursive=True):
                    if found.is_dir or found.object_name is None:
                        continue
                    kind = guess_content_type(found.object_name)
                    modified = found.last_modified or datetime.now(tz=UTC)
                    yield ObjectInfo(found.object_name, int(found.size or 0), _bare(found.etag), modified, kind)
        except NotFoundError:
            return  # the bucket is made on the first write

    def delete(self, key: str) -> None:
        """Remove an object; see ObjectStore.delete."""
        check_key(key)
        with contextlib.suppress(NotFoundError), self._translating("delete", key):
            self._client.remove_object(self.bucket, key)

    def delete_prefix(self, prefix: str) -> int:
        """Remove objects by prefix; see ObjectStore.delete_prefix."""
        if not prefix:
            raise FieldError("the prefix to delete is empty, which would remove every object.", path="prefix", value=prefix)
        keys = [found.key for found in self.list(prefix)]
        with self._translating("delete", prefix):
            failed = [*self._client.remove_objects(self.bucket, (DeleteObject(key) for key in keys))] if keys else []
        if failed:
            raise StorageError(
                f"{len(failed)} of {len(keys)} objects below {prefix!r} were not deleted, the first {failed[0].name!r} "
                f"({failed[0].code}). Try again."
            )
        return len(keys)

    def presigned_url(self, key: str, expires_s: int = 3600) -> str | None:
        """Return an address to read the object; see ObjectStore.presigned_url. Made without asking the server."""
        check_key(key)
        if not 1 <= expires_s <= MAX_PRESIGNED_S:
            raise FieldError(
                f"expires_s is {expires_s}; must be within 1 to {MAX_PRESIGNED_S} s (7 days).",
                path="expires_s",
                value=expires_s,
            )
        return str(self._public.presigned_get_object(self.bucket, key, expires=timedelta(seconds=expires_s)))

    def check(self) -> None:
        """Raise StorageError where the server cannot be reached, refuses the keys, or the bucket cannot be made."""
        self._bucket_seen = False
        self._ensure_bucket()

    def _ensure_bucket(self) -> None:
        with self._bucket_lock:
            if self._bucket_seen:
                return
            with self._translating("open", ""):
                if not self._client.bucket_exists(self.bucket):
                    self._make_bucket()
            self._bucket_seen = True

    def _make_bucket(self) -> None:
        try:
            self._client.make_bucket(self.bucket, self.region)
        except S3Error as error:
            if error.code not in ("BucketAlreadyOwnedByYou", "BucketAlreadyExists"):  # another process was faster
                raise

    def _is_written_by(self, key: str, writer: str) -> bool:
        """Tell whether the object is the one this call sent: a repeated request meets its own first attempt as a conflict."""
        try:
            with self._translating("read", key):
                metadata = self._client.stat_object(self.bucket, key).metadata or {}
        except FullwellError:
            return False
        return writer == {str(name).casefold(): text for name, text in metadata.items()}.get(f"x-amz-meta-{_WRITER}")

    def _address(self) -> str:
        return f"{'https' if self.secure else 'http'}://{self.endpoint}"

    @contextlib.contextmanager
    def _translating(self, action: str, key: str) -> Iterator[None]:
        """Turn the client library's errors into ours. Its texts can quote requests, so only codes are passed on."""
        try:
            yield
        except S3Error as error:
            raise self._error_for(error.code or "", action, key) from None
        except (InvalidResponseError, ServerError) as error:
            raise self._error_for(_status_code(error), action, key) from None
        except (urllib3.exceptions.HTTPError, OSError, MinioException) as error:
            raise StorageError(
                f"the object store at {self._address()} cannot be reached ({_cause(error)}). Start it, or correct "
                f"FULLWELL_STORE_URL."
            ) from None
        except ValueError as error:
            raise FieldError(f"the S3 bucket {self.bucket!r} is not usable: {error}.", path="store_url") from None

    def _error_for(self, code: str, action: str, key: str) -> FullwellError:
        where = f"bucket {self.bucket!r} at {self._address()}"
        if code in _ABSENT:
            return NotFoundError(f"no object {key!r} in {where}.")
        if code in _CONFLICT:
            return ConflictError(f"object {key!r} exists already; it was not replaced.")
        if code in _FOLDER_CONFLICT:
            return ConflictError(
                f"object {key!r} cannot be stored: another key is its folder, or it is the folder of another key."
            )
        if code in _REFUSED:
            return StorageError(
                f"{where} refused to {action} {key!r} ({code}). Check the keys and the rights in FULLWELL_STORE_URL."
            )
        return StorageError(
            f"{where} failed to {action} {key!r} ({code or 'no code'}). Look at the server's log and try again."
        )


class _Counting(io.RawIOBase):
    """Counts what is read through it, because a stream's length is known only afterwards."""

    def __init__(self, source: BinaryIO) -> None:
        super().__init__()
        self._source = source
        self.size = 0

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1, /) -> bytes:
        piece = self._source.read(size)
        self.size += len(piece)
        return piece


def _pool_options() -> dict[str, Any]:
    # A server that is not there answers within seconds; one that is restarting gets a second chance.
    retries = Retry(
        total=3, connect=1, read=2, backoff_factor=0.3, status_forcelist=[500, 502, 503, 504], raise_on_status=False
    )
    timeout = Timeout(connect=CONNECT_TIMEOUT_S, read=READ_TIMEOUT_S)
    return {"timeout": timeout, "retries": retries, "maxsize": 16, "cert_reqs": "CERT_REQUIRED"}


def _bare(etag: str | None) -> str:
    return (etag or "").strip('"')


def _status_code(error: InvalidResponseError | ServerError) -> str:
    status = getattr(error, "status_code", None) or getattr(error, "_code", None)
    return {412: "PreconditionFailed", 404: "NoSuchKey", 403: "AccessDenied"}.get(status or 0, f"HTTP {status}")


def _cause(error: BaseException) -> str:
    reason = getattr(error, "reason", None)
    return type(reason).__name__ if isinstance(reason, BaseException) else type(error).__name__
