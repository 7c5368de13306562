# SPDX-License-Identifier: Apache-2.0
"""Sessions that processes and machines share, with the bits of one process."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deltalux import core_session
from deltalux.errors import OptionError
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import Progress, check_integer
from deltalux.session import Session
from deltalux.session_options import SessionOptions, takes

from .core import SharedCore
from .extra import check_extra
from .shard import Blueprint, Edit
from .shards import Shards

if TYPE_CHECKING:
    from distributed import Client
    from typing_extensions import Unpack

MOST_SHARDS = 65536


@takes(SessionOptions)
class ClusterSession(Session):
    """A `Session` that is shared among the workers of a Dask cluster, with the same bits.

    Each shard holds a range of the paths, in the memory of a worker, for the session's life. In a bake,
    shards also cast shadow rays and gather rays, each for the samples that come next; what they met is kept
    here. Edits go to all shards; what they changed of integer sums comes back, is added up here, and light is
    read from that. Results, digest and files are those of `Session`, whatever the numbers of shards and
    workers. A shard whose worker is lost is traced again by another one (see `notes`), to the same bits.

    Parameters
    ----------
    scene : Scene
    samples : Samples or None
        None: on the vertices of the scene's display mesh.
    client : distributed.Client
        Connected to the cluster. All workers need this version of deltalux, the same Embree and instruction
        set.
    shards : number of parts of the paths; None: two for each worker that is there now
    patience : seconds to wait for a worker when there is none
    {options}
    progress : callable (stage, fraction) -> keep going, or None
        Called on the calling thread; returning False cancels.

    Raises
    ------
    OptionError, SceneError
    Error
        If the extra ``deltalux[cluster]`` is not installed; of calls: if no worker comes in time, a worker is
        of another build, or a shard ends its workers again and again.

    Notes
    -----
    `threads` is about this process; a worker uses as many as Dask gave it. `memory_limit` holds for this
    process and for each shard. A budget of `update` is for direct light and gather rays, shards always end
    their part. If a bake is cancelled, there is no light until the next one. An update that is
    cancelled when the shards are at work leaves a session that refuses to be read until the next `update`
    ended the work.
    """

    def __init__(
        self,
        scene: Scene,
        samples: Samples | None = None,
        *,
        client: Client,
        shards: int | None = None,
        patience: float = 60.0,
        progress: Progress | None = None,
        **options: Unpack[SessionOptions],
    ) -> None:
        check_extra("ClusterSession")
        if options.get("path_range") is not None:
            raise OptionError(
                f"path_range: found {options['path_range']!r:.60}, expected None: the shards share all paths"
            )
        if shards is not None:
            check_integer("shards", shards, 1, MOST_SHARDS)
        self._client, self._patience = client, patience
        self._count = shards or 2 * max(1, len(client.nthreads()))
        super().__init__(scene, samples, progress=progress, **options)

    def _make_core(self) -> SharedCore:
        own = {**self._options, "path_range": (0, 0)}
        core = core_session.make_core_session(self.scene, self._flat, self.samples, own)
        bare = copy.copy(self.samples)
        bare.display = None  # which shards do not need
        blueprint = Blueprint(self.scene, bare, self._options, core_session.description())
        shards = Shards(self._client, blueprint, min(self._count, own["paths"]), self._patience)
        return SharedCore(core, shards, self.scene)

    def _another(self, scene: Scene, samples: Samples | None) -> ClusterSession:
        return ClusterSession(
            scene, samples, client=self._client, shards=self._count, patience=self._patience,
            progress=self.progress, **self._options,
        )  # fmt: skip

    def _queue(self, kind: str, *values: Any) -> None:
        super()._queue(kind, *values)
        self._session().said.append(Edit(kind, values))

    def close(self) -> None:
        """Free the memory of the session and of its shards; results that were read stay valid."""
        if self._core is not None:
            self._core.close()
        super().close()

    @property
    def shards(self) -> int:
        """Number of shards."""
        return self._count

    @property
    def notes(self) -> list[str]:
        """What happened to workers: a sentence for each shard that was lost and traced again."""
        return list(self._session().notes)

    @classmethod
    def open(  # type: ignore[override]
        cls,
        path: str | Path,
        *,
        client: Client,
        shards: int | None = None,
        patience: float = 60.0,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> ClusterSession:
        """Open a session that `Session.save` or `ClusterSession.save` wrote.

        Light is there as it was saved. The paths are traced again by the shards, to the same bits: that takes
        less time than to send them.

        Raises
        ------
        FormatError
            For a file that is missing, truncated, foreign or of another version.
        """
        return cls._open(path, threads, progress, client=client, shards=shards, patience=patience)
