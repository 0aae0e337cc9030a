"""Which build of the renderer runs here: vectorised code through a working libLLVM, or the scalar build, which always runs.

A libLLVM that does not suit the processor aborts the whole process ("Cannot select ... fminimum"), and nothing can catch
that. So every candidate is tried in a child process once, and the answer is remembered in the user's cache folder.
"""

from __future__ import annotations

import functools
import importlib.metadata
import json
import os
import platform
import re
import signal
import site
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal

from fullwell.core.errors import FieldError, RenderError, unknown_name_message
from fullwell.core.files import atomic_write
from fullwell.core.hashing import digest_of

__all__ = [
    "MIN_LLVM_MAJOR",
    "PROBE_LIMIT_S",
    "LlvmProbe",
    "VariantChoice",
    "VariantName",
    "activate",
    "choose_variant",
    "probe_cache_path",
]

VariantName = Literal["llvm_ad_spectral", "scalar_spectral"]
VECTORISED: Final[VariantName] = "llvm_ad_spectral"
SCALAR: Final[VariantName] = "scalar_spectral"

MIN_LLVM_MAJOR: Final = 17
"""Older versions abort on processors with AVX-512; they are tried only when DRJIT_LIBLLVM_PATH names one."""

PROBE_LIMIT_S: Final = 60.0
"""A cold probe takes about 2 s; a library that needs more than this is of no use."""

_PATH_VARIABLE: Final = "DRJIT_LIBLLVM_PATH"
_FORCE_VARIABLE: Final = "FULLWELL_VARIANT"
_NO_LIBRARY: Final = os.devnull
"""Stands for the scalar renderer where a library is asked for: it exists everywhere and never changes."""

_LIBRARY_FOLDERS: Final = (
    "/usr/lib/*-linux-gnu*",
    "/usr/lib/llvm-*/lib",
    "/usr/lib/llvm*/lib64",
    "/usr/lib64",
    "/usr/lib64/llvm*/lib64",
    "/usr/lib",
    "/usr/local/lib",
    "/usr/local/llvm*/lib",
    "/opt/homebrew/opt/llvm*/lib",
    "/usr/local/opt/llvm*/lib",
)
_LIBRARY_NAMES: Final = ("libLLVM.so*", "libLLVM-*.so*", "libLLVM.dylib")

# The kernel cache under $HOME would hide a bad code generator behind kernels that a good one left there, so HOME is an empty
# folder. Core dumps are off: an abort is an expected answer here. The image of a small lamp-lit scene exercises ray tracing,
# virtual calls, a recorded loop and spectra; the first lines are the instructions that old versions cannot select.
_PROBE_PROGRAM: Final = """
import json, math, resource, sys
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
import drjit as dr
import mitsuba as mi
mi.set_variant(sys.argv[1])
scalar = sys.argv[1].startswith("scalar")
if not scalar:
    x = dr.linspace(mi.Float, -1.0, 1.0, 65)
    y = dr.minimum(x, 0.25) + dr.maximum(x, -0.25) + dr.fma(x, x, dr.sqrt(dr.abs(x)))
    dr.eval(y)
    assert abs(float(y[64]) - 3.25) < 1e-5, "wrong arithmetic"
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 3},
    "sensor": {
        "type": "perspective", "fov": 40.0,
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, -4, 0], target=[0, 0, 0], up=[0, 0, 1]),
        "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
    },
    "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}},
    "lamp": {"type": "constant", "radiance": {"type": "uniform", "value": 1.0}},
})
image = mi.render(scene, spp=4, seed=1)
mean = float(dr.mean(dr.ravel(image)) if scalar else dr.mean(image, axis=None).array[0])
assert math.isfinite(mean) and mean > 0.0, "wrong image"
print(json.dumps({"llvm": [] if scalar else list(dr.detail.llvm_version())}))
"""


@dataclass(frozen=True, slots=True)
class LlvmProbe:
    """What came of trying one libLLVM: `verdict` is a sentence, `llvm_version` is known when the library was loaded."""

    library: str
    usable: bool
    verdict: str
    llvm_version: str | None = None


@dataclass(frozen=True, slots=True)
class VariantChoice:
    """The renderer that will run in this process, and why.

    Attributes
    ----------
    variant
        Name of the Mitsuba variant.
    libllvm
        Path of the code generator; None with the scalar renderer.
    reason
        One sentence for people.
    mitsuba_version, drjit_version, llvm_version
        Versions; `llvm_version` is None with the scalar renderer.
    probes
        Every library that was looked at, best first, up to the one that works.
    """

    variant: VariantName
    libllvm: str | None
    reason: str
    mitsuba_version: str
    drjit_version: str
    llvm_version: str | None
    probes: tuple[LlvmProbe, ...]


