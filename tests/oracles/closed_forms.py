# SPDX-License-Identifier: Apache-2.0
"""Closed forms of irradiance: what an exact solver must give in scenes that can be solved by hand.

Sources
-------
[H]  J. R. Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", 3rd ed.
[L]  J. H. Lambert, "Photometria" (1760): irradiance from a uniform polygon; modern form in
     J. Arvo, "Analytic Methods for Simulated Light Transport" (1995), ch. 2.
[K]  Khronos Group, KHR_lights_punctual, section "Inner and Outer Cone Angles".
[C]  M. F. Cohen, J. R. Wallace, "Radiosity and Realistic Image Synthesis" (1993), ch. 2.

Configuration factors are dimensionless: irradiance = pi * radiance * factor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def _array(values: ArrayLike) -> Array:
    return np.asarray(values, dtype=np.float64)


# Enclosures.


def furnace_irradiance(emission: ArrayLike, reflectance: ArrayLike) -> Array:
    """Irradiance everywhere in a closed room whose surfaces all emit and reflect alike [C].

    The radiance is L = emission / (1 - reflectance) in every direction, so E = pi L.
    """
    return np.pi * _array(emission) / (1 - _array(reflectance))


def sphere_cavity_indirect(power: ArrayLike, reflectance: ArrayLike, radius: float) -> Array:
    """Indirect irradiance, the same everywhere inside a diffuse sphere, for any light of that power.

    Every point of a sphere sees every other under the same form factor (dA / 4 pi R^2), so
    light that was reflected once is already uniform: rho Phi / (4 pi R^2 (1 - rho)) [C].
    """
    rho = _array(reflectance)
    return rho * _array(power) / (4 * np.pi * radius**2 * (1 - rho))


def hemisphere_indirect(flux: ArrayLike, reflectance: ArrayLike, radius: float) -> Array:
    """Indirect irradiance, the same everywhere inside an open diffuse hemisphere that catches `flux`.

    As in the whole sphere, of which it is one half: of what it reflects, half meets it again.
    """
    rho = _array(reflectance)
    return rho * _array(flux) / (4 * np.pi * radius**2 * (1 - rho / 2))


def enclosure_mean(power: ArrayLike, area: float, reflectance: ArrayLike) -> Array:
    """Mean irradiance over the area of any closed room of one reflectance: Phi / (S (1 - rho)).

    From the energy balance: absorbed = emitted, (1 - rho) S mean(E) = Phi.
    """
    return _array(power) / (area * (1 - _array(reflectance)))


# Lights without extent.


def point_irradiance(
    position: ArrayLike, intensity: ArrayLike, points: ArrayLike, normals: ArrayLike
) -> Array:
    """Inverse square law: I cos(theta) / r^2, unoccluded.

    Parameters
    ----------
    position : (3,); intensity : (3,); points, normals : (n, 3), normals of unit length

    Returns
    -------
    (n, 3) irradiance; 0 where the light is behind the surface.
    """
    to_light = _array(position) - _array(points)
    distance = np.linalg.norm(to_light, axis=1)
    cosine = np.einsum("ij,ij->i", to_light, _array(normals)) / distance
    return (np.maximum(cosine, 0) / distance**2)[:, None] * _array(intensity)


def spot_falloff(cosine: ArrayLike, inner_angle: float, outer_angle: float) -> Array:
    """Share of the spot's intensity at that cosine to its axis: clamp(...)^2 of [K]."""
    inner, outer = np.cos(inner_angle), np.cos(outer_angle)
    return np.clip((_array(cosine) - outer) / max(inner - outer, 1e-12), 0, 1) ** 2


def spot_irradiance(
    position: ArrayLike,
    direction: ArrayLike,
    intensity: ArrayLike,
    inner_angle: float,
    outer_angle: float,
    points: ArrayLike,
    normals: ArrayLike,
) -> Array:
    """A point light times `spot_falloff`; angles are half angles, radians; returns (n, 3)."""
    from_light = _array(points) - _array(position)
    axis = _array(direction) / np.linalg.norm(direction)
    cosine = from_light @ axis / np.linalg.norm(from_light, axis=1)
    share = spot_falloff(cosine, inner_angle, outer_angle)
    return share[:, None] * point_irradiance(position, intensity, points, normals)


def sun_irradiance(direction: ArrayLike, irradiance: ArrayLike, normals: ArrayLike) -> Array:
    """Parallel light that travels along `direction`: (n, 3), cosine law only."""
    axis = _array(direction) / np.linalg.norm(direction)
    return np.maximum(-_array(normals) @ axis, 0)[:, None] * _array(irradiance)


# Configuration factors from a plane element.


