# SPDX-License-Identifier: Apache-2.0
"""Checks every tracked text: licence line, file purpose, no machine's paths, no leftovers."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

SPDX = "SPDX-License-Identifier: Apache-2.0"
SOURCE_SUFFIXES = {".py", ".cpp", ".h", ".sh", ".ts", ".toml"}
TEXT_SUFFIXES = SOURCE_SUFFIXES | {".md", ".txt", ".cff", ".json", ".yml", ".yaml", ".css", ".html", ".supp"}
# A path that exists on one machine only. /tmp and /usr are everywhere, /path/to is an example.
PRIVATE_PATH = re.compile(r"(?<![\w.~/-])/(?:home|root|work|Users|mnt|data)/[\w.-]+")
LEFTOVER = re.compile(r"\b(?:TODO|FIXME|XXX|HACK)\b|^(?:<{7} |>{7} )")
HERE = Path(__file__).resolve()


def tracked_files(root: Path) -> list[Path]:
    """Return the tracked and the new files that are not ignored, as absolute paths."""
    command = ["git", "ls-files", "-co", "--exclude-standard", "-z"]
    names = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
    paths = (root / name for name in names.split("\0") if name)
    return sorted(p for p in paths if p.is_file())


def is_text(path: Path) -> bool:
    """Return whether the rules apply to this file."""
    return path.suffix in TEXT_SUFFIXES or path.name in {"CMakeLists.txt", "Makefile", "run"}


def check_source(lines: list[str], path: Path) -> list[tuple[int, str]]:
    """Check what only source files must have: licence line and purpose."""
    found = []
    if not any(SPDX in line for line in lines[:2]):
        found.append((1, f"the licence line is missing: start with '{SPDX}' in a comment"))
    if path.suffix in {".h", ".cpp"} and not (len(lines) > 1 and lines[1].startswith("// ")):
        found.append((2, "line 2 must say the file's responsibility in one sentence"))
    return found


def check_file(path: Path) -> list[tuple[int, str]]:
    """Return (line number, problem) for one file."""
    lines = path.read_text(encoding="utf-8").splitlines()
    found = check_source(lines, path) if path.suffix in SOURCE_SUFFIXES and lines else []
    for number, line in enumerate(lines, 1):
        if line != line.rstrip() and path.suffix != ".md":
            found.append((number, "trailing white space"))
        if path == HERE:
            continue
        if match := PRIVATE_PATH.search(line):
            found.append((number, f"'{match[0]}' is a path of one machine"))
        if match := LEFTOVER.search(line):
            found.append((number, f"leftover '{match[0].strip()}': finish it or open an issue"))
    return found


def main(root: Path) -> int:
    """Check the tree below `root`; return the exit code."""
    files = [p for p in tracked_files(root) if is_text(p)]
    problems = [f"{p.relative_to(root)}:{line}: {what}" for p in files for line, what in check_file(p)]
    print("\n".join(problems) if problems else f"check_text: {len(files)} files keep the rules")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(HERE.parent.parent))
