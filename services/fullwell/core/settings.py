"""Settings of the service and its tools, read from environment variables that start with ``FULLWELL_``."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import Field, SecretStr, ValidationError, field_validator, model_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from fullwell.core.errors import FieldError

__all__ = ["CuratorKey", "Settings", "default_home", "load_settings"]

MIB = 1 << 20
GIB = 1 << 30
LEAST_KEY_CHARACTERS: Final = 8
CURATOR: Final = "curator"
"""Name of a curator whose key was set without one."""

_CURATOR_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,63}")


@dataclass(frozen=True, slots=True)
class CuratorKey:
    """A key that may change assets, and the name under which its decisions are recorded: never the key itself."""

    name: str
    key: SecretStr

    @classmethod
    def from_text(cls, text: str) -> CuratorKey:
        """Return the key of ``name:key``, or of ``key`` alone; ValueError for an illegal name or a short key."""
        name, colon, key = text.partition(":")
        name, key = (name.strip(), key) if colon else (CURATOR, text)
        if not _CURATOR_NAME.fullmatch(name):
            raise ValueError("a curator's name must be 1 to 64 letters, digits, dots, dashes, underscores or @; write name:key")
        if len(key) < LEAST_KEY_CHARACTERS:
            raise ValueError(f"a curator key must have at least {LEAST_KEY_CHARACTERS} characters; write name:key")
        return cls(name, SecretStr(key))


def default_home() -> Path:
    """Return the folder of the embedded service's state: the user's data directory, by the XDG rule."""
    data = os.environ.get("XDG_DATA_HOME", "")
    base = Path(data) if data.startswith("/") else Path.home() / ".local" / "share"
    return base / "fullwell"


class Settings(BaseSettings):
    """Everything an operator can set. docs/service.md explains each one.

    The three addresses `database_url`, `broker_url` and `store_url` are empty by default: then they mean the embedded
    database, broker and folder below `home`.
    """

    model_config = SettingsConfigDict(env_prefix="FULLWELL_", extra="ignore", frozen=True)

    home: Path = Field(default_factory=default_home)
    database_url: str = ""
    broker_url: str = ""
    store_url: str = ""

    host: str = "127.0.0.1"
    port: int = Field(default=8000, ge=0, le=65535)
    workers: int = Field(default=1, ge=0, le=256)
    api_keys: Annotated[tuple[SecretStr, ...], NoDecode] = ()
    curator_keys: Annotated[tuple[CuratorKey, ...], NoDecode] = ()
    allow_open: bool = False
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = ()
    presign_products: bool = False
    max_request_bytes: int = Field(default=8 * MIB, ge=1024)
    max_blob_bytes: int = Field(default=2048 * MIB, ge=1024)
    max_frames_per_job: int = Field(default=100_000, ge=1)
    max_upload_bytes: int = Field(default=2048 * MIB, ge=1024)

    ingest_time_limit_s: float = Field(default=120.0, ge=1.0, le=3000.0)
    ingest_memory_bytes: int = Field(default=3 * GIB, ge=512 * MIB)
    preview_on_ingest: bool = True

    cache_bytes: int = Field(default=8192 * MIB, ge=0)
    asset_cache_bytes: int = Field(default=4096 * MIB, ge=64 * MIB)

    lease_s: float = Field(default=30.0, ge=1.0, le=3600.0)
    reap_interval_s: float = Field(default=2.0, ge=0.1, le=60.0)
    max_attempts: int = Field(default=3, ge=1, le=100)
    retry_delay_s: float = Field(default=2.0, ge=0.0, le=3600.0)
    frame_time_limit_s: float = Field(default=3000.0, ge=1.0)

    isolate: bool = True
    render_memory_bytes: int = Field(default=0, ge=0)
    render_max_frames: int = Field(default=50, ge=1)
    kernels: Path | None = None

    queue: str = Field(default="fullwell", pattern=r"^[A-Za-z0-9_.-]{1,64}$")
    visibility_timeout_s: int = Field(default=3600, ge=10)
    soft_shutdown_s: float = Field(default=20.0, ge=0.0)
    max_tasks_per_child: int = Field(default=200, ge=1)
    max_memory_per_child_mib: int = Field(default=8192, ge=256)
    worker_health_file: Path | None = None

    url: str = ""
    api_key: SecretStr = SecretStr("")

    @field_validator("api_keys", "allowed_hosts", mode="before")
    @classmethod
    def _split_commas(cls, value: Any) -> Any:
        return tuple(part.strip() for part in value.split(",") if part.strip()) if isinstance(value, str) else value

    @field_validator("curator_keys", mode="before")
    @classmethod
    def _named_keys(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        return tuple(CuratorKey.from_text(part.strip()) for part in value.split(",") if part.strip())

    @field_validator("home", mode="after")
    @classmethod
    def _absolute_home(cls, value: Path) -> Path:
        return value.expanduser().absolute()

    @field_validator("api_keys", mode="after")
    @classmethod
    def _long_keys(cls, value: tuple[SecretStr, ...]) -> tuple[SecretStr, ...]:
        if any(len(key.get_secret_value()) < LEAST_KEY_CHARACTERS for key in value):
            raise ValueError(f"an API key must have at least {LEAST_KEY_CHARACTERS} characters")
        return value

    @field_validator("render_memory_bytes", mode="after")
    @classmethod
    def _room_for_the_renderer(cls, value: int) -> int:
        if 0 < value < 512 * MIB:
            raise ValueError(
                "must be 0 (nine tenths of the memory) or at least 512 MiB (536870912): the renderer alone needs 300"
            )
        return value

    @model_validator(mode="after")
    def _time_limit_below_visibility(self) -> Settings:
        if self.frame_time_limit_s > self.visibility_timeout_s:
            raise ValueError("frame_time_limit_s must not be longer than visibility_timeout_s")
        return self

    @property
    def database(self) -> str:
        """The database's address: as set, or the SQLite file below `home`."""
        return self.database_url or f"sqlite:///{self.home / 'fullwell.sqlite3'}"

    @property
    def store(self) -> str:
        """The object store's address: as set, or the folder below `home`."""
        return self.store_url or (self.home / "store").as_uri()

    @property
    def asset_cache(self) -> Path:
        """The folder in which this machine keeps models of the asset store, up to `asset_cache_bytes`."""
        return self.home / "asset-cache"

    @property
    def health_file(self) -> Path:
        """The file whose age tells whether the worker lives."""
        return self.worker_health_file or self.home / "run" / "worker.health"

    @property
    def client_url(self) -> str:
        """Where commands look for the service."""
        return self.url or f"http://{self.host if self.host not in ('0.0.0.0', '::') else '127.0.0.1'}:{self.port}"

    @property
    def has_keys(self) -> bool:
        """Whether requests need a key."""
        return bool(self.api_keys or self.curator_keys)

    @property
    def is_loopback(self) -> bool:
        """Whether the API can be reached from this machine only."""
        return self.host in ("localhost", "::1") or self.host.startswith("127.")


def load_settings(**overrides: Any) -> Settings:
    """Return the settings of this process's environment; keyword arguments (not None) win over variables.

    Raises
    ------
    FieldError
        A variable has an illegal value; the message names the variable.
    """
    given = {name: value for name, value in overrides.items() if value is not None}
    try:
        return Settings(**given)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = str(first["loc"][0]) if first["loc"] else ""
        variable = f"FULLWELL_{name.upper()}" if name else "the environment"
        shown = "" if "key" in name else f" is {first.get('input')!r}"
        raise FieldError(f"{variable}{shown}: {first['msg']}. Set {variable} to a legal value.", path=name) from None
