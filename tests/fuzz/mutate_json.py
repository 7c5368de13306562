# SPDX-License-Identifier: Apache-2.0
"""Mutations of JSON trees: wrong values, wrong places, too many, too deep."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any

import numpy as np

Rng = np.random.Generator
MAX_REPEATED_BYTES = 200_000

COMPONENT_TYPES = [5120, 5121, 5122, 5123, 5125, 5126, 5130]
NUMBERS = [
    0,
    1,
    -1,
    2,
    3,
    4,
    5,
    7,
    255,
    256,
    65535,
    65536,
    0.5,
    -0.0,
    1e-300,
    1e300,
    1e308,
    10**30,
    2**53,
    2**63,
]
NUMBERS += [2**31 - 1, 2**31, 2**32 - 1, 2**32, *COMPONENT_TYPES]
URIS = [
    "../x.bin",
    "/dev/zero",
    "/etc/passwd",
    "data:,",
    "data:;base64,AAAA",
    "http://localhost/",
    "scene.glb",
    ".",
]
EXTENSIONS = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization"]
TEXTS = ["", "SCALAR", "VEC3", "VEC2", "MAT4", "point", "spot", "directional", "MASK", "2.0", "1.0", "MOVE_x"]
TEXTS += ["\x00", "\ud800", "9" * 400, "x" * 10_000, *URIS, *EXTENSIONS]
OTHERS = [None, True, False, [], {}, [[]], [None], {"a": {}}, [0] * 16, [1e30] * 16, [0, 0, 0, 0]]


def places(root: Any) -> list[tuple[Any, Any]]:
    """Every (container, key) of a JSON tree."""
    found, stack = [], [root]
    while stack:
        item = stack.pop()
        keys = list(item) if isinstance(item, dict) else range(len(item)) if isinstance(item, list) else ()
        for key in keys:
            found.append((item, key))
            stack.append(item[key])
    return found


def pick(rng: Rng, items: list[Any]) -> Any:
    """One of the items."""
    return items[rng.integers(len(items))]


def any_value(rng: Rng) -> Any:
    """A value that some reader has stumbled over."""
    return copy.deepcopy(pick(rng, pick(rng, [NUMBERS, NUMBERS, TEXTS, OTHERS])))


def replace_value(rng: Rng, root: Any) -> None:
    """Put any value at any place."""
    if found := places(root):
        container, key = pick(rng, found)
        container[key] = any_value(rng)


def nudge_number(rng: Rng, root: Any) -> None:
    """Change a number a little, or its sign, size or a bit."""
    found = [(c, k) for c, k in places(root) if isinstance(c[k], int | float) and not isinstance(c[k], bool)]
    if found:
        container, key = pick(rng, found)
        value = container[key]
        bit = 1 << int(rng.integers(40))
        changed = int(value) ^ bit if abs(value) < 2**60 else 0
        small = int(rng.integers(6))  # most integers of a file are indexes of short lists
        container[key] = pick(rng, [value + 1, value - 1, -value, value * 2, changed, small, small])


def delete_value(rng: Rng, root: Any) -> None:
    """Remove a field or an element."""
    if found := places(root):
        container, key = pick(rng, found)
        del container[key]


def copy_value(rng: Rng, root: Any) -> None:
    """Copy one value over another."""
    if found := places(root):
        (source, source_key), (target, key) = pick(rng, found), pick(rng, found)
        target[key] = copy.deepcopy(source[source_key])


def swap_sequence(rng: Rng, root: Any) -> None:
    """Shuffle or repeat a list: nodes, primitives, children, indices."""
    found = [(c, k) for c, k in places(root) if isinstance(c[k], list) and c[k]]
    if found:
        container, key = pick(rng, found)
        items = container[key]
        if rng.random() < 0.5:
            container[key] = [items[i] for i in rng.permutation(len(items))]
        else:
            most = MAX_REPEATED_BYTES // len(json.dumps(items))  # lists in lists would grow without bound
            container[key] = items * int(min(rng.integers(2, 60), max(most, 1)))


def nest_deeply(rng: Rng, root: Any) -> None:
    """Put a deep list at some place."""
    if found := places(root):
        container, key = pick(rng, found)
        deep: Any = []
        for _ in range(int(rng.integers(2, 300))):
            deep = [deep] if rng.random() < 0.5 else {"extras": deep}
        container[key] = deep


def rename_key(rng: Rng, root: Any) -> None:
    """Give a field the name of another one."""
    found = [(c, k) for c, k in places(root) if isinstance(c, dict)]
    if found:
        (container, key), (_, other) = pick(rng, found), pick(rng, found)
        container[other] = container.pop(key)


# Repeated ones come more often: changes that keep the types get further into a reader.
JSON_CHANGES: list[Callable[[Rng, Any], None]] = [
    *[nudge_number] * 8,
    *[replace_value] * 3,
    *[swap_sequence] * 2,
    *[delete_value] * 2,
    copy_value,
    nest_deeply,
    rename_key,
]


def change_json(rng: Rng, root: Any) -> None:
    """Change a tree in a place or a few."""
    for _ in range(rng.geometric(0.5)):
        pick(rng, JSON_CHANGES)(rng, root)
