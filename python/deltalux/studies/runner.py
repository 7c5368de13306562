# SPDX-License-Identifier: Apache-2.0
"""Runs an experiment: its settings, the key that decides whether a run must be repeated, the record."""

from __future__ import annotations

import hashlib
import inspect
import json
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import deltalux
from deltalux.planning.machine import core_build
from deltalux.segments import Progress, check_seed
from deltalux.version import __version__

from .environment import environment
from .experiment import Experiment
from .progress_parts import named
from .record import Record

WITHOUT_EFFECT = ("threads",)  # settings that change no finding
SHARED = (
    "studies",
    "studies/indices",
    "model",
    "estimate",
    "planning",
    "scenes",
    "segments.py",
    "session",
    "samples",
)  # sources behind all findings


def settings_of(
    experiment: Experiment,
    *,
    quick: bool = False,
    seeds: Sequence[int] | None = None,
    threads: int | None = None,
) -> dict[str, Any]:
    """The settings of a run: the experiment's own, overridden by the user's.

    Parameters
    ----------
    experiment : Experiment
    quick : use the experiment's quick settings
    seeds : replace the experiment's own
    threads : None = all

    Raises
    ------
    OptionError
        For a seed out of range.
    """
    settings = dict(experiment.full) | (dict(experiment.quick) if quick else {})
    if seeds:
        for seed in seeds:
            check_seed(seed)
        settings["seeds"] = list(dict.fromkeys(seeds))
    return settings | {"threads": threads}


def run_key(experiment: Experiment, settings: Mapping[str, Any]) -> str:
    """Digest of everything that determines the findings: settings, sources, the core's build.

    The sources are the experiment's own module and those that all share, not the other experiments',
    so that a change of one experiment repeats only that one.
    """
    decisive = {name: value for name, value in settings.items() if name not in WITHOUT_EFFECT}
    digest = hashlib.sha256(json.dumps(decisive, sort_keys=True).encode())
    digest.update(f"{__version__} {core_build()}".encode())
    module = sys.modules[experiment.run.__module__]
    for text in (inspect.getsource(module), *_shared_sources()):
        digest.update(text.encode())
    return digest.hexdigest()


def run(experiment: Experiment, settings: Mapping[str, Any], progress: Progress | None = None) -> Record:
    """Run an experiment.

    Parameters
    ----------
    experiment : Experiment
    settings : see `settings_of`
    progress : callable (stage, fraction) -> keep going; the stage is the experiment's name

    Returns
    -------
    Record
    """
    report = named(progress, experiment.name)
    if report:
        report("", 0.0)
    key = run_key(experiment, settings)  # before the run, because sources may be edited during it
    start = time.perf_counter()
    findings = experiment.run(settings, report)
    return Record(
        experiment.name,
        key,
        settings,
        environment(),
        time.perf_counter() - start,
        findings,
    )


def _shared_sources() -> list[str]:
    """Texts of the modules that all experiments build on."""
    root = Path(deltalux.__file__).parent
    files: list[Path] = []
    for name in SHARED:
        path = root / name
        files += sorted(path.glob("*.py")) if path.is_dir() else [path]  # not the experiments' own folder
    return [file.read_text(encoding="utf-8") for file in files]
