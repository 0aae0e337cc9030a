"""What a conversion carries along: files, warnings, the wavelength grid; and how errors get their path."""

from __future__ import annotations

import os
import posixpath
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from fullwell.core.errors import FieldError, FullwellError, nearest_names
from fullwell.core.hashing import sha256_file
from fullwell.radiometry.grid import WavelengthGrid
from fullwell.radiometry.spectrum import Spectrum
from fullwell.scene.description import Emission, Material
from fullwell.schema.errors import RecipeError

if TYPE_CHECKING:
    from fullwell.assets.model import LoadedModel
    from fullwell.schema.assets import StoredAssetFiles
    from fullwell.schema.conversion.traffic import StreetView
    from fullwell.schema.v1.recipe import RecipeDocument

__all__ = ["Context", "RecipeFiles", "fail", "located"]

PACKAGED_PREFIX = "sumo:"
_KEPT_MODELS = 64
"""Models kept between the frames of one recipe; more are read again, so that memory does not grow without bound."""


def fail(path: str, sentence: str, value: Any = None) -> NoReturn:
    """Raise the RecipeError that reads "<path> <sentence>"."""
    raise RecipeError(f"{path} {sentence}", path, value)


@contextmanager
def located(path: str) -> Iterator[None]:
    """Give errors that other parts raise the path of the recipe's field."""
    try:
        yield
    except RecipeError:
        raise
    except FieldError as error:
        message = error.message if error.message.startswith(path) else f"{path}: {error.message}"
        raise RecipeError(message, error.path if error.path.startswith(path) else path, error.value) from error
    except FullwellError as error:
        raise RecipeError(f"{path}: {error.message}", path) from error


class RecipeFiles:
    """Files that a recipe names: found, hashed once, and models kept for the next frame.

    With `confined`, files and what they refer to must stay within `base_dir`, links followed.
    """

    def __init__(self, base_dir: Path | None, expected: dict[str, str], *, confined: bool) -> None:
        self._base_dir = base_dir
        self._confined = confined
        self._expected = expected
        self._licences: dict[str, str] = {}
        self._digests: dict[tuple[str, int, int], str] = {}
        self._models: dict[tuple[str, str, float | None, str | None], LoadedModel] = {}

    def find(self, reference: str, path: str) -> tuple[Path, str]:
        """Return the local file of a reference and its SHA-256. Raises RecipeError for `path`."""
        with located(path):
            file = self._local(reference, path)
        if not file.is_file():
            siblings = [entry.name for entry in file.parent.iterdir()] if file.parent.is_dir() else []
            close = nearest_names(file.name, siblings)
            advice = f"did you mean {' or '.join(close)}?" if close else "file names are relative to the recipe's folder."
            fail(path, f"is {reference!r}, which {'is a folder' if file.is_dir() else 'does not exist'}; {advice}", reference)
        return file, self._digest(file, reference, path)

    def _local(self, reference: str, path: str) -> Path:
        if reference.startswith(PACKAGED_PREFIX):
            from fullwell.assets import packaged_model  # noqa: PLC0415 - an extra

            packaged = packaged_model(reference, field_path=path)
            self._licences[reference] = f"{packaged.licence} ({packaged.source})"
            return packaged.path
        if reference.startswith("asset:"):
            name = reference.removeprefix("asset:")
            fail(path, f"is {reference!r}, which is no file; write geometry: {{kind: asset, id: {name}}}.", reference)
        if self._base_dir is None:
            fail(path, f"is {reference!r}, but this recipe has no folder; load it from a file, or use an asset.", reference)
        file = self._base_dir / reference
        if self._confined and not file.resolve().is_relative_to(self._base_dir.resolve()):
            fail(path, f"is {reference!r}, which lies outside the recipe's folder; put the file into it.", reference)
        return file

    def _digest(self, file: Path, reference: str, path: str) -> str:
        status = file.stat()
        key = (str(file), status.st_size, status.st_mtime_ns)
        if key not in self._digests:
            try:
                self._digests[key] = sha256_file(file)
            except OSError as error:
                fail(path, f"is {reference!r}, which cannot be read: {error.strerror}.", reference)
        digest, expected = self._digests[key], self._expected.get(reference, "")
        if expected and digest != expected:
            fail(path, f"is {reference!r}, whose SHA-256 is {digest}; files says {expected}. It was changed.", reference)
        return digest

    def licence(self, reference: str) -> str | None:
        """Return the licence and source of a file that was found in a package; None for the user's own."""
        return self._licences.get(reference)

    def companions(self, reference: str, file: Path, model: LoadedModel) -> dict[str, str]:
        """Return {reference: SHA-256} of the other files that the model at `reference` was made of."""
        prefix, colon, inner = reference.rpartition(":")
        folder = posixpath.dirname(inner)
        found: dict[str, str] = {}
        for other in model.references:
            relative = Path(os.path.relpath(other, file.parent)).as_posix()
            name = prefix + colon + posixpath.normpath(posixpath.join(folder, relative))
            found[name] = self._digest(other, name, "files")
        return found

    def _root_of(self, file: Path) -> Path | None:
        """Return the folder that a file's own references must stay within; None leaves it to the reader of models."""
        if self._confined and self._base_dir is not None and file.resolve().is_relative_to(self._base_dir.resolve()):
            return self._base_dir
        return None

    def model(self, file: Path, digest: str, *, unit_m: float | None, up_axis: str | None, path: str) -> LoadedModel:
        """Return a model file's content, read once per digest and reading options."""
        from fullwell.assets.meshes import load_model  # noqa: PLC0415 - reading models is an extra

        key = (digest, file.suffix.lower(), unit_m, up_axis)
        if key not in self._models:
            if len(self._models) >= _KEPT_MODELS:
                self._models.pop(next(iter(self._models)))
            root = self._root_of(file)
            with located(path):
                self._models[key] = load_model(
                    file,
                    unit_m=unit_m,
                    up_axis=up_axis,  # type: ignore[arg-type]
                    field_path=path,
                    root=root,
                )
        return self._models[key]

    def level(self, file: Path, digest: str, *, path: str) -> LoadedModel:
        """Return a level of detail of an asset, read once per digest."""
        from fullwell.assets.ingest.canonical import read_level  # noqa: PLC0415 - reading models is an extra

        key = (digest, "level", None, None)
        if key not in self._models:
            if len(self._models) >= _KEPT_MODELS:
                self._models.pop(next(iter(self._models)))
            with located(path):
                self._models[key] = read_level(file)
        return self._models[key]


