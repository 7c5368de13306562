# SPDX-License-Identifier: Apache-2.0
"""Irradiance at any points by interpolation between samples: split-sphere weights, surface gradients."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.spatial import cKDTree

from deltalux.errors import OptionError
from deltalux.mesh.display_mesh import in_world

NEIGHBOURS = 8
LIFT = 0.02  # as a share of the reach: lifts the end points of visibility tests off the surfaces
IN_FRONT = 0.05  # as a share of the reach: samples farther in front of the point are rejected
LARGEST_TURN = 0.7  # least cosine between the normals of a point and of a sample that it uses

Visible = Callable[[np.ndarray, np.ndarray], np.ndarray]


class Interpolator:
    """Weighted means of nearby samples (Ward, Rubinstein & Clear 1988; Ward & Heckbert 1992).

    A sample i with normal n_i is weighted by the inverse of its error bound

        |p - p_i| / reach_i + sqrt(1 - n . n_i)

    where reach_i is twice the distance to its sixth neighbour (split-sphere model), and its value
    may be extrapolated along its surface gradient. A sample is rejected if it lies in front of the
    point, if the normals differ by more than 45 degrees, or if a surface lies in between.
    A point without any sample takes the nearest sample with a similar normal, else the nearest.

    Parameters
    ----------
    points, normals : (n, 3) of the samples, world space, n > 0
    """

    def __init__(self, points: np.ndarray, normals: np.ndarray) -> None:
        self.points, self.normals = points, normals
        distances, _ = cKDTree(points).query(points, min(7, len(points)))
        self.reach = np.maximum(2 * distances.reshape(len(points), -1)[:, -1], 1e-6)
        # Where samples are sparse, a similar normal matters more than a short distance.
        self._scale = float(np.quantile(self.reach, 0.95))
        self._tree = cKDTree(self._place(points, normals))

    def _place(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Coordinates in which distance measures the error bound: |n - n_i|^2 / 2 = 1 - n . n_i."""
        return np.hstack([points / self._scale, normals * np.sqrt(0.5)])

    def weights(
        self, points: np.ndarray, normals: np.ndarray, visible: Visible
    ) -> tuple[np.ndarray, np.ndarray]:
        """Samples (m, k) and their weights (m, k); each row of weights adds up to 1."""
        count = min(NEIGHBOURS, len(self.points))
        _, index = self._tree.query(self._place(points, normals), count)
        index = index.reshape(len(points), count)
        way = points[:, None] - self.points[index]
        turn = np.einsum("mi,mki->mk", normals, self.normals[index])
        between = normals[:, None] + self.normals[index]
        in_front = -0.5 * np.einsum("mki,mki->mk", way, between)
        reach = self.reach[index]
        serves = (turn > LARGEST_TURN) & (in_front < IN_FRONT * reach)
        asked = np.nonzero(serves)
        lift = LIFT * reach[asked][:, None]
        serves[asked] = visible(
            points[asked[0]] + lift * normals[asked[0]],
            self.points[index[asked]] + lift * self.normals[index[asked]],
        )
        bound = np.linalg.norm(way, axis=2) / reach + np.sqrt(np.maximum(0, 1 - turn))
        weight = np.where(serves, 1 / np.maximum(bound, 1e-6), 0.0)
        alone = ~serves.any(axis=1)
        choice = np.argmax(turn[alone] > LARGEST_TURN, axis=1)  # neighbours are sorted by distance
        weight[np.flatnonzero(alone), choice] = 1.0
        return index, weight / weight.sum(axis=1, keepdims=True)

    def __call__(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        values: np.ndarray,
        gradients: np.ndarray | None,
        visible: Visible,
    ) -> np.ndarray:
        """Values (m, 3) from those at the samples (n, 3) and their gradients (n, 3, 3) or None.

        An extrapolated value stays between zero and twice the sample's.
        """
        index, weight = self.weights(points, normals, visible)
        near = values[index]
        if gradients is not None:
            way = points[:, None] - self.points[index]
            change = np.einsum("mkci,mki->mkc", gradients[index], way)
            near = np.clip(near + change, 0, 2 * near)
        return np.einsum("mk,mkc->mc", weight, near)


class Interpolators:
    """The interpolator over the samples that are present; rebuilt after they moved or were removed."""

    def __init__(self) -> None:
        self._latest: tuple[list, np.ndarray, Interpolator] | None = None

    def over(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        attached: np.ndarray,
        poses: Mapping[str, np.ndarray | None],
    ) -> tuple[np.ndarray, Interpolator]:
        """Numbers of the samples that are present, and the interpolator over them in world space.

        Parameters
        ----------
        points, normals : (n, 3), local where `attached`
        attached : (n,) names of movables, or None
        poses : of the movables; None if removed

        Raises
        ------
        OptionError
            If no sample is present.
        """
        own = {name: poses[name] for name in attached if name is not None}
        state = [(name, None if pose is None else pose.tobytes()) for name, pose in sorted(own.items())]
        if self._latest is None or self._latest[0] != state:
            there = {name: pose for name, pose in own.items() if pose is not None}
            present = np.flatnonzero([name is None or name in there for name in attached])
            if not len(present):
                raise OptionError("at: found no sample that is present, expected at least one")
            places = (array[present] for array in in_world(points, normals, attached, there))
            self._latest = state, present, Interpolator(*places)
        return self._latest[1:]
