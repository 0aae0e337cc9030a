"""The process that reads files of unknown origin: takes orders as lines of JSON, answers with a folder of blobs.

``python -P -m fullwell.assets.ingest.child ANSWERS LIMITS``, started by `fullwell.assets.ingest.process` only. It stays warm
from asset to asset, and ends when its standard input does.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import math
import os
import resource
import signal
import sys
import traceback
from pathlib import Path
from typing import Any, Final

__all__ = ["main"]

_ADDRESS_SPACE_EXTRA: Final = 4 << 30
"""Libraries and mapped files count as address space, but not as data; this lets them in."""

_OOM_SCORE_ADJUSTMENT: Final = 800
"""When the machine's memory runs out all the same, the kernel shall choose this process."""

_MODEL_LIBRARIES: Final = (
    "trimesh",
    "fast_simplification",
    "pxr.Usd",
    "pxr.UsdGeom",
    "pxr.UsdShade",
    "pxr.UsdUtils",
    "PIL.PngImagePlugin",
) + ("PIL.JpegImagePlugin", "scipy.spatial", "scipy.sparse.csgraph", "fullwell.assets.materials.rules")


def main(arguments: list[str]) -> None:
    """Serve the parent until it closes the orders."""
    from fullwell.assets.ingest.options import IngestLimits  # noqa: PLC0415

    answers = _Answers(int(arguments[0]))
    limits = IngestLimits(**json.loads(arguments[1]))
    _confine(limits.memory_bytes, limits.output_bytes)
    orders = os.fdopen(os.dup(0), "rb")
    _close_standard_input()
    _warm_up()
    for line in orders:
        order = json.loads(line)
        answers.send({"taken": order["serial"]})
        _allow_cpu(limits.cpu_s)
        _serve(order, limits, answers)
    os._exit(0)  # unloading native libraries in their own order is not worth its risks


class _Answers:
    """Lines of JSON to the parent; native code may print to standard output as it likes."""

    def __init__(self, descriptor: int) -> None:
        os.set_inheritable(descriptor, False)
        self._stream = os.fdopen(descriptor, "wb", buffering=0)

    def send(self, message: dict[str, Any]) -> None:
        """Send one answer."""
        self._stream.write(json.dumps(message).encode() + b"\n")


def _serve(order: dict[str, Any], limits: Any, answers: _Answers) -> None:
    from fullwell.assets.ingest.options import IngestError, IngestOptions  # noqa: PLC0415
    from fullwell.assets.ingest.prepare import prepare_file  # noqa: PLC0415
    from fullwell.core.errors import FullwellError  # noqa: PLC0415

    folder = Path(order["folder"])
    try:
        prepared = prepare_file(
            Path(order["files_dir"]),
            order["main"],
            IngestOptions.from_document(order["options"]),
            limits=limits,
            progress=lambda share, stage: answers.send({"progress": share, "stage": stage}),
            isolated=True,
        )
        for digest, content in prepared.blobs.items():
            (folder / digest).write_bytes(content)
        document = folder / "manifest.json"
        document.write_text(json.dumps(prepared.manifest.document(), allow_nan=False), encoding="utf-8")
        answers.send({"done": True})
    except IngestError as error:
        answers.send(_refusal(error.message, error.path, error.value, error.cause))
    except FullwellError as error:
        answers.send(_refusal(error.message, getattr(error, "path", "file"), order["main"], "refused"))
    except MemoryError:
        answers.send(_refusal("", "file", order["main"], "memory"))
    except OSError as error:
        cause = "size" if error.errno == _EFBIG else "unforeseen"
        answers.send(_refusal(f"{type(error).__name__}: {error}", "file", order["main"], cause))
    except Exception as error:
        traceback.print_exc()
        answers.send(_refusal(f"{type(error).__name__}: {error}", "file", order["main"], "unforeseen"))


_EFBIG: Final = 27


def _refusal(message: str, path: str, value: Any, cause: str) -> dict[str, Any]:
    plain = value if isinstance(value, str | int | float | bool | type(None)) else str(value)
    if isinstance(plain, float) and not math.isfinite(plain):
        plain = str(plain)
    text = message.encode("utf-8", "replace").decode()
    return {"error": {"message": text[:2000], "path": path, "value": plain, "cause": cause}}


def _confine(memory_bytes: int, file_bytes: int) -> None:
    faulthandler.enable()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_DATA, (memory_bytes, memory_bytes))
    resource.setrlimit(resource.RLIMIT_AS, (memory_bytes + _ADDRESS_SPACE_EXTRA,) * 2)
    resource.setrlimit(resource.RLIMIT_FSIZE, (file_bytes, file_bytes))
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(str(_OOM_SCORE_ADJUSTMENT))


def _allow_cpu(seconds: float) -> None:
    """Let this asset take so much processor time; the signal that ends it comes whatever native code does."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    resource.setrlimit(resource.RLIMIT_CPU, (int(usage.ru_utime + usage.ru_stime + seconds) + 1, hard))


def _close_standard_input() -> None:
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)


def _warm_up() -> None:
    """Import what reading needs. Not in a thread beside the first order: USD's modules do not survive being imported twice."""
    import importlib  # noqa: PLC0415

    for name in ("fullwell.assets.ingest.prepare", *_MODEL_LIBRARIES):
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


if __name__ == "__main__":
    main(sys.argv[1:])
