"""``python -m fullwell_api``: serve the API until asked to stop."""

from __future__ import annotations

import argparse
import logging
import socket
import sys

import uvicorn

from fullwell.core import FullwellError
from fullwell.core.settings import load_settings
from fullwell.jobs.logs import configure_logs
from fullwell_api.app import create_app

__all__ = ["main"]

KEEP_ALIVE_S = 30
STOP_PATIENCE_S = 5


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="fullwell-api", description="Serve the HTTP API.")
    parser.add_argument("--host", help="address to listen at (FULLWELL_HOST)")
    parser.add_argument("--port", type=int, help="port to listen at (FULLWELL_PORT)")
    parser.add_argument("--fd", type=int, help="number of an inherited listening socket, instead of host and port")
    given = parser.parse_args(arguments)
    configure_logs(level=logging.INFO)
    try:
        settings = load_settings(host=given.host, port=given.port)
        app = create_app(settings)
    except FullwellError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        log_config=None,
        access_log=False,
        server_header=False,
        timeout_keep_alive=KEEP_ALIVE_S,
        timeout_graceful_shutdown=STOP_PATIENCE_S,
    )
    sockets = [socket.socket(fileno=given.fd)] if given.fd is not None else None
    uvicorn.Server(config).run(sockets=sockets)
    return 0


if __name__ == "__main__":
    sys.exit(main())
