"""Fixtures that every test folder may use."""

from servers import s3_server, valkey_server

__all__ = ["s3_server", "valkey_server"]
