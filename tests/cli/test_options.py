# SPDX-License-Identifier: Apache-2.0
"""Values of options: what is understood, and what is refused with its form."""

from __future__ import annotations

from typing import Any

import pytest
import typer
from deltalux.cli import options
from deltalux.cli.options import Grid, Move, Setting


@pytest.mark.parametrize(
    ("parse", "text", "value"),
    [
        (options.parse_grid, "1,0.8,-2,4,3,0.25", Grid((1, 0.8, -2), 4, 3, 0.25)),
        (options.parse_move, "chair=0.5,0,-1", Move("chair", (0.5, 0, -1), 0)),
        (options.parse_move, "chair=0.5,0,-1,90", Move("chair", (0.5, 0, -1), 90)),
        (options.parse_move, "a=b=1,2,3", Move("a=b", (1, 2, 3), 0)),
        (options.parse_dim, "desk lamp=0.3", Setting("desk lamp", (0.3,))),
        (options.parse_reflectance, "oak=.4,.3,.2", Setting("oak", (0.4, 0.3, 0.2))),
        (options.parse_reflectance, "oak=0.5", Setting("oak", (0.5, 0.5, 0.5))),
        (options.parse_count, "1e6", 1_000_000),
        (options.parse_count, "250_000", 250_000),
        (options.parse_positive, "0.05", 0.05),
        (options.parse_bytes, "4G", 4 * 2**30),
        (options.parse_bytes, "1.5 GiB", 3 * 2**29),
        (options.parse_bytes, "800mb", 800 * 2**20),
        (options.parse_bytes, "4096", 4096),
    ],
)
def test_is_understood(parse: Any, text: str, value: Any) -> None:
    assert parse(text) == value


@pytest.mark.parametrize(
    ("parse", "text"),
    [
        (options.parse_grid, "1,2,3,4,5"),
        (options.parse_grid, "1,2,3,4,5,0"),
        (options.parse_grid, "1,2,3,-4,5,1"),
        (options.parse_grid, "1,2,3,4,5,nan"),
        (options.parse_move, "chair"),
        (options.parse_move, "=1,2,3"),
        (options.parse_move, "chair=1,2"),
        (options.parse_move, "chair=1,2,inf"),
        (options.parse_dim, "desk=-1"),
        (options.parse_dim, "desk=a"),
        (options.parse_reflectance, "oak=.1,.2"),
        (options.parse_reflectance, "oak=.1,.2,1.2"),
        (options.parse_count, "0"),
        (options.parse_count, "1.5"),
        (options.parse_count, "many"),
        (options.parse_count, "inf"),
        (options.parse_count, "1" * 400),
        (options.parse_count, "1e999"),
        (options.parse_count, "nan"),
        (options.parse_positive, "0"),
        (options.parse_positive, "-1"),
        (options.parse_bytes, "G"),
        (options.parse_bytes, "-1G"),
        (options.parse_bytes, "4X"),
        (options.parse_bytes, "1e30T"),
        (options.parse_bytes, "1e308T"),
    ],
)
def test_is_refused_with_what_was_found_and_expected(parse: Any, text: str) -> None:
    with pytest.raises(typer.BadParameter) as error:
        parse(text)
    assert str(error.value).startswith(f"found '{text}', expected ")
