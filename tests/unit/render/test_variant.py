"""The choice of renderer: what is tried, what is believed, what is remembered. The real probe runs once."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from fullwell.core.errors import FieldError, RenderError
from fullwell.render import variant


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("FULLWELL_VARIANT", raising=False)
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)


def _library(folder: Path, name: str) -> str:
    path = folder / name
    path.write_bytes(name.encode())
    return str(path)


def _answer(monkeypatch: pytest.MonkeyPatch, working: set[str], *, final: bool = True, scalar_runs: bool = True) -> list[str]:
    """Replace the child process: only `working` libraries work. Returns the list that tried ones are added to."""
    tried: list[str] = []

    def probe(library: str) -> tuple[variant.LlvmProbe, bool]:
        if library == variant._NO_LIBRARY:
            return variant.LlvmProbe(library, scalar_runs, "works" if scalar_runs else "fails (no libatomic.so.1)"), True
        tried.append(library)
        usable = library in working
        verdict = "works" if usable else "ends the process (SIGABRT: no message)"
        return variant.LlvmProbe(library, usable, verdict, "19.1.7" if usable else None), final

    monkeypatch.setattr(variant, "_probe", probe)
    return tried


def _only_files(monkeypatch: pytest.MonkeyPatch, *libraries: str) -> None:
    monkeypatch.setattr(variant, "_library_files", lambda: [Path(library) for library in libraries])


def test_versions_are_read_from_every_usual_name(tmp_path: Path) -> None:
    named = {
        "libLLVM-19.so.1": (19,),
        "libLLVM.so.19.1": (19, 1),
        "libLLVM-18.so": (18,),
        "libLLVM-14.0.6.so.1": (14, 0, 6),
    }
    for name, version in named.items():
        assert variant._version_of(Path(_library(tmp_path, name))) == version


def test_a_nameless_library_is_dated_by_its_link_or_its_folder(tmp_path: Path) -> None:
    target = _library(tmp_path, "libLLVM.so.20.1")
    link = tmp_path / "libLLVM.so"
    link.symlink_to(target)
    assert variant._version_of(link) == (20, 1)
    folder = tmp_path / "llvm-18" / "lib"
    folder.mkdir(parents=True)
    assert variant._version_of(Path(_library(folder, "libLLVM.so"))) == (18,)


def test_newest_comes_first_and_old_ones_are_not_tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, good, newest = (_library(tmp_path, f"libLLVM-{version}.so.1") for version in (15, 18, 21))
    _only_files(monkeypatch, old, good, newest)
    assert variant._candidates() == [newest, good]


def test_the_library_the_user_names_is_tried_first_even_when_old(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, good = (_library(tmp_path, f"libLLVM-{version}.so.1") for version in (15, 19))
    _only_files(monkeypatch, old, good)
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", old)
    assert variant._candidates() == [old, good]


def test_a_library_that_kills_the_child_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    newest, good = (_library(tmp_path, f"libLLVM-{version}.so.1") for version in (21, 19))
    _only_files(monkeypatch, newest, good)
    _answer(monkeypatch, {good})
    choice = variant.choose_variant()
    assert (choice.variant, choice.libllvm, choice.llvm_version) == ("llvm_ad_spectral", good, "19.1.7")
    assert [probe.usable for probe in choice.probes] == [False, True]


def test_without_a_working_library_the_scalar_renderer_is_chosen_and_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = _library(tmp_path, "libLLVM-19.so.1")
    _only_files(monkeypatch, library)
    _answer(monkeypatch, set())
    choice = variant.choose_variant()
    assert (choice.variant, choice.libllvm) == ("scalar_spectral", None)
    assert library in choice.reason
    assert "SIGABRT" in choice.reason


def test_without_any_library_the_reason_names_the_package_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    _only_files(monkeypatch)
    _answer(monkeypatch, set())
    assert "libllvm19" in variant.choose_variant().reason


def test_an_answer_is_remembered_until_the_file_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = _library(tmp_path, "libLLVM-19.so.1")
    _only_files(monkeypatch, library)
    tried = _answer(monkeypatch, {library})
    first = variant.choose_variant()
    assert variant.choose_variant() == first
    assert len(tried) == 1
    variant.choose_variant(refresh=True)
    assert len(tried) == 2
    Path(library).write_bytes(b"another build")
    variant.choose_variant()
    assert len(tried) == 3


def test_a_timeout_is_not_remembered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = _library(tmp_path, "libLLVM-19.so.1")
    _only_files(monkeypatch, library)
    tried = _answer(monkeypatch, set(), final=False)
    variant.choose_variant()
    variant.choose_variant()
    assert len(tried) == 2


def test_a_damaged_cache_is_ignored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = _library(tmp_path, "libLLVM-19.so.1")
    _only_files(monkeypatch, library)
    _answer(monkeypatch, {library})
    for content in ("{", "[]", '{"key": {"unknown": 1}}', '{"key": 3}'):
        variant.probe_cache_path().parent.mkdir(parents=True, exist_ok=True)
        variant.probe_cache_path().write_text(content)
        assert variant.choose_variant().libllvm == library


def test_a_cache_folder_that_cannot_be_made_costs_only_a_probe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    library = _library(tmp_path, "libLLVM-19.so.1")
    _only_files(monkeypatch, library)
    _answer(monkeypatch, {library})
    assert variant.choose_variant().libllvm == library


def test_a_missing_library_is_reported_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _only_files(monkeypatch)
    _answer(monkeypatch, set())
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "nothing.so"))
    choice = variant.choose_variant()
    assert choice.variant == "scalar_spectral"
    assert "cannot be read" in choice.reason


def test_a_renderer_that_runs_in_no_variant_is_an_error_that_says_what_it_misses(monkeypatch: pytest.MonkeyPatch) -> None:
    _only_files(monkeypatch)
    _answer(monkeypatch, set(), scalar_runs=False)
    with pytest.raises(RenderError, match=r"libatomic\.so\.1.*libatomic1"):
        variant.choose_variant()


def test_scalar_can_be_forced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = _library(tmp_path, "libLLVM-19.so.1")
    _only_files(monkeypatch, library)
    tried = _answer(monkeypatch, {library})
    monkeypatch.setenv("FULLWELL_VARIANT", "scalar_spectral")
    assert variant.choose_variant().variant == "scalar_spectral"
    assert tried == []


def test_forced_llvm_that_does_not_work_is_an_error_with_a_next_step(monkeypatch: pytest.MonkeyPatch) -> None:
    _only_files(monkeypatch)
    monkeypatch.setenv("FULLWELL_VARIANT", "llvm_ad_spectral")
    with pytest.raises(RenderError, match="libllvm19"):
        variant.choose_variant()


def test_an_unknown_forced_variant_is_answered_with_the_nearest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FULLWELL_VARIANT", "scalar_spectrum")
    with pytest.raises(FieldError, match="scalar_spectral") as caught:
        variant.choose_variant()
    assert pickle.loads(pickle.dumps(caught.value)).path == "FULLWELL_VARIANT"


def test_a_file_that_is_no_library_fails_in_the_child_only(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba")
    probe, final = variant._probe(_library(tmp_path, "libLLVM-19.so.1"))
    assert not probe.usable
    assert final
    assert probe.verdict


def test_the_scalar_renderer_is_tried_as_well() -> None:
    pytest.importorskip("mitsuba")
    probe, _ = variant._probe(variant._NO_LIBRARY)
    assert probe.usable, probe.verdict
    assert probe.llvm_version is None


def test_the_chosen_renderer_renders(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba")
    program = (
        "from fullwell.render.variant import activate, choose_variant\n"
        "import sys\n"
        "choice = choose_variant()\n"
        "assert 'mitsuba' not in sys.modules, 'choosing must not import the renderer'\n"
        "assert activate().variant() == choice.variant\n"
        "assert activate() is activate()\n"
    )
    child = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert child.returncode == 0, child.stderr
