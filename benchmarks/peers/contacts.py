# SPDX-License-Identifier: Apache-2.0
"""Error of light beside things, on small things, near what moved, behind thin walls.

    python benchmarks/peers/contacts.py [--room NAME ...] [--paths 3e5] [--gather 128] [--seed 1] [--worst 5]

Against the references of make_rooms.py, whose own error is taken out as variance. Errors are
relative to the irradiance, or to a tenth of the mean of the points where that is more. Each move
is made from the room as loaded and taken back, which must bring back every bit.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

import deltalux as dl  # noqa: E402
from oracles import office_reference  # noqa: E402
from oracles.metrics import DARK, bias, change_error, relative_error  # noqa: E402
from room_reference import ROOMS, Room  # noqa: E402
from whereabouts import what_lies_there  # noqa: E402


class Asked:
    """A room's points as one set of samples, and where in it each part of the reference lies."""

    def __init__(self, room: Room) -> None:
        self.room, self.scene = room, room.scene()
        self.data = room.load(self.scene)
        self.parts: dict[str, slice] = {}
        sets, start = [], 0
        for name in (n.removesuffix("_points") for n in self.data if n.endswith("_points")):
            points, normals, mesh = self.data[f"{name}_points"], self.data[f"{name}_normals"], None
            if name == "receivers":
                mesh = room.moves[0].mesh
                pose = room.after(self.scene, room.moves[0]).mesh(mesh).pose
                points, normals = (points - pose[:3, 3]) @ pose[:3, :3], normals @ pose[:3, :3]
            sets.append(dl.Samples(points, normals, attached_to=mesh))
            self.parts[name] = slice(start, start := start + len(points))
        self.samples = dl.Samples.concatenate(sets)


def measure(room: Room, options: argparse.Namespace) -> dict[str, Any]:
    """One bake and every move of the room."""
    asked = Asked(room)
    gather = options.gather if options.gather == "off" else int(options.gather)
    settings = {"paths": int(options.paths), "seed": options.seed, "gather": gather}
    start = time.process_time()
    with dl.Session(asked.scene, asked.samples, **settings, threads=1) as session:
        session.bake()
        before, claimed = session.irradiance, session.standard_error
        result: dict[str, Any] = settings | {"samples": len(before)}
        result["bake_seconds"] = time.process_time() - start
        for name in ("static", "small"):
            result[name] = light(asked, name, before, claimed)
            result[name]["worst"] = worst(asked, asked.scene, name, before, claimed, options.worst)
        if "dark" in asked.parts:
            share = before[asked.parts["dark"]] / asked.data["static"].mean(axis=0)
            result["leak"] = {"mean": float(share.mean()), "largest": float(share.max())}
        result["moves"] = []
        for i, move in enumerate(room.moves):
            state = room.after(asked.scene, move)
            start = time.process_time()
            after, after_claimed = _moved(session, move.mesh, state)
            seconds = time.process_time() - start
            row = {"mesh": move.mesh, "update_seconds": seconds} | change(asked, i, before, after)
            row["worst"] = worst_changes(asked, i, before, after, claimed, options.worst)
            result["moves"].append(row)
            if i == 0:
                result["receivers"] = light(asked, "receivers", after, after_claimed)
                result["receivers"]["worst"] = worst(
                    asked, state, "receivers", after, after_claimed, options.worst
                )
            back = _moved(session, move.mesh, asked.scene)[0]
            assert np.array_equal(back, before), f"{room.name}: moving {move.mesh} and back left a trace"
    return result


