# SPDX-License-Identifier: Apache-2.0
"""Clients of the soak: pages without a picture that do what users do, at random, for as long as they may."""

from __future__ import annotations

import asyncio
import collections
import json
import time
from typing import Any

import numpy as np
import websockets
from deltalux.server.protocol.frames import apply_frame

ANSWER_WITHIN = 600.0  # seconds; a check computes everything again, and may wait behind others
DRAGS_A_SECOND = 20.0
FILES = ("a.csv", "b.npz", "c.dlx", "d.glb")
ACTIONS = ["drag"] * 12 + ["undo"] * 4 + ["redo"] * 2 + ["dim"] * 2 + ["paint", "take_away", "put_back"]
ACTIONS += ["come_back", "come_back", "stall", "send_export", "check", "nonsense"]


class Shared:
    """What the clients have in common, and what is measured."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.go = asyncio.Event()
        self.go.set()
        self.resting = 0
        self.busy = 0  # checks and exports that have not been answered
        self.epoch = 0  # changes when one begins or ends
        self.latencies: list[float] = []  # milliseconds
        self.actions: collections.Counter[str] = collections.Counter()

    async def pause(self, clients: int) -> None:
        """Wait until every client has ended what it was at."""
        self.go.clear()
        end = time.monotonic() + ANSWER_WITHIN
        while self.resting < clients:
            assert time.monotonic() < end, "a client does not come to rest"
            await asyncio.sleep(0.01)


class SoakClient:
    """One user."""

    def __init__(self, shared: Shared, number: int, seed: int) -> None:
        self._shared = shared
        self._rng = np.random.default_rng([seed, number])
        self._connection: websockets.ClientConnection | None = None
        self._receiving: asyncio.Task[None] | None = None

    # ---- the connection -----------------------------------------------------------------------

    async def come(self) -> None:
        """Connect and wait for the state."""
        self._connection = await websockets.connect(self._shared.address, max_size=None, compression=None)
        self._state: dict[str, Any] = {}
        self._shown: dict[str, Any] = {}
        self._rows: np.ndarray | None = None
        self._answers: dict[int, asyncio.Future[dict[str, Any]]] = {}
        self._checked: asyncio.Future[dict[str, Any]] | None = None
        self._sent: dict[int, tuple[float, int]] = {}  # when and in which epoch, by the revision of the pose
        self._stalled: int | None = None
        self._ids = 0
        self._receiving = asyncio.create_task(self._receive())
        await self._until(lambda: bool(self._state and self._shown))

    async def leave(self) -> None:
        """Disconnect, whatever is on the way."""
        if self._connection is not None and self._receiving is not None:
            await self._connection.close()
            self._receiving.cancel()
            await asyncio.gather(self._receiving, return_exceptions=True)
            self._connection = None

    async def _receive(self) -> None:
        assert self._connection is not None
        async for message in self._connection:
            if isinstance(message, bytes):
                await self._apply(message)
                continue
            data = json.loads(message)
            if data["type"] == "state":
                self._state = data
            elif data["type"] == "checked" and self._checked is not None and not self._checked.done():
                self._checked.set_result(data)
            elif data["type"] == "notice":
                raise RuntimeError(data["message"])
            elif data.get("id") in self._answers:
                self._answers.pop(data["id"]).set_result(data)

    async def _apply(self, frame: bytes) -> None:
        """Write a frame's values into the array and acknowledge it."""
        header, self._rows = apply_frame(frame, self._rows)
        self._shown = {"revision": header.revision, "scale": header.scale}
        now = time.perf_counter()
        for held in [r for r in self._sent if r <= header.revision]:
            sent, epoch = self._sent.pop(held)
            if epoch == self._shared.epoch and self._stalled is None:
                self._shared.latencies.append(1e3 * (now - sent))
        if self._stalled is None:
            await self._send({"type": "ack", "seq": header.seq})
        else:
            self._stalled = header.seq

    async def _send(self, message: dict[str, Any]) -> None:
        assert self._connection is not None
        await self._connection.send(json.dumps(message))

    async def ask(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Send a request and wait for its answer."""
        self._ids += 1
        answer: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        self._answers[self._ids] = answer
        await self._send({"type": kind, "id": self._ids, **fields})
        return await self._or_end(answer)

    async def _or_end(self, answer: asyncio.Future[dict[str, Any]]) -> dict[str, Any]:
        """What was waited for; the connection's end is an error."""
        assert self._receiving is not None
        await asyncio.wait(
            (answer, self._receiving), timeout=ANSWER_WITHIN, return_when=asyncio.FIRST_COMPLETED
        )
        if not answer.done() and self._receiving.done():
            self._receiving.result()
        assert answer.done(), "no answer came"
        return answer.result()

    async def _until(self, arrived: Any) -> None:
        end = time.monotonic() + ANSWER_WITHIN
        while not arrived():
            if self._receiving is not None and self._receiving.done():
                self._receiving.result()
            assert time.monotonic() < end, "what was waited for did not come"
            await asyncio.sleep(0.005)

    # ---- what a user does ---------------------------------------------------------------------

    async def work(self) -> None:
        """Do one thing after the other; pause where that is asked for."""
        await self.come()
        while True:
            if not self._shared.go.is_set():
                self._shared.resting += 1
                await self._shared.go.wait()
                self._shared.resting -= 1
            action = str(self._rng.choice(ACTIONS))
            self._shared.actions[action] += 1
            await getattr(self, f"_{action}")()
            await asyncio.sleep(self._rng.uniform(0.0, 0.3))

    def _some(self, names: Any) -> str:
        return str(self._rng.choice(sorted(names)))

    async def _drag(self) -> None:
        """Move an object about, a few centimetres a step."""
        poses = {name: pose for name, pose in self._state["poses"].items() if pose}
        if not poses:
            return
        name = self._some(poses)
        step = self._rng.uniform(-0.02, 0.02, 3) * (1, 0, 1)
        count = int(self._rng.integers(5, 60))
        for k in range(count):
            pose = list(poses[name])
            pose[12:15] = np.array(pose[12:15]) + step * min(k, count - k // 2)
            sent = time.perf_counter(), self._shared.epoch
            held_up = self._shared.busy > 0
            answer = await self.ask("move", name=name, pose=pose, dragging=k < count - 1)
            if answer["type"] == "accepted" and not held_up and self._shown["revision"] < answer["revision"]:
                self._sent[answer["revision"]] = sent
            await asyncio.sleep(1 / DRAGS_A_SECOND)

    async def _undo(self) -> None:
        await self.ask("undo")

    async def _redo(self) -> None:
        await self.ask("redo")

    async def _dim(self) -> None:
        group = self._some(self._state["factors"])
        for k in range(5):
            await self.ask("dim", group=group, factor=float(self._rng.uniform(0, 2)), dragging=k < 4)
            await asyncio.sleep(1 / DRAGS_A_SECOND)

    async def _paint(self) -> None:
        value = self._rng.uniform(0, 0.9, 3).tolist()
        await self.ask("reflectance", material=self._some(self._state["reflectances"]), value=value)

    async def _take_away(self) -> None:
        await self.ask("remove", name=self._some(self._state["poses"]))

    async def _put_back(self) -> None:
        removed = [name for name, pose in self._state["poses"].items() if pose is None]
        if removed:
            await self.ask("add", name=self._some(removed))

    async def _come_back(self) -> None:
        """Leave, at times in the middle of a drag or without a goodbye, and come again."""
        if self._rng.random() < 0.5:
            poses = {name: pose for name, pose in self._state["poses"].items() if pose}
            if poses:
                name = self._some(poses)
                await self.ask("move", name=name, pose=poses[name], dragging=True)
        if self._rng.random() < 0.3 and self._connection is not None:
            self._connection.transport.abort()
        await self.leave()
        await asyncio.sleep(self._rng.uniform(0, 0.5))
        await self.come()

    async def _stall(self) -> None:
        """Acknowledge nothing for a while."""
        self._stalled = 0
        await asyncio.sleep(self._rng.uniform(0.5, 3.0))
        seq, self._stalled = self._stalled, None
        if seq:
            await self._send({"type": "ack", "seq": seq})

    async def _nonsense(self) -> None:
        """Be refused."""
        assert (await self.ask("remove", name="nobody"))["type"] == "error"

    async def _send_export(self) -> None:
        await self.export(self._some(FILES))

    async def export(self, file: str) -> None:
        """Write a file, unless another task is at work."""
        self._began()
        answer = await self.ask("export", file=file)
        self._ended()
        assert answer["type"] == "exported" or "still at work" in answer["message"], answer

    async def _check(self) -> None:
        """Ask for a check, unless another task is at work."""
        self._began()
        try:
            self._checked = asyncio.get_running_loop().create_future()
            answer = await self.ask("check")
            if answer["type"] == "accepted":
                assert (await self._or_end(self._checked))["same"], "the light is not that of a recompute"
        finally:
            self._checked = None
            self._ended()

    def _began(self) -> None:
        self._shared.busy += 1
        self._shared.epoch += 1

    def _ended(self) -> None:
        self._shared.busy -= 1
        self._shared.epoch += 1

    async def checked(self) -> dict[str, Any]:
        """Wait until the engine rests, then for the result of a check; other clients must pause."""
        await self._until(lambda: self._state["phase"] == "ready")
        self._checked = asyncio.get_running_loop().create_future()
        answer = await self.ask("check")
        assert answer["type"] == "accepted", answer
        result = await self._or_end(self._checked)
        self._checked = None
        await self._until(
            lambda: self._state["phase"] == "ready" and self._shown["revision"] == self._state["revision"]
        )
        return result
