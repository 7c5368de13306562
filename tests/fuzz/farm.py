# SPDX-License-Identifier: Apache-2.0
"""The fuzz farm: mutated files, messages and command lines against everything that reads them.

    PYTHONPATH=python python tests/fuzz/farm.py --seconds 60
    PYTHONPATH=python python tests/fuzz/farm.py gltf obj --seconds 600 --seed 2 --scenes FOLDER
    PYTHONPATH=python python tests/fuzz/farm.py --replay build/fuzz/session-1-57

Prints one line a target. What crashed, hung, raised what is not deltalux.Error, held NaN or took too much
memory stays under build/fuzz/ with its verdict; then the exit code is 1.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # its threads would not survive a fork
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))

from fuzz.cli_target import CliTarget
from fuzz.gltf_target import GltfTarget
from fuzz.harness import Report, Target, fuzz, play
from fuzz.obj_target import ObjTarget
from fuzz.session_target import SessionTarget
from fuzz.viewer_target import ViewerTarget

KEEP = Path("build") / "fuzz"
TARGETS: dict[str, type[Target]] = {
    kind.name: kind for kind in (GltfTarget, ObjTarget, SessionTarget, ViewerTarget, CliTarget)
}


def replay(folder: Path) -> int:
    """Play a kept case in this process; whether it fails."""
    name = folder.name.split("-")[0]
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch) / "case"
        copy.mkdir()
        for path in folder.iterdir():
            if path.is_file() and path.name != "verdict.json":
                (copy / path.name).write_bytes(path.read_bytes())
        result = play(TARGETS[name](), copy)
    sys.stdout.write("\n".join(f"{key}: {value}" for key, value in result.items()) + "\n")
    return int(result["outcome"] not in ("accepted", "refused"))


def run(name: str, arguments: argparse.Namespace) -> Report:
    """Fuzz one target."""
    with tempfile.TemporaryDirectory(prefix=f"fuzz-{name}-") as work:
        return fuzz(
            TARGETS[name](),
            arguments.seed,
            Path(work),
            cases=arguments.cases,
            seconds=arguments.seconds,
            scenes=arguments.scenes,
            keep=arguments.keep,
        )


def main() -> int:
    """Command line; the exit code is 1 when a case failed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(TARGETS))
    parser.add_argument("--seconds", type=float, help="of each target (60 unless --cases is given)")
    parser.add_argument("--cases", type=int, help="of each target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--scenes", type=Path, help="folder with small .glb, .obj and .dlx files as more seeds"
    )
    parser.add_argument("--keep", type=Path, default=KEEP, help="where failed cases are left")
    parser.add_argument("--replay", type=Path, metavar="FOLDER", help="play a kept case in this process")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON, too")
    arguments = parser.parse_args()
    if arguments.replay:
        return replay(arguments.replay)
    if unknown := set(arguments.targets) - set(TARGETS):
        parser.error(f"found {unknown}, expected some of {', '.join(TARGETS)}")
    if arguments.cases is None and arguments.seconds is None:
        arguments.seconds = 60.0
    reports = []
    for name in arguments.targets or TARGETS:
        reports.append(run(name, arguments))
        sys.stdout.write(reports[-1].summary() + "\n")
        for failure in reports[-1].failures:
            last = failure.get("detail", "").strip().splitlines()[-1:] or [""]
            where = arguments.keep / f"{name}-{arguments.seed}-{failure['case']}"
            sys.stdout.write(f"  {failure['outcome']} {where}: {last[0][:160]}\n")
        sys.stdout.flush()
    if arguments.json:
        sys.stdout.write(json.dumps([report.record() for report in reports]) + "\n")
    return int(any(report.failures for report in reports))


if __name__ == "__main__":
    sys.exit(main())
