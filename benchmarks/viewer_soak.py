# SPDX-License-Identifier: Apache-2.0
"""Three clients work on one view for a long time: memory must stay flat, light exact, updates soon.

    PYTHONPATH=python python benchmarks/viewer_soak.py --minutes 60

The server runs in a process of its own. The clients drag, undo, redo, dim, paint, take away, put back,
export, ask for checks, stall, leave in the middle of a drag and come back. Every minute they pause: once the
engine rests, its digest must be that of a recompute, and the server's resident memory is read. Latency is the
time from sending a pose to having applied values that include it, of poses that no check or export held up.
In the end the served session is compared with a new one that is baked and edited at once. Writes
benchmarks/out/viewer_soak.json; the exit code is 1 where a digest differs, or memory or latency grew. The
slope's standard error is told beside it: in ten minutes it is larger than the bound, in an hour far smaller.
"""

from __future__ import annotations

import argparse
import asyncio
import ctypes
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux.server.edits import pose_numbers
from deltalux.server.web.serving import Server
from scipy.stats import linregress
from soak_clients import Shared, SoakClient

OUT = Path(__file__).parent / "out"
MIB = 2**20
CLIENTS = 3
MALLINFO = (  # fields of glibc's struct mallinfo2
    *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
    *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
)
WARM_UP = 0.25  # share of the time before memory is called flat
MOST_GROWTH = 0.5  # MiB a minute after that
MOST_SLOWER = 1.5  # 95 % latency of the last third over that of the first


def make_session(args: argparse.Namespace) -> dl.Session:
    """The session that is served, without light."""
    scene = getattr(dl.scenes, args.scene)()
    samples = dl.Samples.on_vertices(scene, spacing=args.spacing)
    return dl.Session(scene, samples, paths=args.paths)


def serve(args: argparse.Namespace) -> int:
    """Serve until standard input ends; the address goes to standard output."""
    with make_session(args) as session:
        session.bake()
        with Server(session, folder=args.serve) as server:
            print(f"ws://127.0.0.1:{server.port}/ws?token={server.token}", flush=True)
            for _ in sys.stdin:  # each line asks for the memory in use
                print(in_use(), flush=True)
    return 0


class _Mallinfo(ctypes.Structure):
    """glibc's struct mallinfo2."""

    _fields_ = tuple((name, ctypes.c_size_t) for name in MALLINFO)


def in_use() -> int:
    """Bytes of this process that the C library gave out and did not get back: no holes, no caches."""
    mallinfo = ctypes.CDLL(None).mallinfo2
    mallinfo.restype = _Mallinfo
    found = mallinfo()
    return int(found.uordblks + found.hblkhd)


def allocated(server: subprocess.Popen[str]) -> int:
    """The server's :func:`in_use`."""
    assert server.stdin and server.stdout
    server.stdin.write("\n")
    server.stdin.flush()
    return int(server.stdout.readline())


