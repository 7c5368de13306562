# SPDX-License-Identifier: Apache-2.0
"""Tables of RESULTS.md follow from the benchmarks' files, and stay where there is none."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
ENGINE = {
    "paths": 1000000, "segments": 3300000, "raw_over_trace": 0.65, "deposit_over_raw": 0.46,
    "search_ns": 1.6, "raw_ray_ns": 500, "scan_ns": 0.91, "moving_share": 0.024, "frame_efficiency": 0.24,
    "bytes_per_segment": 61.6, "speedup": 202, "recompute_wall_ms": 178, "frame_wall_ms": 33, "exact": True,
}  # fmt: skip
TWO_THREADS = ENGINE | {"recompute_wall_ms": 100, "frame_wall_ms": 20}
GATHER = {
    "ray_over_raw": 11.5, "look_up_ns": 59, "rays": 128, "bytes_per_sample": 11900,
    "frame_share": 0.93, "speedup": 26,
}  # fmt: skip
DEPOSIT = {"results": [{"discs": 100000, "deposit_in_rays": 0.24, "faster_than_embree_discs": 6.7}]}
PART = {"bias": -0.001, "rms": 0.006}
CONTACTS = {
    "gather": 1536, "paths": 300000, "seed": 0, "bake_seconds": 4.2, "static": PART, "small": PART,
    "receivers": PART, "moves": [{"change_error": 0.004}, {"change_error": 0.039}],
}  # fmt: skip
WORSE = CONTACTS | {"seed": 1, "static": {"bias": 0.002, "rms": 0.011}}
ROOM = {"setting": "256 rays, 200000 paths", "seconds": 1.5}
MODE = {
    "frames_per_second": 12.7, "p50_milliseconds": 80, "p95_milliseconds": 174,
    "at_rest": {"seconds_until_exact": 0.8},
}  # fmt: skip
SOAK = {
    "minutes": 60.2, "actions": {"drag": 988, "export": 77}, "checks": 60, "same": True, "mib_first": 1197,
    "mib_last": 1288, "mib_most": 1290, "mib_a_minute": -0.1, "mib_a_minute_error": 0.05,
    "p95_first_third": 352, "p95_last_third": 245,
}  # fmt: skip
FILES: dict[str, Any] = {
    "bench.json": {"3%": ENGINE, "3%, 2 threads": TWO_THREADS, "gather": GATHER, "deposit": DEPOSIT},
    "default_updates.json": {
        "scenes": {
            "office": {
                "samples": 59994,
                "rays": 1000,
                "recompute": 33.0,
                "updates": {"chair": [{"seconds": 0.5, "rays": 10}, {"seconds": 1.0, "rays": 14}]},
            }
        }
    },
    "peers.json": {
        "runs": {"deltalux": {}, "mitsuba": {}},
        "summary": {"after 2%": {"deltalux": 1.08, "mitsuba": 1022.0, "times sooner": 946.0}},
    },
    "peers_rooms.json": {
        "spots": {
            "deltalux": {
                "light": [ROOM | {"static": 0.019, "small": 0.2}],
                "change": [ROOM | {"change": [0.01, 0.04]}],
            }
        }
    },
    "contacts.json": {"spots 1536 300000 0": CONTACTS, "spots 1536 300000 1": WORSE},
    "claimed_error.json": [
        {
            "scene": "office",
            "gather": 256,
            "true": {"median": 0.01, "p90": 0.03},
            "claimed": {"median": 0.012, "p90": 0.027},
        }
    ],
    "forecast.json": [
        {
            "scene": "", "triangles": 8660, "samples": 10000, "paths": 100000, "rays": 0,
            "peak": 51 * 2**20, "forecast": 50 * 2**20, "saving": 4 * 2**20,
        }
    ],
    "eta.json": {
        "cornell box bake cpu 1": {"seconds": 83, "within": 0.98, "quantiles": {"90": 0.38}, "silent": 0.4}
    },
    "viewer_latency.json": [{"name": "atrium", "samples": 97309, "modes": [MODE | {"mode": "lock step"}]}],
    "viewer_soak.json": {"summary": SOAK},
}  # fmt: skip
ROWS = {
    "engine": "| search for affected segments, per stored segment | 1.60 ns, 0.0032 raw rays | ≤ 1.0 ns, "
    "0.0043 raw rays |",
    "updates": "| office, chair | 59,994 | 1,000 | 33.0 s | 33.0 | 1.4% |",
    "peers": "| moved chair, 2% | 1.08 | 1,022 | 946 | ≥ 800 |",
    "peers-in-rooms": "| spots, static, 5 / 2 / 1 % | 1.5 / 1.5 / - |",
    "contacts": "| spots | 1536, 300,000 | 0, 1 | 1.1 % | 0.2 % | 0.6 % | 0.6 % | 0.4 %, 3.9 % | 4.2 s |",
    "claimed-error": "| office | 256 | 1.0 % | 1.20 | 3.0 % | 0.90 |",
    "memory": "| hall | 8,660 | 10,000 | 100,000 | 0 | 51 | 0.98 | 4 |",
    "time-left": "| cornell box, bake, cpu, 1 | 83 | 0.98 | 0.38 | 0.4 s |",
    "latency": "| atrium | 97,309 | when a frame arrives | 12.7 | 80 ms | 174 ms | 0.8 s |",
    "soak": "| minutes; actions | 60; 1,065 |",
}
EMPTY = "".join(f"<!-- table: {name} -->\nold {name}\n<!-- end of table -->\n" for name in ROWS)


def renew(folder: Path, page: str, *names: str) -> tuple[int, str, str]:
    """Exit code, what was told, and the page afterwards."""
    file = folder / "page.md"
    file.write_text(page, encoding="utf-8")
    command = [sys.executable, BENCHMARKS / "results.py", "--page", file, "--out", folder, *names]
    done = subprocess.run(command, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr, file.read_text(encoding="utf-8")


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    """A folder with a file of every benchmark, written on one day."""
    day = datetime(2026, 5, 4, 12).timestamp()
    for name, figures in FILES.items():
        (tmp_path / name).write_text(json.dumps(figures), encoding="utf-8")
        os.utime(tmp_path / name, (day, day))
    return tmp_path


def test_every_table_is_renewed(measured: Path) -> None:
    code, out, page = renew(measured, EMPTY)
    assert code == 0, out
    assert "old" not in page
    assert page.count(", 2026-05-04, ") == len(ROWS)
    assert page.count(" processors:\n") == len(ROWS)
    blocks = page.split("<!-- end of table -->\n")
    for (name, row), text in zip(ROWS.items(), blocks, strict=False):
        assert text.startswith(f"<!-- table: {name} -->\n\n`")
        lines = text.split("\n")[4:-2]
        assert row in lines
        assert len({line.count(" | ") for line in lines}) == 1


def test_only_what_is_named_is_renewed(measured: Path) -> None:
    _, out, page = renew(measured, EMPTY, "soak")
    assert out == "soak: renewed\n"
    assert page.count("old") == len(ROWS) - 1


def test_tables_without_a_file_stay(tmp_path: Path) -> None:
    """Also a check that the committed page has the tables that the program makes, and no others."""
    page = (BENCHMARKS / "RESULTS.md").read_text(encoding="utf-8")
    code, out, after = renew(tmp_path, page)
    assert (code, after) == (0, page)
    assert "engine: no bench.json, as it was\n" in out


@pytest.mark.parametrize("page", [EMPTY + EMPTY.replace("engine", "motor"), EMPTY.replace("engine", "motor")])
def test_a_strange_table_is_told(measured: Path, page: str) -> None:
    code, out, after = renew(measured, page)
    assert (code, after) == (1, page)
    assert "motor" in out


def test_a_strange_name_is_refused(tmp_path: Path) -> None:
    code, out, _ = renew(tmp_path, EMPTY, "motor")
    assert code == 2
    assert "found no table motor, expected some of engine, updates" in out