def probe_cache_path() -> Path:
    """Return the file that remembers probes: ``fullwell/llvm-probes.json`` in the user's cache folder."""
    folder = os.environ.get("XDG_CACHE_HOME")
    return (Path(folder) if folder else Path.home() / ".cache") / "fullwell" / "llvm-probes.json"


def choose_variant(*, refresh: bool = False) -> VariantChoice:
    """Return the fastest renderer that works on this machine. Imports no renderer into this process.

    Parameters
    ----------
    refresh
        Probe again, whatever earlier runs remembered.

    Raises
    ------
    FieldError
        FULLWELL_VARIANT names an unknown variant.
    RenderError
        Mitsuba is not installed, cannot run at all, or FULLWELL_VARIANT demands LLVM and no libLLVM works.
    """
    versions = (_installed_version("mitsuba"), _installed_version("drjit"))
    forced = _forced_variant()
    if forced == SCALAR:
        return _scalar_choice(f"{_FORCE_VARIABLE} asks for the scalar renderer.", versions, (), refresh=refresh)
    probes: list[LlvmProbe] = []
    for library in _candidates():
        probe = _remembered_probe(library, versions, refresh=refresh)
        probes.append(probe)
        if probe.usable:
            reason = f"LLVM {probe.llvm_version} works here."
            if forced is not None:
                reason = f"{_FORCE_VARIABLE} asks for it, and {reason}"
            return VariantChoice(VECTORISED, library, reason, *versions, probe.llvm_version, tuple(probes))
    reason = _no_llvm_reason(probes)
    if forced == VECTORISED:
        raise RenderError(f"{_FORCE_VARIABLE} is {VECTORISED}, but {reason} Install libllvm19, or unset {_FORCE_VARIABLE}.")
    return _scalar_choice(f"{reason[0].upper()}{reason[1:]}", versions, tuple(probes), refresh=refresh)


def activate() -> Any:
    """Import Mitsuba with the chosen variant set and return the module. Calling it again changes nothing."""
    choice = choose_variant()
    if choice.libllvm is not None:
        os.environ[_PATH_VARIABLE] = choice.libllvm
    import mitsuba  # noqa: PLC0415 - the path of libLLVM has to be known before the import

    if mitsuba.variant() != choice.variant:
        mitsuba.set_variant(choice.variant)
    return mitsuba


def _scalar_choice(reason: str, versions: tuple[str, str], probes: tuple[LlvmProbe, ...], *, refresh: bool) -> VariantChoice:
    """Return the last resort, once it has shown that it runs: a missing system library stops it as well."""
    probe = _remembered_probe(_NO_LIBRARY, versions, refresh=refresh)
    if not probe.usable:
        raise RenderError(
            f"Mitsuba is installed but {probe.verdict}. Install the system libraries it misses (libatomic1 is one)."
        )
    return VariantChoice(SCALAR, None, reason, *versions, None, probes)


def _forced_variant() -> VariantName | None:
    name = os.environ.get(_FORCE_VARIABLE, "").strip()
    if not name:
        return None
    if name not in (VECTORISED, SCALAR):
        message = unknown_name_message(_FORCE_VARIABLE, name, (VECTORISED, SCALAR))
        raise FieldError(message, path=_FORCE_VARIABLE, value=name)
    return VECTORISED if name == VECTORISED else SCALAR


