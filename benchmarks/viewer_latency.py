# SPDX-License-Identifier: Apache-2.0
"""How soon the light follows: a real server, a client in a process of its own, a trolley that is dragged.

    PYTHONPATH=python python benchmarks/viewer_latency.py
    PYTHONPATH=python python benchmarks/viewer_latency.py --room office:chair --room study:stool

The client sends poses, applies the frames that come to an array and acknowledges them at once; what a
browser needs to draw comes on top. Latency is the time from sending a pose to having applied values that
include it. "lock step" sends a pose when a frame arrives, "30 a second" whatever happens. After the last
pose: how long until what is shown is near to the light that it comes to, where the drag has left more than
2 % to do. The trolley's diagonal is 3 % of the atrium's. Rooms are baked by default options, and their
object goes 60 cm there and back. Writes benchmarks/out/viewer_latency.json.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import count as count_from
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
import websockets
from deltalux.server.protocol.frames import apply_frame
from deltalux.server.web.serving import Server
from edited_rooms import room_named

OUT = Path(__file__).parent / "out"
TROLLEY = "trolley"
WAY = (4.0, 0.0, -1.5)  # metres there and back
SHORT_WAY = (0.6, 0.0, 0.0)  # the same in rooms
STEP = 0.03  # metres between two poses: a metre a second at 30 poses a second
RATE = 30.0  # poses a second
NOTED = 0.02  # relative: what is farther from where it comes to counts as behind
NEAR = (0.05, 0.02, 0.01)  # RMS of those
SAMPLES = 100_000  # of the smaller case; no mesh of the atrium has as few vertices
VERTEX_ARRAYS = ("points", "sample_points", "normals", "vertex_mesh", "attached")
TRIANGLE_ARRAYS = ("triangles", "triangle_material", "triangle_mesh", "source_triangle", "reversed")


class Client:
    """A page without a picture."""

    def __init__(self, connection: websockets.ClientConnection, dragged: str) -> None:
        self.connection = connection
        self.dragged = dragged
        self.values: np.ndarray | None = None
        self.state: dict[str, Any] = {}
        self.first_revision = 0
        self.sent: dict[int, float] = {}  # when, by the revision that holds the pose
        self.latencies: list[float] = []
        self.figures: list[dict[str, Any]] = []
        self.frames: list[tuple[float, int]] = []  # when, and bytes
        self.moves = 0

    async def take(self) -> bool:
        """Take one message; whether it was a frame of values."""
        message = await self.connection.recv()
        if isinstance(message, bytes):
            await self.apply(message)
            return True
        data = json.loads(message)
        if data["type"] == "state":
            self.state = data
        elif data["type"] == "frame":
            self.figures.append(data)
        elif data["type"] in ("error", "notice"):
            raise RuntimeError(data["message"])
        return False

    async def next_frame(self) -> None:
        """Take messages up to and with the next frame of values."""
        while not await self.take():
            pass

    async def apply(self, frame: bytes) -> None:
        """Write a frame's values into the array and acknowledge it."""
        header, self.values = apply_frame(frame, self.values)
        now = time.perf_counter()
        self.frames.append((now, len(frame)))
        for held in [r for r in self.sent if r <= header.revision]:
            self.latencies.append(1e3 * (now - self.sent.pop(held)))
        await self.connection.send(json.dumps({"type": "ack", "seq": header.seq}))

    async def rest(self) -> None:
        """Take messages until nothing is left to do."""
        while not (self.state.get("phase") == "ready" and self.frames):
            await self.take()
        self.first_revision = self.state["revision"]

    async def settle(self, pose: list[float]) -> dict[str, Any]:
        """Let go at a pose, and see the light come to rest: seconds until it is near to what it comes to."""
        start, shown = time.perf_counter(), [self.values.copy()]
        times = [0.0]
        await self.move(pose, dragging=False)
        while self.sent or self.state.get("phase") != "ready":
            if await self.take():
                shown.append(self.values.copy())
                times.append(time.perf_counter() - start)
        light = [rows.view(np.float16).reshape(-1, 4)[:, :3].astype(float).sum(axis=1) for rows in shown]
        final = light[-1]
        floor = 1e-3 * final.mean()
        off = [np.abs(own - final) / np.maximum(final, floor) for own in light]
        behind = off[0] > NOTED
        left = [float(np.sqrt(np.mean(own[behind] ** 2))) if behind.any() else 0.0 for own in off]
        last = {n: max((i + 1 for i, own in enumerate(left) if own > n), default=0) for n in NEAR}
        return {
            "samples_behind": int(behind.sum()),
            "behind_at_first": left[0],
            "seconds_until": {f"{n:.0%}": times[i] for n, i in last.items()},
            "seconds_until_exact": times[-1],
        }

    async def move(self, pose: list[float], *, dragging: bool = True) -> None:
        """Send the next pose of a drag, or the last one."""
        self.moves += 1
        self.sent[self.first_revision + self.moves] = time.perf_counter()
        message = {"type": "move", "id": self.moves, "name": self.dragged, "pose": pose, "dragging": dragging}
        await self.connection.send(json.dumps(message))


