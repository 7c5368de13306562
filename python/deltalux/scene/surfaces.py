# SPDX-License-Identifier: Apache-2.0
"""How materials scatter light: one class per kind, with everything that the package needs to know of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from .arrays import NUMBER, frozen_array


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
            return float(value)
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


DIFFUSE = DiffuseSurface()

KINDS: dict[str, type[Surface]] = {cls.kind: cls for cls in (DiffuseSurface,)}
