# SPDX-License-Identifier: Apache-2.0
"""The committed stub of the extension describes the extension that was built."""

from __future__ import annotations

from pathlib import Path

import deltalux
import deltalux._core
from nanobind.stubgen import StubGen


def test_stub_is_current() -> None:
    generator = StubGen(deltalux._core)
    generator.put(deltalux._core)
    stub = Path(deltalux.__file__).with_name("_core.pyi")
    assert generator.get() == stub.read_text(), "run: ninja -C build/dev _core_stub"
