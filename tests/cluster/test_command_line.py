# SPDX-License-Identifier: Apache-2.0
"""`--workers` and `--cluster`: the same result, refusals, and Ctrl-C without orphans."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from deltalux.cli import places, run

BAKE = ("bake", "cornell_box", "--spacing", "0.5", "--json")


def ran(capsys, *words) -> tuple[int, str, str]:
    code = run([str(word) for word in words])
    return code, *capsys.readouterr()


def test_workers_change_no_result(client, capsys, tmp_path):
    address, file = client.scheduler.address, tmp_path / "a.dlx"
    _, alone, _ = ran(capsys, *BAKE, "--paths", "5000")
    code, shared, told = ran(capsys, *BAKE, "--paths", "5000", "--cluster", address, "-o", file)
    assert code == 0 and told == ""
    assert json.loads(shared)["digest"] == json.loads(alone)["digest"]
    dim = ("update", file, "--dim", "ceiling=0.5", "--json")
    code, alone, told = ran(capsys, *dim)
    assert code == 0, told
    code, shared, told = ran(capsys, *dim, "--cluster", address)
    assert code == 0, told
    assert json.loads(shared)["digest"] == json.loads(alone)["digest"]


def test_refusals(capsys, monkeypatch):
    code, _, told = ran(capsys, *BAKE, "--workers", "2", "--cluster", "tcp://127.0.0.1:1")
    assert code == 2 and "found --workers and --cluster, expected one of them" in " ".join(told.split())
    monkeypatch.setattr(places, "CONNECT_SECONDS", 0.5)
    code, _, told = ran(capsys, *BAKE, "--cluster", "tcp://127.0.0.1:1")
    assert code == 1 and "--cluster tcp://127.0.0.1:1: no Dask scheduler answers there" in told
    code, _, told = ran(capsys, *BAKE, "--cluster", "tcp://192.0.2.1:8786")
    assert code == 1 and "warning: --cluster tcp://192.0.2.1:8786: the wire is not encrypted" in told


def processes_of(session: int) -> list[str]:
    """Command lines of the living processes of a session."""
    listed = subprocess.run(
        ["ps", "-ww", "-eo", "sid,stat,args"], capture_output=True, text=True, check=True
    ).stdout
    rows = (line.split(None, 2) for line in listed.splitlines()[1:])
    return [args for sid, stat, args in rows if int(sid) == session and not stat.startswith("Z")]


@pytest.mark.skipif(not Path("/proc").exists(), reason="lists processes by ps")
def test_interrupted_it_leaves_no_process(tmp_path):
    """Ctrl-C reaches all processes of the terminal, as here."""
    words = ("bake", "cornell_box", "--paths", "5e7", "--gather", "off", "--memory-limit", "400G")
    bake = subprocess.Popen(
        [sys.executable, "-m", "deltalux_program", *words, "--workers", "2", "-o", tmp_path / "a.npz"],
        start_new_session=True, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    end = time.monotonic() + 120
    while sum("spawn_main" in args for args in processes_of(bake.pid)) < 2 and time.monotonic() < end:
        time.sleep(0.2)
    time.sleep(8)  # for the workers to be ready; before, Python itself may show where it was
    os.killpg(bake.pid, signal.SIGINT)
    _, told = bake.communicate(timeout=60)
    assert (bake.returncode, told) == (130, "error: cancelled\n")
    end = time.monotonic() + 10
    while processes_of(bake.pid) and time.monotonic() < end:
        time.sleep(0.1)
    assert processes_of(bake.pid) == []
