# SPDX-License-Identifier: Apache-2.0
"""What a session reports about its present state without computing anything."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from deltalux.errors import OptionError
from deltalux.mesh.display_mesh import in_world
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.scene.flatten import FlatScene

from .calls import Calls, short_call


class SessionFacts:
    """State of a session after its edits. `Session` creates and changes it."""

    scene: Scene
    samples: Samples
    _options: dict[str, Any]
    _core: Any
    _flat: FlatScene
    _edits: Any
    _poses: dict[str, np.ndarray]
    _removed: set[str]
    _factors: dict[str, float]
    _reflectances: dict[str, tuple[float, ...]]
    _box: np.ndarray
    _calls: Calls

    def __repr__(self) -> str:
        state = "baked" if self.baked else "not baked"
        return f"Session({self.scene!r}, {self.samples!r}, {state})"

    def _session(self) -> Any:
        if self._core is None:
            raise OptionError("session: it was closed; make or open another")
        return self._core

    def _baked_session(self) -> Any:
        session = self._session()
        if not session.baked:
            raise OptionError("session: there is no light yet; call bake() first")
        return session

    @property
    def baked(self) -> bool:
        """Whether the session has light."""
        core = self._core
        return core is not None and core.baked

    @property
    def unfinished(self) -> bool:
        """Whether the light lags behind the present state: `update` has edits or paths left to process."""
        return self.baked and (len(self._edits) > 0 or self._core.pending > 0)

    @property
    @short_call
    def sums(self) -> np.ndarray:
        """(n, 3) int64: exact sums of the energy that discs count, in quanta, all groups undimmed.

        With a final gather, these are first segments from lights without shadow rays: in most sessions none.
        """
        return self._baked_session().sums()

    @property
    @short_call
    def energy(self) -> dict[str, Any]:
        """Emitted, absorbed and escaped power in integer quanta per channel, and the quantum."""
        return self._baked_session().audit()

    @property
    @short_call
    def statistics(self) -> dict[str, Any]:
        """Counts and memory of the session."""
        return self._session().statistics()

    @property
    @short_call
    def unreached(self) -> int:
        """Number of samples that no path brings light to (in a closed cupboard, or from too few paths).

        In a session that gathers: samples whose rays hit no surface that a path reached or a lamp lights.
        """
        return self._baked_session().unreached

    def world(self) -> tuple[np.ndarray, np.ndarray]:
        """Points and normals of the samples in world space, in the present poses, each (n, 3)."""
        own = self.samples
        return in_world(own.points, own.normals, own.attached, self._poses.copy())

    @property
    def poses(self) -> dict[str, np.ndarray | None]:
        """Present pose of each movable, None for removed ones."""
        return {name: None if name in self._removed else pose for name, pose in self._poses.copy().items()}

    @property
    def dim_factors(self) -> dict[str, float]:
        """Present factor of each light group."""
        return dict(self._factors)

    @property
    def reflectances(self) -> dict[str, tuple[float, ...]]:
        """Present reflectance of each material, 3 values."""
        return dict(self._reflectances)

    @property
    def origin(self) -> np.ndarray:
        """(3,) float64: origin of the core's coordinates; not zero in a scene that lies far from zero."""
        return self._flat.origin.copy()

    @property
    def box(self) -> np.ndarray:
        """(2, 3) float64, lowest and highest corner of the scene when the session was made.

        A move that takes a mesh or a light out of this box, or farther out, makes the next update compute
        everything again; so does one that brings the last one back.
        """
        return self._box.copy()

    def reach(self) -> Callable[[np.ndarray, np.ndarray], str]:
        """Make a function that says why no object can have these bounds; it says "" if one can.

        It may be called while the session works. The bounds, lowest and highest corner, count from `origin`.
        """
        core = self._core.reach()
        return lambda low, high: str(core.refusal(tuple(map(float, low)), tuple(map(float, high))))

    @property
    def options(self) -> dict[str, Any]:
        """The options that the session was made with."""
        return self._options.copy()