def element_to_parallel_disc(height: ArrayLike, offset: ArrayLike, radius: float) -> Array:
    """Element facing a disc in a parallel plane [H, B-13; on the axis B-12: r^2 / (h^2 + r^2)].

    Parameters
    ----------
    height : distance between the planes; offset : of the element from the disc's axis
    """
    h2, a2, r2 = _array(height) ** 2, _array(offset) ** 2, radius**2
    z = h2 + a2 + r2
    return 0.5 * (1 - (h2 + a2 - r2) / np.sqrt(z**2 - 4 * r2 * a2))


def element_to_perpendicular_disc(height: ArrayLike, offset: ArrayLike, radius: float) -> Array:
    """Element whose normal is parallel to the disc's plane and meets its axis [H, B-14].

    Parameters
    ----------
    height : of the element above the disc's plane
    offset : of the element from the disc's axis, at least the radius (else the horizon cuts the disc)
    """
    h, a = _array(height), _array(offset)
    z = h**2 + a**2 + radius**2
    return h / (2 * a) * (z / np.sqrt(z**2 - 4 * radius**2 * a**2) - 1)


def element_to_parallel_rectangle(a: ArrayLike, b: ArrayLike, distance: ArrayLike) -> Array:
    """Element facing a parallel a x b rectangle, below one of its corners [H, B-3]."""
    x, y = _array(a) / _array(distance), _array(b) / _array(distance)
    u, v = np.sqrt(1 + x**2), np.sqrt(1 + y**2)
    return (x / u * np.arctan(y / u) + y / v * np.arctan(x / v)) / (2 * np.pi)


def element_to_perpendicular_rectangle(height: ArrayLike, width: ArrayLike, distance: ArrayLike) -> Array:
    """Element at `distance` before the corner of a rectangle that stands on the element's plane [H, B-4]."""
    h, w, d = _array(height), _array(width), _array(distance)
    s = np.sqrt(d**2 + h**2)
    return (np.arctan(w / d) - d / s * np.arctan(w / s)) / (2 * np.pi)


# Uniform polygon of any place and attitude.


def _edge_term(a: Array, b: Array, normals: Array) -> Array:
    """Angle under which the edge a-b is seen, times its unit normal dotted with `normals` [L]."""
    cross = np.cross(a, b)
    sine = np.linalg.norm(cross, axis=1)
    angle = np.arctan2(sine, np.einsum("ij,ij->i", a, b))
    along = np.einsum("ij,ij->i", cross, normals)
    return np.divide(angle * along, sine, out=np.zeros_like(sine), where=sine > 0)


def polygon_factor(points: ArrayLike, normals: ArrayLike, polygon: ArrayLike) -> Array:
    """Configuration factors from plane elements to a convex polygon, exact [L].

    The part of the polygon below an element's horizon is cut off; what stands behind the
    polygon (which shows its front where its vertices run counter-clockwise) gets 0.

    Parameters
    ----------
    points, normals : (n, 3), normals of unit length
    polygon : (k, 3) vertices of a plane convex polygon

    Returns
    -------
    (n,) factors.
    """
    points, normals, polygon = _array(points), _array(normals), _array(polygon)
    total = np.zeros(len(points))
    leaving, entering = np.zeros_like(points), np.zeros_like(points)
    corners = polygon[None] - points[:, None]
    heights = np.einsum("ikj,ij->ik", corners, normals)
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        a, b, ha, hb = corners[:, i], corners[:, j], heights[:, i], heights[:, j]
        crosses = (ha > 0) != (hb > 0)
        t = np.divide(ha, ha - hb, out=np.zeros_like(ha), where=crosses)[:, None]
        cut = a + t * (b - a)
        start = np.where((ha > 0)[:, None], a, cut)
        end = np.where((hb > 0)[:, None], b, cut)
        above = (ha > 0) | (hb > 0)
        total += np.where(above, _edge_term(start, end, normals), 0)
        leaving = np.where((crosses & (ha > 0))[:, None], cut, leaving)
        entering = np.where((crosses & (hb > 0))[:, None], cut, entering)
    # The cut closes the polygon along the horizon (a zero term where there was no cut).
    total += _edge_term(leaving, entering, normals)
    # Seen from its front, the polygon runs counter-clockwise as the element looks at it,
    # which is clockwise about the outward direction: the contour sum is negative there.
    return np.maximum(-total, 0) / (2 * np.pi)


def polygon_irradiance(
    points: ArrayLike, normals: ArrayLike, polygon: ArrayLike, radiance: ArrayLike
) -> Array:
    """Unoccluded irradiance (n, 3) from a uniform convex polygon of that radiance (3,)."""
    return np.pi * polygon_factor(points, normals, polygon)[:, None] * _array(radiance)