def poses(start: list[float], way: tuple[float, ...]) -> Iterator[list[float]]:
    """Poses there and back along the way, without end."""
    length = float(np.linalg.norm(way))
    for k in count_from(1):
        turned = k * STEP / length % 2
        share = min(turned, 2 - turned)
        yield start[:12] + [start[12 + axis] + share * way[axis] for axis in range(3)] + [1.0]


async def lock_step(client: Client, way: Iterator[list[float]], end: float) -> None:
    """A pose each time a frame arrives."""
    while time.perf_counter() < end:
        await client.move(next(way))
        await client.next_frame()


async def steady(client: Client, way: Iterator[list[float]], end: float) -> None:
    """Poses at a constant rate."""

    async def send() -> None:
        due = time.perf_counter()
        while due < end:
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            await client.move(next(way))
            due += 1 / RATE

    sending = asyncio.create_task(send())
    while not sending.done() or client.sent:
        await client.next_frame()


MODES = {"lock step": lock_step, "30 a second": steady}


async def run_client(address: str, mode: str, dragged: str, seconds: float) -> dict[str, Any]:
    """Drag for some time; what was measured."""
    async with websockets.connect(address, max_size=None, compression=None) as connection:
        client = Client(connection, dragged)
        await client.rest()
        way = poses(client.state["poses"][dragged], WAY if dragged == TROLLEY else SHORT_WAY)
        client.frames, client.figures = [], []
        start = time.perf_counter()
        await MODES[mode](client, way, start + seconds)
        elapsed = client.frames[-1][0] - start
        at_rest = await client.settle(next(way))
        stages = sorted({stage for figure in client.figures for stage in figure["milliseconds"]})
        return {
            "mode": mode,
            "poses": client.moves,
            "frames": len(client.frames),
            "frames_per_second": len(client.frames) / elapsed,
            "p50_milliseconds": float(np.percentile(client.latencies, 50)),
            "p95_milliseconds": float(np.percentile(client.latencies, 95)),
            "at_rest": at_rest,
            "median_bytes": float(np.median([size for _, size in client.frames])),
            "median_done": float(np.median([figure["done"] for figure in client.figures])),
            "median_affected_paths": float(
                np.median([figure["affected_paths"] for figure in client.figures])
            ),
            "median_stage_milliseconds": {
                stage: float(np.median([figure["milliseconds"].get(stage, 0.0) for figure in client.figures]))
                for stage in stages
            },
        }


def measure(session: dl.Session, dragged: str, seconds: float) -> list[dict[str, Any]]:
    """Serve the session and drag an object in each mode, by a client in another process."""
    results = []
    for mode in MODES:
        with Server(session) as server:
            address = f"ws://127.0.0.1:{server.port}/ws?token={server.token}"
            command = [
                sys.executable,
                __file__,
                "--client",
                address,
                mode,
                dragged,
                "--seconds",
                str(seconds),
            ]
            out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        results.append(json.loads(out))
        print_result(results[-1])
    return results


