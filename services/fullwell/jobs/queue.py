"""The queue protocol, its Celery implementation and the Celery application that sender and worker share."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Final, Protocol

from celery import Celery

from fullwell.core import ServiceError
from fullwell.core.settings import Settings

__all__ = ["INGEST_TASK", "RENDER_TASK", "CeleryTaskQueue", "TaskQueue", "celery_application", "chunks_of"]

RENDER_TASK: Final = "fullwell.render_frames"
INGEST_TASK: Final = "fullwell.ingest_asset"
PREVIEW_LIMIT_S: Final = 1800.0
"""All previews of one asset; each is a small image with the limits of a frame of its own."""
PRIORITY_STEPS: Final = (0, 3, 6, 9)
PRIORITY_SEPARATOR: Final = ":"
MAX_CHUNK: Final = 16
MESSAGES_PER_JOB: Final = 256
LIMIT_MARGIN_S: Final = 60.0
"""The worker ends a frame that takes too long itself, and says so; Celery's limit lies behind that, for a worker that hangs."""


class TaskQueue(Protocol):
    """Carries "this is to be done" to a worker, at least once each. The database, not the queue, is the truth."""

    def enqueue(self, job_id: str, numbers: Sequence[int], *, priority: int = 3) -> None:
        """Send the messages of frames of one job; ServiceError when the broker cannot be reached."""

    def enqueue_ingestion(self, ingestion_id: str, *, priority: int = 3) -> None:
        """Send the message of work on one asset; ServiceError when the broker cannot be reached."""

    def waiting(self) -> int:
        """Return the number of messages that no worker has taken yet."""

    def check(self) -> None:
        """Raise ServiceError when the broker does not answer."""


def chunks_of(numbers: Sequence[int]) -> list[list[int]]:
    """Return the frames of one message each: one by one for a small job, up to 16 together for a large one."""
    size = min(MAX_CHUNK, max(1, len(numbers) // MESSAGES_PER_JOB))
    return [list(numbers[start : start + size]) for start in range(0, len(numbers), size)]


def celery_application(settings: Settings, broker_url: str) -> Celery:
    """Return the Celery application with the measured settings; docs/service.md says why each is as it is."""
    application = Celery("fullwell", broker=broker_url, set_as_current=False)
    application.conf.update(
        task_default_queue=settings.queue,
        task_serializer="json",
        accept_content=["json"],
        task_ignore_result=True,
        task_acks_late=True,
        task_acks_on_failure_or_timeout=True,
        task_reject_on_worker_lost=True,
        task_retry_on_worker_lost=True,
        worker_prefetch_multiplier=1,
        worker_soft_shutdown_timeout=settings.soft_shutdown_s,
        worker_enable_soft_shutdown_on_idle=False,
        worker_max_tasks_per_child=settings.max_tasks_per_child,
        worker_max_memory_per_child=settings.max_memory_per_child_mib * 1024,
        worker_concurrency=1,
        worker_hijack_root_logger=False,
        worker_send_task_events=False,
        worker_enable_remote_control=False,
        # A broker that was away takes no running frame with it: its late acknowledgement is refused, the message comes
        # again, and the lease table answers that the frame is done.
        worker_cancel_long_running_tasks_on_connection_loss=False,
        broker_connection_retry=True,
        broker_connection_retry_on_startup=True,
        broker_connection_max_retries=None,
        broker_transport_options={
            "visibility_timeout": settings.visibility_timeout_s,
            "unacked_restore_interval": 5,
            "unacked_restore_throttle": 1,
            "priority_steps": list(PRIORITY_STEPS),
            "queue_order_strategy": "priority",
            "sep": PRIORITY_SEPARATOR,
            "socket_connect_timeout": 5,
            "socket_timeout": 30,
            "socket_keepalive": True,
        },
    )
    return application


class CeleryTaskQueue:
    """Sends frames through Celery. Holds one connection pool; do not share it across a fork."""

    def __init__(self, settings: Settings, broker_url: str) -> None:
        self._settings = settings
        self._application = celery_application(settings, broker_url)
        # The sender must learn at once that the broker is away: the outbox keeps the frames.
        self._application.conf.broker_transport_options.update(
            {"max_retries": 0, "socket_timeout": 5, "retry_on_timeout": False}
        )

    def enqueue(self, job_id: str, numbers: Sequence[int], *, priority: int = 3) -> None:
        """Send the messages of frames of one job; ServiceError when the broker cannot be reached."""
        limit_s = self._settings.frame_time_limit_s + LIMIT_MARGIN_S
        messages = [([job_id, chunk], limit_s * len(chunk)) for chunk in chunks_of(numbers)]
        self._send(RENDER_TASK, messages, priority)

    def enqueue_ingestion(self, ingestion_id: str, *, priority: int = 3) -> None:
        """Send the message of work on one asset; ServiceError when the broker cannot be reached."""
        limit_s = self._settings.ingest_time_limit_s + PREVIEW_LIMIT_S + LIMIT_MARGIN_S
        self._send(INGEST_TASK, [([ingestion_id], limit_s)], priority)

    def _send(self, task: str, messages: Sequence[tuple[list[Any], float]], priority: int) -> None:
        try:
            with self._application.producer_pool.acquire(block=True, timeout=10) as producer:
                for arguments, limit_s in messages:
                    self._application.send_task(
                        task,
                        args=arguments,
                        priority=priority,
                        producer=producer,
                        retry=False,
                        time_limit=limit_s,
                        ignore_result=True,
                    )
        except Exception as error:  # kombu raises the errors of whatever transport is configured
            raise _unreachable(error) from error

    def waiting(self) -> int:
        """Return the number of messages that no worker has taken yet."""
        try:
            with self._application.pool.acquire(block=True, timeout=10) as connection:
                client = connection.default_channel.client
                return sum(int(client.llen(name)) for name in _priority_lists(self._settings.queue))
        except Exception as error:
            raise _unreachable(error) from error

    def check(self) -> None:
        """Raise ServiceError when the broker does not answer."""
        try:
            with self._application.pool.acquire(block=True, timeout=10) as connection:
                connection.default_channel.client.ping()
        except Exception as error:
            raise _unreachable(error) from error

    def close(self) -> None:
        """Close the connections."""
        self._application.close()


def _priority_lists(queue: str) -> list[str]:
    """Return the names of the broker's lists: each priority step has its own; step 0 has the bare name."""
    return [queue if step == 0 else f"{queue}{PRIORITY_SEPARATOR}{step}" for step in PRIORITY_STEPS]


def _unreachable(error: Exception) -> ServiceError:
    detail: Any = str(error).splitlines()[0] if str(error) else type(error).__name__
    where = os.environ.get("FULLWELL_BROKER_URL", "").rpartition("@")[2] or "the embedded broker"
    return ServiceError(f"the broker ({where}) cannot be reached: {str(detail)[:200]}")