@dataclass(slots=True)
class Context:
    """State of the conversion of one frame.

    `document` and `seed` are what assets are drawn by; `drawn_assets` notes {path of a geometry: pin}. `moments_s` are
    times [s] at which other frames of the recipe look at its street.
    """

    grid: WavelengthGrid
    files: RecipeFiles
    assets: StoredAssetFiles | None = None
    document: RecipeDocument | None = None
    seed: int = 0
    drawn_assets: dict[str, str] = field(default_factory=dict)
    street: StreetView | None = None
    moments_s: tuple[float, ...] = ()
    warnings: list[str] = field(default_factory=list)
    used_files: dict[str, str] = field(default_factory=dict)
    materials: dict[str, tuple[Material, Emission | None]] = field(default_factory=dict)
    """By their canonical text: equal materials become one, which lets the renderer share them."""
    _grouped: dict[str, list[str]] = field(default_factory=dict)
    upsampled: dict[tuple[float, float, float], Spectrum] = field(default_factory=dict)

    def warn(self, sentence: str) -> None:
        """Note a sentence for the manifest, once."""
        if sentence not in self.warnings:
            self.warnings.append(sentence)

    def warn_of(self, path: str, sentence: str) -> None:
        """Note "<path> <sentence>"; the same sentence about other fields becomes one note that counts them."""
        paths = self._grouped.setdefault(sentence, [])
        if path not in paths:
            paths.append(path)

    def all_warnings(self) -> tuple[str, ...]:
        """Return every note."""
        grouped = (
            f"{paths[0]}{f' (and {len(paths) - 1} more)' if len(paths) > 1 else ''} {sentence}"
            for sentence, paths in self._grouped.items()
        )
        return (*self.warnings, *grouped)
