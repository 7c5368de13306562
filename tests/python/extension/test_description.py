# SPDX-License-Identifier: Apache-2.0
"""What bits depend on: the same words for all of our own instruction sets, others for other arithmetic."""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from pathlib import Path

import pytest
from deltalux import _core


def description_with(**environment: str) -> str:
    """The words of a new process."""
    command = [sys.executable, "-c", "from deltalux import _core; print(_core.description())"]
    known = os.environ | environment
    return subprocess.run(command, env=known, check=True, capture_output=True, text=True).stdout.strip()


def test_its_form():
    found = _core.description()
    assert re.fullmatch(r"embree \d+\.\d+\.\d+, \w+, build \S+ .*, arithmetic [0-9a-f]{8}", found)
    assert found == _core.description()


@pytest.mark.parametrize("isa", ["portable", ""])
def test_our_own_instruction_sets_make_no_difference(isa):
    assert description_with(DELTALUX_ISA=isa) == _core.description()


def test_sines_of_another_library_make_one():
    flags = Path("/proc/cpuinfo")
    if platform.libc_ver()[0] != "glibc" or not flags.exists() or " fma " not in flags.read_text():
        pytest.skip("sines do not depend on the processor here")
    other = description_with(GLIBC_TUNABLES="glibc.cpu.hwcaps=-AVX2,-FMA")
    assert other != _core.description()
    assert other.partition(", arithmetic")[0] == _core.description().partition(", arithmetic")[0]
