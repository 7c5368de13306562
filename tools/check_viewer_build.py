# SPDX-License-Identifier: Apache-2.0
"""Checks that the committed page of the viewer is what viewer/ builds: file by file, byte by byte."""

from __future__ import annotations

import filecmp
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "viewer"
COMMITTED = ROOT / "python" / "deltalux" / "viewer"


def files_below(folder: Path) -> set[str]:
    """Return the files of a folder, as paths relative to it."""
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}


def differences(built: Path, committed: Path) -> list[str]:
    """Return what differs between two folders, in words."""
    new, old = files_below(built), files_below(committed)
    found = [f"{name}: built, but not committed" for name in sorted(new - old)]
    found += [f"{name}: committed, but not built" for name in sorted(old - new)]
    same = sorted(new & old)
    _, changed, unreadable = filecmp.cmpfiles(built, committed, same, shallow=False)
    return found + [f"{name}: differs from a fresh build" for name in changed + unreadable]


def main() -> int:
    """Build into a temporary folder and compare; return the exit code."""
    npm = shutil.which("npm")
    if npm is None:
        print("check_viewer_build: found no npm, expected Node.js 20.19 or newer; nothing was checked")
        return 2
    if not (SOURCES / "node_modules").is_dir():
        subprocess.run([npm, "ci", "--no-audit", "--no-fund"], cwd=SOURCES, check=True)
    with tempfile.TemporaryDirectory() as folder:
        options = ["--outDir", folder, "--emptyOutDir", "--logLevel", "warn"]
        command = [npm, "run", "--silent", "build", "--", *options]
        subprocess.run(command, cwd=SOURCES, check=True)
        found = differences(Path(folder), COMMITTED)
    count = len(files_below(COMMITTED))
    print("\n".join(found) if found else f"check_viewer_build: {count} files are as built")
    if found:
        print("run `make viewer` and commit python/deltalux/viewer")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