def _installed_version(distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        raise RenderError(f"{distribution} is not installed; run: pip install 'fullwell[render]'") from None


def _no_llvm_reason(probes: Iterable[LlvmProbe]) -> str:
    failed = "; ".join(f"{probe.library} {probe.verdict}" for probe in probes)
    if failed:
        return f"no libLLVM works here: {failed}."
    return f"no libLLVM of version {MIN_LLVM_MAJOR} or newer was found; install libllvm19 for three times the speed."


def _candidates() -> list[str]:
    """Return libraries worth trying: the one the user names, then newest first."""
    named = os.environ.get(_PATH_VARIABLE, "").strip()
    found: dict[str, tuple[int, ...]] = {}
    seen: set[Path] = set()
    for path in sorted(_library_files()):
        version = _version_of(path)
        if path.resolve() in seen or version[:1] < (MIN_LLVM_MAJOR,):
            continue
        seen.add(path.resolve())
        found[str(path)] = version
    newest_first = sorted(found, key=lambda name: (found[name], name), reverse=True)
    if not named:
        return newest_first
    return [named, *(name for name in newest_first if Path(name).resolve() != Path(named).resolve())]


def _library_files() -> Iterable[Path]:
    for folder in _LIBRARY_FOLDERS:
        for name in _LIBRARY_NAMES:
            yield from Path("/").glob(f"{folder[1:]}/{name}")
    yield from (Path(line) for line in _ldconfig_paths())


def _ldconfig_paths() -> list[str]:
    for program in ("ldconfig", "/sbin/ldconfig"):
        try:
            listing = subprocess.run([program, "-p"], capture_output=True, text=True, timeout=10, check=False).stdout
        except (OSError, subprocess.SubprocessError):
            continue
        return re.findall(r"libLLVM\S*\.so\S* .*=> (\S+)", listing)
    return []


def _version_of(path: Path) -> tuple[int, ...]:
    """Read the version from the file's name, from what it links to, or from its folder; () when none of them tells."""
    for text in (path.name, path.resolve().name, *(parent.name for parent in path.resolve().parents)):
        match = re.search(r"(?i)llvm(?:-|\.so\.|@)(\d+(?:\.\d+)*)", text)
        if match:
            return tuple(int(part) for part in match[1].split("."))
    return ()


def _remembered_probe(library: str, versions: tuple[str, str], *, refresh: bool) -> LlvmProbe:
    """Return the probe of `library`, from memory where nothing that matters has changed since."""
    try:
        status = Path(library).stat()
    except OSError as error:
        return LlvmProbe(library, usable=False, verdict=f"cannot be read ({error.strerror})")
    dated = (0, 0) if library == _NO_LIBRARY else (status.st_size, status.st_mtime_ns)
    key = digest_of([library, dated, versions, _processor(), _PROBE_PROGRAM])
    remembered = {} if refresh else _read_cache()
    if key in remembered:
        return remembered[key]
    probe, final = _probe(library)
    if final:
        _write_cache({**_read_cache(), key: probe})
    return probe


@functools.cache
def _processor() -> str:
    """Name the processor and its instruction sets, on which LLVM's choice of instructions depends."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    told = {line.split(":")[0].strip(): line for line in reversed(lines)}
    wanted = [told[name] for name in ("model name", "flags", "Features") if name in told]
    return "\n".join([platform.machine(), platform.processor(), *wanted])


def _read_cache() -> dict[str, LlvmProbe]:
    try:
        document = json.loads(probe_cache_path().read_text())
        return {key: LlvmProbe(**fields) for key, fields in document.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def _write_cache(probes: dict[str, LlvmProbe]) -> None:
    # Two processes that probe at once may lose one of the answers; it is found again next time. A home that cannot be
    # written only costs a probe per process.
    try:
        atomic_write(probe_cache_path(), json.dumps({key: asdict(probe) for key, probe in probes.items()}, indent=1).encode())
    except OSError:
        return


def _probe(library: str) -> tuple[LlvmProbe, bool]:
    """Try `library` in a child process; return the answer and whether it is worth remembering (a timeout is not)."""
    with tempfile.TemporaryDirectory(prefix="fullwell-probe-") as empty_home:
        environment = {**os.environ, _PATH_VARIABLE: library, "HOME": empty_home}
        environment["PYTHONUSERBASE"] = site.getuserbase()
        command = [sys.executable, "-P", "-c", _PROBE_PROGRAM, SCALAR if library == _NO_LIBRARY else VECTORISED]
        try:
            child = subprocess.run(
                command, env=environment, capture_output=True, text=True, timeout=PROBE_LIMIT_S, check=False, cwd=empty_home
            )
        except subprocess.TimeoutExpired:
            return LlvmProbe(library, usable=False, verdict=f"did not answer within {PROBE_LIMIT_S:.0f} s"), False
    if child.returncode < 0:
        name = signal.Signals(-child.returncode).name
        return LlvmProbe(library, usable=False, verdict=f"ends the process ({name}: {_complaint(child.stderr)})"), True
    if child.returncode > 0:
        return LlvmProbe(library, usable=False, verdict=f"fails ({_complaint(child.stderr)})"), True
    answer = json.loads(child.stdout.strip().splitlines()[-1])
    version = ".".join(str(part) for part in answer["llvm"]) or None
    return LlvmProbe(library, usable=True, verdict="works", llvm_version=version), True


def _complaint(text: str) -> str:
    """Return the line of an error stream that says most: LLVM's own error or a missing library, else the last one."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    told = [line for line in lines if line.startswith("LLVM ERROR") or "cannot open shared object file" in line] or lines
    return told[-1][:200] if told else "no message"
