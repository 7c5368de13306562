# SPDX-License-Identifier: Apache-2.0
"""The reference of Python has an entry for every public name, and none for what is not there."""

from __future__ import annotations

import importlib
import re
from types import ModuleType

import deltalux as dl
import pytest

from docs.pages import ROOT, site_only, text_of

PAGES = sorted((ROOT / "docs/reference/python").glob("*.md"))
DIRECTIVE = re.compile(r"^\.\. (auto\w+|currentmodule):: ([\w.]+)$", re.MULTILINE)


def entries() -> set[str]:
    """Full names of what has an entry; of a module, all that it offers."""
    found = set()
    for page in PAGES:
        module = ""
        for kind, name in DIRECTIVE.findall(site_only(page)):
            if kind == "currentmodule":
                module = name
            elif kind == "automodule":
                module = name
                found |= {f"{name}.{own}" for own in importlib.import_module(name).__all__}
            else:
                found.add(name if name.startswith("deltalux.") else f"{module}.{name}")
    return found


def offered(module: ModuleType) -> set[str]:
    """Full names of a module's public classes and functions."""
    return {f"{module.__name__}.{name}" for name in module.__all__ if callable(getattr(module, name))}


@pytest.mark.parametrize("module", [dl, dl.estimate, dl.model, dl.scenes], ids=lambda m: m.__name__)
def test_every_public_name_has_an_entry(module: ModuleType) -> None:
    assert offered(module)
    assert offered(module) - entries() == set()


def test_every_entry_is_of_something() -> None:
    for name in entries():
        module, _, own = name.rpartition(".")
        assert hasattr(importlib.import_module(module), own), name


def test_the_first_page_names_all_that_the_package_offers() -> None:
    """Read where the repository is browsed, it is all there is."""
    named = set(re.findall(r"`([\w.]+)`", text_of(ROOT / "docs/reference/python.md")))
    assert set(dl.__all__) - {"__version__"} <= named
