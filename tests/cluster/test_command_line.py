# SPDX-License-Identifier: Apache-2.0
"""`--workers` and `--cluster`: the same result, refusals, Ctrl-C without orphans, studies."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import dask
import pytest
from deltalux.cli import places, run
from deltalux.cli.commands import study
from deltalux.cli.commands.study_folder import RECORD
from deltalux.errors import Cancelled, Error
from deltalux.studies import on_workers
from deltalux.studies.experiments import experiment
from deltalux.studies.progress_parts import Steps
from deltalux.studies.runner import settings_of
from deltalux.studies.seeds import Done, by_seed, spread_by
from distributed import LocalCluster, Security
from processes import PATIENCE, listen_to_interrupts, seconds_of
from thoroughness import slow

FAST = "cache-misses"  # an experiment that takes less than a second
NAMES = [("authority", "pem"), ("member", "pem"), ("member", "key")]
BAKE = ("bake", "cornell_box", "--spacing", "0.5", "--gather", "64", "--json")


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


def test_certificates_that_are_missing_or_broken_are_told_at_once(capsys, monkeypatch, tmp_path):
    address = "tls://127.0.0.1:1"
    monkeypatch.setattr(places, "CONNECT_SECONDS", 1e6)  # what tried to connect would never end
    code, _, told = ran(capsys, *BAKE, "--cluster", address)
    assert code == 1 and f"--cluster {address}: found no certificates, expected ca-file, cert and key" in told
    none, tls = str(tmp_path / "none.pem"), "distributed.comm.tls"
    with dask.config.set({f"{tls}.ca-file": none, f"{tls}.client.cert": none, f"{tls}.client.key": none}):
        code, _, told = ran(capsys, *BAKE, "--cluster", address)
    assert code == 1 and f"--cluster {address}: found certificates that cannot be read (" in told
    with dask.config.set({"distributed.comm.require-encryption": True}):
        code, _, told = ran(capsys, *BAKE, "--cluster", "tcp://127.0.0.1:1")
    assert code == 1 and "no Dask scheduler answers there (encryption required" in told


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("openssl"), reason="openssl is not installed")
def test_a_bake_over_an_encrypted_wire(capsys, tmp_path):
    """With the certificates that the how-to makes."""
    text = Path(__file__).parents[2].joinpath("docs/how-to/bake-on-a-cluster.md").read_text()
    making = [
        line.replace("rsa:4096", "rsa:2048") for line in text.splitlines() if line.startswith("openssl")
    ]
    assert len(making) == 3
    for line in making:
        subprocess.run(line.split(), cwd=tmp_path, check=True, capture_output=True)
    authority, certificate, key = (str(tmp_path / f"{n}.{e}") for n, e in NAMES)
    own = {"tls_ca_file": authority}
    own |= {f"tls_{who}_{what}": path for who in ("scheduler", "worker", "client")
            for what, path in (("cert", certificate), ("key", key))}  # fmt: skip
    security = Security(require_encryption=True, **own)
    told_to_dask = {
        "distributed.comm.require-encryption": True,
        "distributed.comm.tls.ca-file": authority,
        "distributed.comm.tls.client": {"cert": certificate, "key": key},
    }
    with (
        LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",
            protocol="tls",
            security=security,
        ) as cluster,
        dask.config.set(told_to_dask),
    ):
        assert cluster.scheduler_address.startswith("tls://")
        code, shared, told = ran(capsys, *BAKE, "--paths", "5000", "--cluster", cluster.scheduler_address)
    assert (code, told) == (0, "")
    _, alone, _ = ran(capsys, *BAKE, "--paths", "5000")
    assert json.loads(shared)["digest"] == json.loads(alone)["digest"]


def processes_of(session: int) -> dict[int, str]:
    """Command lines of the living processes of a session, by process number."""
    listed = subprocess.run(
        ["ps", "-ww", "-eo", "sid,pid,stat,args"], capture_output=True, text=True, check=True
    ).stdout
    rows = (line.split(None, 3) for line in listed.splitlines()[1:])
    return {int(pid): args for sid, pid, stat, args in rows if int(sid) == session and stat[0] != "Z"}


@pytest.mark.skipif(not Path("/proc").exists(), reason="looks at processes by /proc")
@pytest.mark.parametrize("computed", [slow(0.0), slow(0.2), slow(1.0), 2.0, slow(4.0)])
def test_interrupted_it_leaves_no_process(tmp_path, computed):
    """Ctrl-C reaches all processes of the terminal, as here: while workers start, and while they trace."""
    words = ("bake", "cornell_box", "--paths", "5e7", "--gather", "off", "--memory-limit", "400G")
    bake = subprocess.Popen(
        [sys.executable, "-m", "deltalux_program", *words, "--workers", "2", "-o", tmp_path / "a.npz"],
        start_new_session=True, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        preexec_fn=listen_to_interrupts,
    )  # fmt: skip

    def workers() -> list[int]:
        return [number for number, args in processes_of(bake.pid).items() if "spawn_main" in args]

    end = time.monotonic() + PATIENCE
    while sum(seconds_of(each) >= computed for each in workers()) < 2 and time.monotonic() < end:
        time.sleep(0.02)
    os.killpg(bake.pid, signal.SIGINT)
    _, told = bake.communicate(timeout=PATIENCE)
    assert (bake.returncode, told) == (130, "error: cancelled\n")
    end = time.monotonic() + PATIENCE
    while processes_of(bake.pid) and time.monotonic() < end:
        time.sleep(0.1)
    assert processes_of(bake.pid) == {}
    assert list(tmp_path.iterdir()) == []


def test_experiments_are_tasks_of_workers(client, capsys, tmp_path, monkeypatch):
    few = (experiment(FAST), experiment("radius-ratio"))
    monkeypatch.setattr(study, "EXPERIMENTS", few)
    quick = ("study", "all", "--quick", "--json")
    folder = tmp_path / "shared"
    code, _, told = ran(capsys, "study", FAST, "--quick", "-q", "-o", tmp_path / "alone")
    assert code == 0, told
    code, shared, told = ran(capsys, *quick, "--cluster", client.scheduler.address, "-o", folder)
    assert code == 0, told
    data = json.loads(shared)
    assert [each["name"] for each in data["experiments"]] == [each.name for each in few]
    assert all(each["verdicts"] for each in data["experiments"])
    found = [
        json.loads((place / FAST / RECORD).read_text())["findings"] for place in (folder, tmp_path / "alone")
    ]
    assert found[0] == found[1]
    code, again, told = ran(capsys, *quick, "-o", folder)
    assert code == 0, told
    assert json.loads(again)["skipped"] == [each.name for each in few]


def test_seeds_are_tasks_of_their_own(client):
    """At the same time on both workers, one by one on each; what they return is in the order of the seeds."""

    def of_seed(seed: int, done: Done) -> tuple[int, int, float, float]:
        begin = time.time()
        time.sleep(0.5)
        done()
        return seed, os.getpid(), begin, time.time()

    def task() -> list[tuple[int, int, float, float]]:
        with spread_by(partial(on_workers._seeds_on_workers, "topic", "name")):
            return by_seed(of_seed, [3, 1, 4, 2], Steps(None, 4))

    found = client.submit(task, pure=False).result(60)
    assert [seed for seed, *_ in found] == [3, 1, 4, 2]
    by_worker: dict[int, list[tuple[float, float]]] = {}
    for _, process, *times in found:
        by_worker.setdefault(process, []).append(tuple(times))
    assert len(by_worker) == 2
    for times in by_worker.values():
        ends = [end for _, end in sorted(times)[:-1]]
        assert all(begin >= end for (begin, _), end in zip(sorted(times)[1:], ends, strict=True))


def test_how_far_experiments_are():
    told = on_workers._Told()
    told.hear("one", on_workers.WHOLE, 0.25)
    told.hear("one", "seed 1", 0.125)
    told.hear("one", "seed 1", 0.25)
    told.hear("two", "seed 1", 0.5)
    assert told.sum() == 1.0
    told.hear("two", on_workers.WHOLE, 1.0)
    assert told.sum() == 1.5


@pytest.mark.slow
def test_a_study_on_workers_stops_soon_and_refuses_others(client, monkeypatch):
    slow = experiment("radius-ratio")
    jobs = [(slow, settings_of(slow))]
    with pytest.raises(Cancelled, match="cancelled by the progress callback"):
        list(on_workers.run_on_workers(client, jobs, lambda _, fraction: fraction == 0))
    end = time.monotonic() + PATIENCE  # the whole experiment takes many minutes
    while any(client.run(lambda dask_worker: len(dask_worker.active_threads)).values()):
        assert time.monotonic() < end
        time.sleep(0.1)
    fast = experiment(FAST)
    monkeypatch.setattr(on_workers, "run_key", lambda *_: "of another version")
    with pytest.raises(Error, match=r"another version or build of deltalux \(for cache-misses\), expected"):
        list(on_workers.run_on_workers(client, [(fast, settings_of(fast, quick=True))]))
