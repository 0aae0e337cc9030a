"""What renders a frame: the interface that the worker knows, and the real pipeline behind it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from fullwell.core.settings import load_settings

if TYPE_CHECKING:
    from fullwell.assets.store import StoredAssets
    from fullwell.pipeline import StageStore
    from fullwell.schema import KeptScene, RecipeBuilder, RecipeDocument
    from fullwell.storage import ObjectStore

__all__ = ["FrameRunner", "PipelineRunner", "Progress"]


class Progress(Protocol):
    """Where a frame is; the pipeline's FrameProgress is one."""

    @property
    def stage(self) -> str:
        """What is being done."""

    @property
    def fraction(self) -> float:
        """How much of the frame is finished, in [0, 1]."""


class FrameRunner(Protocol):
    """What renders a frame and publishes its products, the manifest last."""

    def __call__(
        self,
        document: RecipeDocument,
        index: int,
        store: ObjectStore,
        prefix: str,
        *,
        base_dir: Path | None,
        progress: Callable[[Progress], None] | None,
        should_cancel: Callable[[], bool] | None,
    ) -> Any:
        """Return when the frame's manifest is in the store."""
        ...


class PipelineRunner:
    """Runs frames with the real pipeline; keeps what builds the frames of the job at hand, with the models it has read.

    The last scene is kept for the next job too: one that varies only its sensors does not make it again.

    Radiance images go to the stage cache in the store that holds the products: all workers of a service share it.
    """

    def __init__(self) -> None:
        self._document: RecipeDocument | None = None
        self._builder: RecipeBuilder | None = None
        self._scene: KeptScene | None = None
        self._stages: StageStore | None = None
        self._assets: StoredAssets | None = None

    def __call__(
        self,
        document: RecipeDocument,
        index: int,
        store: ObjectStore,
        prefix: str,
        *,
        base_dir: Path | None,
        progress: Callable[[Progress], None] | None,
        should_cancel: Callable[[], bool] | None,
    ) -> Any:
        """Return the manifest of the published frame."""
        # Loads the renderer: in the process that renders, at its first frame.
        from fullwell.pipeline import StageStore, run_frame  # noqa: PLC0415
        from fullwell.schema import KeptScene, RecipeBuilder  # noqa: PLC0415

        if self._stages is None or self._stages.store is not store:
            limit = load_settings().cache_bytes
            self._stages = StageStore(store, max_bytes=limit) if limit else None
        if self._builder is None or self._document is not document:
            if self._scene is None:
                self._scene = KeptScene()
            assets = self._assets_of(store)
            self._builder = RecipeBuilder(document, base_dir=base_dir, assets=assets, kept=self._scene)
            self._document = document
        return run_frame(
            document,
            index,
            store,
            prefix,
            builder=self._builder,
            stages=self._stages,
            progress=progress,
            should_cancel=should_cancel,
        )

    def _assets_of(self, store: ObjectStore) -> StoredAssets:
        """Return the store's assets; all processes of this machine keep their models in one folder."""
        from fullwell.assets.cache import BlobCache  # noqa: PLC0415
        from fullwell.assets.store import StoredAssets  # noqa: PLC0415

        if self._assets is None or self._assets.store is not store:
            settings = load_settings()
            self._assets = StoredAssets(store, BlobCache(settings.asset_cache, settings.asset_cache_bytes))
        return self._assets