def print_result(result: dict[str, Any]) -> None:
    print(
        f"  {result['mode']:<12} {result['frames_per_second']:5.1f} frames/s, pose to values applied: "
        f"p50 {result['p50_milliseconds']:.0f} ms, p95 {result['p95_milliseconds']:.0f} ms; "
        f"{result['median_bytes'] / 1e3:.0f} kB a frame, done {result['median_done']:.0%}"
    )
    stages = sorted(result["median_stage_milliseconds"].items(), key=lambda item: -item[1])
    rest = result["at_rest"]
    until = ", ".join(f"{near} after {seconds:.1f} s" for near, seconds in rest["seconds_until"].items())
    print(
        f"    let go: {rest['samples_behind']} samples are {rest['behind_at_first']:.0%} off, {until}, "
        f"exact after {rest['seconds_until_exact']:.1f} s"
    )
    print("    " + ", ".join(f"{stage} {ms:.1f} ms" for stage, ms in stages if ms >= 0.05), flush=True)


def in_part(scene: dl.Scene, count: int) -> dl.Samples:
    """At most `count` samples: on the trolley, and on the static meshes with the fewest vertices."""
    display = dl.Samples.on_vertices(scene, share=False).display
    assert display is not None
    sizes = np.bincount(display.vertex_mesh, minlength=len(scene.meshes))
    order = sorted(range(len(sizes)), key=lambda mesh: (not scene.meshes[mesh].movable, sizes[mesh]))
    meshes = np.array(order)[np.cumsum(sizes[order]) <= count]
    vertices, triangles = np.isin(display.vertex_mesh, meshes), np.isin(display.triangle_mesh, meshes)
    of_vertices = {name: getattr(display, name)[vertices] for name in VERTEX_ARRAYS}
    of_triangles = {name: getattr(display, name)[triangles] for name in TRIANGLE_ARRAYS}
    of_triangles["triangles"] = (np.cumsum(vertices) - 1)[of_triangles["triangles"]]
    return dl.Samples.on_vertices(scene, display=replace(display, **of_vertices, **of_triangles))


def sessions(args: argparse.Namespace) -> Iterator[tuple[str, dl.Session, str]]:
    """What to measure, and what to drag: rooms, files, else the atrium, in part and whole."""
    for room in args.room:
        name, _, dragged = room.partition(":")
        scene = room_named(name)
        if dragged not in scene.movable:
            raise SystemExit(f"error: --room {room}: expected NAME:OBJECT, with one of {scene.movable}")
        session = dl.Session(scene, dl.Samples.on_vertices(scene))
        session.bake()
        yield name, session, dragged
    for file in args.session:
        yield file, dl.Session.open(file), TROLLEY
    if not args.session and not args.room:
        scene = dl.scenes.atrium()
        cases = {"part of the atrium": in_part(scene, SAMPLES), "atrium": dl.Samples.on_vertices(scene)}
        for name, samples in cases.items():
            session = dl.Session(scene, samples, paths=args.paths)
            session.bake()
            yield name, session, TROLLEY


def main() -> int:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--paths", type=int, default=1_000_000)
    parser.add_argument("--seconds", type=float, default=10.0, help="of dragging in each mode")
    parser.add_argument("--session", action="append", default=[], help="a baked atrium.dlx (repeatable)")
    parser.add_argument("--room", action="append", default=[], metavar="NAME:OBJECT", help="repeatable")
    parser.add_argument("--client", nargs=3, metavar=("ADDRESS", "MODE", "OBJECT"), help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.client:
        print(json.dumps(asyncio.run(run_client(*args.client, args.seconds))))
        return 0
    results = []
    for name, session, dragged in sessions(args):
        with session:
            paths = session.statistics["paths"]
            print(f"{name}: {len(session.samples):,} samples, {paths:,} paths", flush=True)
            measured = measure(session, dragged, args.seconds)
            results.append({"name": name, "samples": len(session.samples), "paths": paths, "modes": measured})
    OUT.mkdir(exist_ok=True)
    (OUT / "viewer_latency.json").write_text(json.dumps(results, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
