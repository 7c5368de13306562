# SPDX-License-Identifier: Apache-2.0
"""DELTALUX_ISA limits the instruction sets; each gives the same light to the bit."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from thoroughness import slow

NAMES = ("portable", "avx2", "avx512")
METHODS = ("disc_index", "brute_force", "ray_map", "sphere_cache")
# Prints what is to be the same, or the error.
PROGRAM = """
import hashlib
import sys
import deltalux as dl
from rooms import room, samples_in, translation

scene = room()
samples = samples_in(scene)
try:
    for method in sys.argv[1:]:
        for options in ({"direct": "paths"}, {"segment_end": "bounded"}):
            with dl.Session(
                scene, samples, paths=2000, gather=64, static_method=method, moving_method=method, **options
            ) as session:
                session.bake()
                print(method, session.digest())
                session.move("block", translation(-0.4, 0.5, 0.1))
                session.remove("lamp")
                session.update()
                session.set_reflectance("wall", (0.3, 0.7, 0.2))
                session.add("lamp")
                session.update()
                light = session.irradiance.tobytes() + session.standard_error.tobytes()
                print(method, session.digest(), hashlib.sha256(light).hexdigest())
except dl.OptionError as error:
    print("refused:", error)
"""


def run(name: str | None, *methods: str) -> str:
    """What PROGRAM prints with this DELTALUX_ISA, or with none."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    environment.pop("DELTALUX_ISA", None)
    if name is not None:
        environment["DELTALUX_ISA"] = name
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *methods], capture_output=True, text=True, check=True, env=environment
    )
    return done.stdout


@pytest.mark.parametrize("methods", [METHODS[:1], slow(METHODS[1:])])
def test_every_instruction_set_gives_the_same_light(methods):
    expected = run(None, *methods)
    lines = expected.splitlines()
    assert len(lines) == 4 * len(methods)
    assert len({line.split(maxsplit=1)[1] for line in lines}) == 4  # methods agree, options differ
    shown = {name: run(name, *methods) for name in NAMES}
    accepted = [name for name, text in shown.items() if not text.startswith("refused:")]
    assert accepted[0] == "portable"
    for name in accepted:
        assert shown[name] == expected, name
    available = ", ".join(f'"{name}"' for name in accepted)
    for name in set(NAMES) - set(accepted):
        assert shown[name] == (
            f'refused: DELTALUX_ISA: found "{name}", expected {available} '
            "(what this processor and this build have); unset it for the best\n"
        )


def test_a_name_that_is_none_is_refused_before_any_work():
    assert run("sse9", *METHODS).startswith('refused: DELTALUX_ISA: found "sse9", expected "portable"')
