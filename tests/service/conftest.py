"""An application on an embedded database and store, with a queue that only remembers."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from standins import RememberingQueue

from fullwell.core.settings import Settings
from fullwell.jobs.logs import configure_logs
from fullwell_api.app import create_app
from fullwell_api.services import Services


@pytest.fixture(autouse=True, scope="session")
def _plain_logs() -> None:
    configure_logs(level=logging.ERROR)


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(home=tmp_path / "home", reap_interval_s=0.1, max_request_bytes=200_000, max_blob_bytes=300_000)


@pytest.fixture
def queue() -> RememberingQueue:
    return RememberingQueue()


@pytest.fixture
def app(settings: Settings, queue: RememberingQueue) -> FastAPI:
    return create_app(settings, queue=queue)


@pytest.fixture
def client(app: FastAPI) -> Iterator[TestClient]:
    with TestClient(app, base_url="http://127.0.0.1", raise_server_exceptions=False) as client:
        yield client


@pytest.fixture
def parts(app: FastAPI, client: TestClient) -> Services:
    services: Services = app.state.services
    return services
