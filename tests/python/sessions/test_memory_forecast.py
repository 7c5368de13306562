# SPDX-License-Identifier: Apache-2.0
"""Memory as forecast before the light is computed is what the process grows by at most."""

import json
import os
import subprocess
import sys

import pytest
from thoroughness import slow

PROGRAM = """
import json, sys
from pathlib import Path
import deltalux as dl
import numpy as np
from deltalux.memory import return_free_memory

def status(name):
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name)) * 1024

name, count, paths, gather = json.loads(sys.argv[1])
scene = getattr(dl.scenes, name)()
all_samples = dl.Samples.on_vertices(scene)
still = np.flatnonzero(all_samples.attached == None)
taken = np.random.default_rng(1).choice(still, count, replace=False)
samples = dl.Samples(all_samples.points[taken], all_samples.normals[taken])
with dl.Session(scene, samples, paths=paths, gather=gather, threads=1) as session:
    return_free_memory()
    before = status("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    session.bake()
    print(session.statistics["forecast_bytes"], status("VmHWM") - before)
"""


@pytest.fixture(scope="module")
def known_machine(tmp_path_factory):
    """An environment in which no session calibrates, which leaves its mark in the heap."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path_factory.mktemp("cache"))}
    program = "from deltalux.planning import machine_constants; machine_constants()"
    subprocess.run([sys.executable, "-c", program], check=True, env=environment)
    return environment


@pytest.mark.parametrize(
    "case",
    [
        slow(("office", 8_000, 100_000, 256)),  # two in five rays begin a chain
        slow(("cornell_box", 10_000, 100_000, 512)),  # one in eight
        ("cornell_box", 40_000, 400_000, "off"),
    ],
)
def test_forecast_of_a_bake_is_within_15_percent(case, known_machine):
    command = [sys.executable, "-c", PROGRAM, json.dumps(case)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=known_machine)
    forecast, grown = map(int, done.stdout.split())
    assert grown > 80 << 20  # else what the interpreter takes would count
    assert 0.85 < forecast / grown < 1.15
