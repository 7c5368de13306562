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
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "python")]

import deltalux as dl  # noqa: E402
from oracles import office_reference  # noqa: E402
from oracles.metrics import bias, change_error, relative_error  # noqa: E402
from room_reference import ROOMS, Room  # noqa: E402
from whereabouts import what_lies_there  # noqa: E402

Data = dict[str, np.ndarray]


class Asked:
    """The points of a reference as one set of samples, and where in it each part lies."""

    def __init__(self, room: Room, scene: dl.Scene, data: Data) -> None:
        self.parts: dict[str, slice] = {}
        sets, start = [], 0
        for name in (n.removesuffix("_points") for n in data if n.endswith("_points")):
            points, normals, mesh = data[f"{name}_points"], data[f"{name}_normals"], None
            if name == "receivers":
                mesh = room.moves[0].mesh
                pose = room.after(scene, room.moves[0]).mesh(mesh).pose
                points, normals = (points - pose[:3, 3]) @ pose[:3, :3], normals @ pose[:3, :3]
            sets.append(dl.Samples(points, normals, attached_to=mesh))
            self.parts[name] = slice(start, start := start + len(points))
        self.samples = dl.Samples.concatenate(sets)


def measure(room: Room, options: argparse.Namespace) -> dict[str, Any]:
    """One bake and every move of the room."""
    scene = room.scene()
    data = room.load(scene)
    asked = Asked(room, scene, data)
    gather = options.gather if options.gather == "off" else int(options.gather)
    start = time.process_time()
    settings = {"paths": int(options.paths), "seed": options.seed, "gather": gather}
    session = dl.Session(scene, asked.samples, **settings, threads=1)
    session.bake()
    before, claimed = session.irradiance, session.standard_error
    result: dict[str, Any] = settings | {"bake_seconds": time.process_time() - start, "samples": len(before)}
    result["static"] = _light(asked, "static", before, claimed, data)
    result["small"] = _light(asked, "small", before, claimed, data)
    result["worst"] = {
        name: worst(scene, asked, name, before, claimed, data, options.worst) for name in ("static", "small")
    }
    if "dark" in asked.parts:
        share = before[asked.parts["dark"]] / data["static"].mean(axis=0)
        result["leak"] = {"mean": float(share.mean()), "largest": float(share.max())}
    moves, digest = [], session.digest()
    for i, move in enumerate(room.moves):
        state = room.after(scene, move)
        start = time.process_time()
        session.move(move.mesh, state.mesh(move.mesh).pose)
        session.update()
        after, after_claimed = session.irradiance, session.standard_error
        moves.append({"mesh": move.mesh, "update_seconds": time.process_time() - start})
        moves[-1] |= _change(asked, i, before, after, data)
        if options.worst:
            moves[-1]["worst"] = worst_changes(
                scene, asked, f"near_{i}", before, after, claimed, data, options.worst
            )
        if i == 0:
            result["receivers"] = _light(asked, "receivers", after, after_claimed, data)
            result["worst"]["receivers"] = worst(
                state, asked, "receivers", after, after_claimed, data, options.worst
            )
        session.move(move.mesh, scene.mesh(move.mesh).pose)
        session.update()
        assert session.digest() == digest, f"{room.name}: moving {move.mesh} there and back left something"
    session.close()
    return result | {"moves": moves}


def _light(asked: Asked, name: str, found: np.ndarray, claimed: np.ndarray, data: Data) -> dict[str, float]:
    """Bias and RMS error, also of open points alone; how many times the claimed error the true one is."""
    mine, reference, noise = found[asked.parts[name]], data[name], data[f"{name}_error"]
    is_open = office_reference.is_open(data[f"{name}_free"][:, None])
    difference = ((mine - reference) ** 2).mean() - (noise**2).mean()
    return {
        "bias": bias(mine, reference),
        "mean_bias": float(mine.mean() / reference.mean() - 1),
        "rms": relative_error(mine, reference, noise),
        "rms_open": relative_error(mine[is_open], reference[is_open], noise[is_open]),
        "true_over_claimed": float(np.sqrt(max(difference, 0) / (claimed[asked.parts[name]] ** 2).mean())),
    }


def _change(asked: Asked, index: int, before: np.ndarray, after: np.ndarray, data: Data) -> dict[str, float]:
    """Error of the change, also at points that the object covers in neither pose; the error before it."""
    name = f"near_{index}"
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
    scene: dl.Scene, asked: Asked, name: str, found: np.ndarray, claimed: np.ndarray, data: Data, count: int
) -> list[dict[str, Any]]:
    """The points with the largest relative error, of the mean of the channels."""
    part, reference, noise = asked.parts[name], data[name], data[f"{name}_error"]
    scale = np.maximum(reference, 0.1 * reference.mean(axis=0))
    error = ((found[part] - reference) / scale).mean(axis=1)
    order = np.argsort(-np.abs(error))[:count]
    rows = {"reference": reference, "reference_error": noise, "found": found[part], "claimed": claimed[part]}
    return _listed(scene, data[f"{name}_points"], data[f"{name}_normals"], error, order, rows)


def worst_changes(
    scene: dl.Scene,
    asked: Asked,
    name: str,
    before: np.ndarray,
    after: np.ndarray,
    claimed: np.ndarray,
    data: Data,
    count: int,
) -> list[dict[str, Any]]:
    """The points whose change is most wrong, as share of the RMS change."""
    part, reference = asked.parts[name], data[name]
    found = (after - before)[part]
    error = (found - reference).mean(axis=1) / np.sqrt((reference**2).mean())
    order = np.argsort(-np.abs(error))[:count]
    rows = {
        "before": data[f"{name}_before"],
        "reference": reference,
        "reference_error": data[f"{name}_error"],
    }
    rows |= {"found": found, "claimed": claimed[part]}
    return _listed(scene, data[f"{name}_points"], data[f"{name}_normals"], error, order, rows)


def _listed(
    scene: dl.Scene,
    points: np.ndarray,
    normals: np.ndarray,
    error: np.ndarray,
    order: np.ndarray,
    rows: dict[str, np.ndarray],
) -> list[dict[str, Any]]:
    return [
        {
            "point": points[i].round(4).tolist(),
            "normal": normals[i].round(3).tolist(),
            "on": what_lies_there(scene, points[i]),
            "error": round(float(error[i]), 4),
        }
        | {name: round(float(values[i].mean()), 4) for name, values in rows.items()}
        for i in order
    ]


def print_room(name: str, result: dict[str, Any]) -> None:
    head = f"gather {result['gather']}, {result['paths']:,} paths, seed {result['seed']}"
    print(f"\n{name}: {head}; bake {result['bake_seconds']:.1f} s of CPU for {result['samples']:,} samples")
    print(f"  {'':24}{'bias':>8}{'RMS':>8}{'open':>8}{'true / claimed':>16}")
    for part in ("static", "small", "receivers"):
        row = result[part]
        print(
            f"  {part:24}{row['bias']:8.2%}{row['rms']:8.2%}{row['rms_open']:8.2%}"
            f"{row['true_over_claimed']:16.2f}"
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
    lists = result["worst"] | {f"change, {row['mesh']}": row.get("worst", []) for row in result["moves"]}
    for part, rows in lists.items():
        for row in rows:
            print(f"    worst {part}: {json.dumps(row)}")


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
