# SPDX-License-Identifier: Apache-2.0
"""The client: a session in another process, with the methods of `Session` that work remotely."""

from __future__ import annotations

from typing import Any

import numpy as np

from deltalux.errors import OptionError
from deltalux.results import Frame
from deltalux.scene import rigid_pose
from deltalux.server.edits import pose_matrix, pose_numbers
from deltalux.server.protocol.messages import Names, read_edit

from .connection import Arrays, Connection


def connect(address: str, *, timeout: float = 10.0) -> Client:
    """Connect to a session that `deltalux serve`, `deltalux view`, `dl.serve` or `dl.view` serves.

    Parameters
    ----------
    address : str
        As the server printed it, with the token: ``http://127.0.0.1:8000/?token=…``.
    timeout : seconds for connecting

    Returns
    -------
    Client
        A context manager; leaving it ends the connection, while the session keeps its edits.

    Raises
    ------
    Error
        If no Deltalux server answers, or the extra ``deltalux[view]`` is not installed.
    OptionError
        For an invalid address, and for a wrong token.
    """
    if not timeout > 0:
        raise OptionError(f"connect: timeout: found {timeout!r}, expected seconds above 0")
    return Client(Connection(address, timeout))


class Client:
    """A session in another process. One thread may use it at a time.

    Edits queue up in the client, and `update` applies them together: all of them, or none. The session is
    shared: changes by other clients and pages appear here, too. Values are those of a `Session` in the same
    state, to the last bit.

    Parameters
    ----------
    connection : Connection
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._queue: list[dict[str, Any]] = []
        self._revision = -1  # of the last update

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def close(self) -> None:
        """End the connection; edits that `update` has not sent yet are lost."""
        self._connection.close()

    # ---- state --------------------------------------------------------------------------------

    @property
    def poses(self) -> dict[str, np.ndarray | None]:
        """Pose (4x4, local to world) of each movable, None where it is removed; queued edits included."""
        poses = {
            name: None if numbers is None else pose_matrix(numbers)
            for name, numbers in self._connection.state["poses"].items()
        }
        for edit in self._queue:
            if edit["type"] == "move":
                poses[edit["name"]] = pose_matrix(edit["pose"])
            elif edit["type"] == "remove":
                poses[edit["name"]] = None
        return poses

    @property
    def dim_factors(self) -> dict[str, float]:
        """Factor of each light group; queued edits included."""
        factors = dict(self._connection.state["factors"])
        return factors | {edit["group"]: edit["factor"] for edit in self._queue if edit["type"] == "dim"}

    @property
    def reflectances(self) -> dict[str, tuple[float, ...]]:
        """Reflectance of each material, 3 values; queued edits included."""
        found = {name: tuple(value) for name, value in self._connection.state["reflectances"].items()}
        queued = (edit for edit in self._queue if edit["type"] == "reflectance")
        return found | {edit["material"]: tuple(edit["value"]) for edit in queued}

    def pose(self, name: str) -> np.ndarray:
        """Pose of a movable (4x4, local to world); queued edits included.

        Raises
        ------
        OptionError
            For an unknown name, and for a movable that is removed.
        """
        poses = self.poses
        if name not in poses:
            raise OptionError(f"pose: found {name!r:.60}, expected one of {sorted(poses)}")
        pose = poses[name]
        if pose is None:
            raise OptionError(f'pose "{name}": it is taken away; add it first')
        return pose

    # ---- edits --------------------------------------------------------------------------------

    def move(self, name: str, pose: Any) -> None:
        """Queue: put the movable `name` at the absolute, rigid `pose` (4x4, local to world).

        Raises
        ------
        OptionError
            For an unknown or static name, or a pose that is not rigid. `update` checks whether the movable
            stays in the box that the session was made for.
        """
        matrix = rigid_pose(pose, f'move "{name}": pose')
        self._add({"type": "move", "name": name, "pose": list(pose_numbers(matrix))})

    def remove(self, name: str) -> None:
        """Queue: remove a movable, with its light."""
        self._add({"type": "remove", "name": name})

    def add(self, name: str) -> None:
        """Queue: put a removed movable back where it was."""
        self._add({"type": "add", "name": name})

    def dim(self, group: str, factor: float) -> None:
        """Queue: set a light group to `factor` of its loaded power (1 = as loaded)."""
        self._add({"type": "dim", "group": group, "factor": float(factor)})

    def set_reflectance(self, material: str, reflectance: Any) -> None:
        """Queue: change a material's reflectance (3 values, 0 to 1)."""
        values = np.asarray(reflectance, np.float64).ravel().tolist()
        self._add({"type": "reflectance", "material": material, "value": values})

    def _add(self, edit: dict[str, Any]) -> None:
        state = self._connection.state
        names = Names(state["poses"], state["factors"], state["reflectances"])
        try:
            read_edit(edit, names)
        except OptionError as error:
            raise OptionError(f"{edit['type']}: {error}") from None
        self._queue.append(edit)

    def update(self) -> Frame:
        """Apply the queued edits together, and wait until the light belongs to the edited state.

        Returns
        -------
        Frame
            Figures of the update, including edits of other clients that it applied as well; an empty Frame
            if nothing has changed since the last `update` of this client.

        Raises
        ------
        OptionError
            If the server refuses one of the edits (a pose out of the box, an edit of a movable that another
            client has removed). The session then gets none of the edits, and the queue is empty.
        """
        self._send_queue()
        done = self._connection.ask("finish")
        figures, before, self._revision = done["frame"], self._revision, done["revision"]
        if figures is None or done["revision"] == before:
            return Frame()
        return Frame(
            affected_paths=figures["affected_paths"],
            retraced_segments=figures["retraced_segments"],
            gathered_rays=figures["gathered_rays"],
            changed_rays=figures["changed_rays"],
            milliseconds=figures["milliseconds"],
            done=figures["done"],
        )

    def _send_queue(self) -> None:
        edits, self._queue = self._queue, []
        if edits:
            self._connection.ask("edit", edits=edits)

    # ---- results ------------------------------------------------------------------------------

    def read(self, *names: str) -> Arrays:
        """Arrays of one common state by name, each (n, 3) float64; queued edits are applied first.

        Parameters
        ----------
        names : "irradiance", "standard_error", "points", "normals"
            Of the samples; irradiance in the scene's unit, points and normals in world space.
        """
        self._send_queue()
        return self._connection.ask("read", arrays=list(dict.fromkeys(names)))["values"]

    @property
    def irradiance(self) -> np.ndarray:
        """(n, 3) float64, unit of the scene; queued edits are applied first."""
        return self.read("irradiance")["irradiance"]

    @property
    def standard_error(self) -> np.ndarray:
        """(n, 3) float64: standard error of `irradiance`; queued edits are applied first."""
        return self.read("standard_error")["standard_error"]

    def digest(self) -> str:
        """Hex string over the session's state and light, see `Session.digest`; queued edits are applied."""
        self._send_queue()
        return self._connection.ask("finish", digest=True)["digest"]

    def export(self, file: str) -> int:
        """Write NAME.glb, .csv, .npz, .png or .dlx into the server's folder; queued edits are applied first.

        Returns
        -------
        int
            Bytes of the file.

        Raises
        ------
        OptionError
            For a name that is not plain, and if a file of that name exists that this server did not write.
        """
        self._send_queue()
        return self._connection.ask("export", file=file)["bytes"]

    def save(self, file: str) -> int:
        """Write the session to NAME.dlx in the server's folder, as `export` does."""
        if not str(file).endswith(".dlx"):
            raise OptionError(f"save: found {file!r:.60}, expected NAME.dlx; export() writes other kinds")
        return self.export(file)