def resident(pid: int) -> int:
    """Bytes of resident memory of a process."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))


async def soak(address: str, server: subprocess.Popen[str], args: argparse.Namespace) -> list[dict[str, Any]]:
    """Let the clients work; one row for every --every seconds of work and the check after them."""
    shared = Shared(address)
    clients = [SoakClient(shared, number, args.seed) for number in range(CLIENTS)]
    tasks = [asyncio.create_task(client.work()) for client in clients]
    rows, begin = [], time.monotonic()
    try:
        while not rows or time.monotonic() - begin < 60 * args.minutes:
            shared.go.set()
            end = time.monotonic() + args.every
            while time.monotonic() < end:
                await asyncio.sleep(min(1.0, max(0.0, end - time.monotonic())))
                for task in tasks:
                    if task.done():
                        task.result()
            await shared.pause(CLIENTS)
            checked = await clients[0].checked()
            rows.append(
                {
                    "seconds": time.monotonic() - begin,
                    "same": checked["same"],
                    "digest": checked["digest"],
                    "resident": resident(server.pid),
                    "allocated": allocated(server),
                    "poses": len(shared.latencies),
                    "p50": _percentile(shared.latencies, 50),
                    "p95": _percentile(shared.latencies, 95),
                    "actions": dict(shared.actions),
                }
            )
            shared.latencies.clear()
            print_row(rows[-1])
        await clients[0].export("last.dlx")
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        for client in clients:
            await client.leave()
    return rows


def _percentile(values: list[float], share: float) -> float:
    return float(np.percentile(values, share)) if values else float("nan")


def print_row(row: dict[str, Any]) -> None:
    print(
        f"{row['seconds'] / 60:6.1f} min  {row['resident'] / MIB:8.1f} MiB "
        f"({row['allocated'] / MIB:.1f} in use)  {row['poses']:5} poses: "
        f"p50 {row['p50']:5.0f} ms, p95 {row['p95']:5.0f} ms  "
        f"{sum(row['actions'].values()):6} actions  digest {row['digest'][:8]} "
        f"{'same' if row['same'] else 'DIFFERS'}",
        flush=True,
    )


def fresh_digest(file: Path, args: argparse.Namespace) -> tuple[str, str]:
    """The digest of a saved session, and that of a new one that is brought into its state at once."""
    with dl.Session.open(file) as served, make_session(args) as fresh:
        fresh.bake()
        for name, pose in served.poses.items():
            fresh.move(name, served.pose(name))
            if pose is None:
                fresh.remove(name)
        for group, factor in served.dim_factors.items():
            fresh.dim(group, factor)
        for material, reflectance in served.reflectances.items():
            fresh.set_reflectance(material, reflectance)
        fresh.update()
        assert all(pose_numbers(fresh.pose(name)) == pose_numbers(served.pose(name)) for name in served.poses)
        return served.digest(), fresh.digest()


def summary(rows: list[dict[str, Any]], digests: tuple[str, str]) -> dict[str, Any]:
    """What the table comes to."""
    minutes = np.array([row["seconds"] / 60 for row in rows])
    memory = np.array([row["resident"] / MIB for row in rows])
    in_use = np.array([row["allocated"] / MIB for row in rows])
    late = minutes >= WARM_UP * minutes[-1]

    def slope(values: np.ndarray) -> tuple[float, float]:
        """MiB a minute, and its standard error."""
        if late.sum() < 2:
            return 0.0, 0.0
        line = linregress(minutes[late], values[late])
        return float(line.slope), float(line.stderr)

    third = max(1, len(rows) // 3)
    p95 = np.array([row["p95"] for row in rows])
    first, last = (float(np.nanmedian(part)) for part in (p95[:third], p95[-third:]))
    return {
        "minutes": float(minutes[-1]),
        "checks": len(rows),
        "same": all(row["same"] for row in rows) and digests[0] == digests[1],
        "mib_first": float(memory[0]),
        "mib_last": float(memory[-1]),
        "mib_most": float(memory.max()),
        "mib_a_minute": slope(memory)[0],
        "mib_a_minute_error": slope(memory)[1],
        "mib_in_use_first": float(in_use[0]),
        "mib_in_use_last": float(in_use[-1]),
        "mib_in_use_a_minute": slope(in_use)[0],
        "mib_in_use_a_minute_error": slope(in_use)[1],
        "p95_first_third": first,
        "p95_last_third": last,
        "actions": rows[-1]["actions"],
    }


def main() -> int:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--every", type=float, default=60.0, help="seconds between two checks")
    parser.add_argument("--scene", default="office", help="a bundled scene")
    parser.add_argument("--spacing", type=float, help="of the samples; the scene's default")
    parser.add_argument("--paths", type=int, default=300_000)
    parser.add_argument("--seed", type=int, default=1, help="of what the clients do")
    parser.add_argument("--out", type=Path, default=OUT / "viewer_soak.json")
    parser.add_argument("--serve", metavar="FOLDER", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.serve:
        return serve(args)
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, __file__, *sys.argv[1:], "--serve", folder]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:
            assert server.stdin and server.stdout
            try:
                address = server.stdout.readline().strip()
                rows = asyncio.run(soak(address, server, args))
            finally:
                server.stdin.close()
        digests = fresh_digest(Path(folder) / "last.dlx", args)
    found = summary(rows, digests)
    print(json.dumps(found, indent=1))
    args.out.parent.mkdir(exist_ok=True)
    args.out.write_text(json.dumps({"summary": found, "rows": rows, "digests": digests}, indent=1))
    flat = max(found["mib_a_minute"], found["mib_in_use_a_minute"]) <= MOST_GROWTH
    steady = found["p95_last_third"] <= MOST_SLOWER * found["p95_first_third"]
    if len(rows) < 10:  # too short to tell growth from noise
        flat = steady = True
    return int(not (found["same"] and flat and steady))


if __name__ == "__main__":
    sys.exit(main())