def _moved(session: dl.Session, mesh: str, state: dl.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance and its claimed error after an update to the pose in `state`."""
    session.move(mesh, state.mesh(mesh).pose)
    session.update()
    return session.irradiance, session.standard_error


def light(asked: Asked, name: str, found: np.ndarray, claimed: np.ndarray) -> dict[str, Any]:
    """Bias and RMS error, also of open points alone; what the claimed error is worth.

    `true_over_claimed`: ratio of the root mean squares; `beyond_four`: share of the points that are
    farther off than four times the error they claim.
    """
    part, reference, noise = asked.parts[name], asked.data[name], asked.data[f"{name}_error"]
    mine, own = found[part], claimed[part]
    is_open = office_reference.is_open(asked.data[f"{name}_free"][:, None])
    square = ((mine - reference) ** 2).mean() - (noise**2).mean()
    beyond = np.abs(mine - reference) > 4 * np.sqrt(own**2 + noise**2)
    return {
        "bias": bias(mine, reference),
        "mean_bias": float(mine.mean() / reference.mean() - 1),
        "rms": relative_error(mine, reference, noise),
        "rms_open": relative_error(mine[is_open], reference[is_open], noise[is_open]),
        "true_over_claimed": float(np.sqrt(max(square, 0) / (own**2).mean())),
        "beyond_four": float(beyond.mean()),
    }


def change(asked: Asked, index: int, before: np.ndarray, after: np.ndarray) -> dict[str, Any]:
    """Error of the change, also at points that the object covers in neither pose; the error before it.

    `change_slope`: how much of the true change was found, by least squares.
    """
    name, data = f"near_{index}", asked.data
    part = asked.parts[name]
    found, reference, noise = (after - before)[part], data[name], data[f"{name}_error"]
    is_open = office_reference.is_open(data["near_free"][index][:, None])
    return {
        "change_error": change_error(found, reference, noise),
        "change_error_open": change_error(found[is_open], reference[is_open], noise[is_open]),
        "change_slope": float((found * reference).sum() / (reference**2).sum()),
        "rms_change": float(np.sqrt((reference**2).mean()) / data["static"].mean()),
        "rms_before": relative_error(before[part], data[f"{name}_before"], data[f"{name}_before_error"]),
    }


def worst(
    asked: Asked, state: dl.Scene, name: str, found: np.ndarray, claimed: np.ndarray, count: int
) -> list[dict[str, Any]]:
    """The points with the largest relative error, of the mean of the channels."""
    part, reference = asked.parts[name], asked.data[name]
    scale = np.maximum(reference, DARK * reference.mean(axis=0))
    error = ((found[part] - reference) / scale).mean(axis=1)
    return _listed(asked, state, name, error, count, {"found": found[part], "claimed": claimed[part]})


def worst_changes(
    asked: Asked, index: int, before: np.ndarray, after: np.ndarray, claimed: np.ndarray, count: int
) -> list[dict[str, Any]]:
    """The points whose change is most wrong, as share of the RMS change."""
    name = f"near_{index}"
    part, reference = asked.parts[name], asked.data[name]
    found = (after - before)[part]
    error = (found - reference).mean(axis=1) / np.sqrt((reference**2).mean())
    columns = {"found": found, "claimed_before": claimed[part], "before": asked.data[f"{name}_before"]}
    return _listed(asked, asked.scene, name, error, count, columns)


def _listed(
    asked: Asked,
    state: dl.Scene,
    name: str,
    error: np.ndarray,
    count: int,
    columns: dict[str, np.ndarray],
) -> list[dict[str, Any]]:
    """The first `count` by error: where, on what, and the means over the channels of all columns."""
    points, normals = asked.data[f"{name}_points"], asked.data[f"{name}_normals"]
    columns = {"reference": asked.data[name], "reference_error": asked.data[f"{name}_error"]} | columns
    return [
        {
            "point": points[i].round(4).tolist(),
            "normal": normals[i].round(3).tolist(),
            "on": what_lies_there(state, points[i]),
            "error": round(float(error[i]), 4),
        }
        | {key: round(float(values[i].mean()), 4) for key, values in columns.items()}
        for i in np.argsort(-np.abs(error))[:count]
    ]


def print_room(name: str, result: dict[str, Any]) -> None:
    head = f"gather {result['gather']}, {result['paths']:,} paths, seed {result['seed']}"
    print(f"\n{name}: {head}; bake {result['bake_seconds']:.1f} s of CPU for {result['samples']:,} samples")
    print(f"  {'':24}{'bias':>8}{'RMS':>8}{'open':>8}{'true / claimed':>16}{'beyond 4':>10}")
    for part in ("static", "small", "receivers"):
        row = result[part]
        print(
            f"  {part:24}{row['bias']:8.2%}{row['rms']:8.2%}{row['rms_open']:8.2%}"
            f"{row['true_over_claimed']:16.2f}{row['beyond_four']:10.2%}"
        )
    print(
        f"  {'moved':24}{'error':>8}{'open':>8}{'slope':>8}{'before':>8}{'change / mean':>15}{'update':>10}"
    )
    for row in result["moves"]:
        errors = f"{row['change_error']:8.2%}{row['change_error_open']:8.2%}{row['change_slope']:8.3f}"
        sizes = f"{row['rms_before']:8.2%}{row['rms_change']:15.2%}{row['update_seconds']:9.2f}s"
        print(f"  {row['mesh']:24}{errors}{sizes}")
    if "leak" in result:
        mean, largest = result["leak"]["mean"], result["leak"]["largest"]
        print(f"  behind the one-polygon wall: {mean:.2e} of the lit side, {largest:.2e} at most")
    for part in ("static", "small", "receivers"):
        _print_worst(part, result[part]["worst"])
    for row in result["moves"]:
        _print_worst(f"change by {row['mesh']}", row["worst"])


def _print_worst(what: str, rows: list[dict[str, Any]]) -> None:
    for row in rows:
        print(f"    worst {what}: {json.dumps(row)}")


def main() -> None:
    parser = argparse.ArgumentParser(description="Light beside things, against references")
    parser.add_argument("--room", nargs="+", choices=ROOMS, default=list(ROOMS))
    parser.add_argument("--paths", type=float, default=3e5)
    parser.add_argument("--gather", default="128", help='rays, or "off": discs')
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--worst", type=int, default=0, help="so many of the worst points of each kind")
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "out" / "contacts.json")
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    for name in options.room:
        result = measure(ROOMS[name], options)
        print_room(name, result)
        table = json.loads(options.out.read_text()) if options.out.exists() else {}
        table[f"{name} {result['gather']} {result['paths']} {result['seed']}"] = result
        options.out.write_text(json.dumps(table, indent=2) + "\n")


if __name__ == "__main__":
    main()
