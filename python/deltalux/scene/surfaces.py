# SPDX-License-Identifier: Apache-2.0
"""How materials scatter light: one class per kind, with everything that the package needs to know of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from deltalux import _core
from deltalux.errors import SceneError

from .arrays import NUMBER, frozen_array

MOST_INDEX = 10.0  # of refraction; no glass is near


@dataclass(frozen=True, eq=False)
class Surface:
    """Common base of all kinds.

    The mean reflectance is the material's; a kind describes everything else.
    """

    # the name in session files and in the core
    kind: ClassVar[str]
    fields: ClassVar[Mapping[str, tuple[int, ...]]]  # with their shapes
    reads_texture: ClassVar[bool] = False  # whether meshes need texture coordinates

    def __init__(self, **values: Any) -> None:
        for key, value in values.items():
            object.__setattr__(self, key, self._checked(key, value))

    def _checked(self, key: str, value: Any) -> Any:
        shape = self.fields[key]
        if shape == NUMBER:
            try:
                return float(value)
            except (TypeError, ValueError):
                raise SceneError(
                    f"{self.kind} surface: {key}: found {value!r:.40}, expected a number"
                ) from None
        return frozen_array(value, np.float64, shape, f"{self.kind} surface: {key}")

    def parameters(self) -> tuple[float, ...]:
        """Further parameters of the core's surface of this kind."""
        return ()


@dataclass(frozen=True, eq=False, init=False)
class DiffuseSurface(Surface):
    """The same reflectance everywhere, light scattered equally in all directions."""

    kind = "diffuse"
    fields: ClassVar = {}

    def __init__(self) -> None:
        super().__init__()


@dataclass(frozen=True, eq=False, init=False)
class PaneSurface(Surface):
    """A thin sheet that light passes straight: glass, or a surface that covers a part of its area.

    Gaps, glass and a diffuse rest lie side by side; the material's reflectance is that of the rest. Glass
    mirrors and lets pass what Fresnel's equations say, as a mean over both polarisations.

    Parameters
    ----------
    coverage : share of the area that is no gap, 0 to 1
        The alpha of a blended surface; gaps let all light pass. A texture's alpha is a further factor.
    transmission : share of the covered area that is glass, 0 to 1
    index : index of refraction of the glass, 1 to 10; at 1 it mirrors nothing
    faces : 1 or 2
        1: light meets one smooth face, as in KHR_materials_transmission. 2: it passes a plate, with all
        reflections between its faces (CIE 171:2006, section 5.10).
    inner : share of the light that is not absorbed on the shortest way through a plate, 0 to 1
    tint : a further factor on what passes the glass, 0 to 1; grey
    """

    kind = "pane"
    fields: ClassVar = dict.fromkeys(("coverage", "transmission", "index", "faces", "inner", "tint"), NUMBER)

    coverage: float
    transmission: float
    index: float
    faces: float
    inner: float
    tint: float

    def __init__(
        self,
        coverage: float = 1.0,
        transmission: float = 1.0,
        index: float = 1.5,
        faces: float = 1,
        inner: float = 1.0,
        tint: float = 1.0,
    ) -> None:
        super().__init__(
            coverage=coverage, transmission=transmission, index=index, faces=faces, inner=inner, tint=tint
        )
        for name in ("coverage", "transmission", "inner", "tint"):
            self._require(name, 0.0, 1.0)
        self._require("index", 1.0, MOST_INDEX)
        if self.faces not in (1, 2):
            raise SceneError(f"pane surface: faces: found {self.faces:g}, expected 1 or 2")

    def parameters(self) -> tuple[float, ...]:
        """Its fields in their order."""
        return tuple(getattr(self, name) for name in self.fields)

    @property
    def passes(self) -> float:
        """Share of the light that passes at a right angle."""
        return float(self.shares(np.ones(1))[0][0])

    @property
    def scattered(self) -> float:
        """Share of the diffuse rest in what hides things behind, seen at a right angle."""
        straight, diffuse = (float(share[0]) for share in self.shares(np.ones(1)))
        return diffuse / (1 - straight) if straight < 1 else 0.0

    def shares(self, cosine: np.ndarray, opacity: np.ndarray | float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Shares (k,) of the light that pass straight, and that are for the diffuse rest.

        Parameters
        ----------
        cosine : (k,) of the angle between light and normal
        opacity : (k,), a factor on the coverage
        """
        ones = np.ones(len(cosine))
        found = np.asarray(_core.pane_shares(self.parameters(), cosine * ones, opacity * ones), np.float64)
        return found[:, 0], found[:, 1]

    def _require(self, name: str, least: float, most: float) -> None:
        value = getattr(self, name)
        if not least <= value <= most:
            raise SceneError(f"pane surface: {name}: found {value:g}, expected {least:g} to {most:g}")


DIFFUSE = DiffuseSurface()
# Clear glass of 6 mm, as CIE 171:2006 has it in section 5.10.
WINDOW = PaneSurface(index=1.52, faces=2, inner=0.96)

KINDS: dict[str, type[Surface]] = {cls.kind: cls for cls in (DiffuseSurface, PaneSurface)}
