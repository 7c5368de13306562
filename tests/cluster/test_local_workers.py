# SPDX-License-Identifier: Apache-2.0
"""Workers that commands start: nobody else reaches them, or has their secret."""

from __future__ import annotations

import http.client
import ipaddress
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import deltalux as dl
import psutil
import pytest
from deltalux.cli import places
from deltalux.cli.console import Terminal
from deltalux.cluster import extra
from deltalux.errors import Error
from processes import listen_to_interrupts
from thoroughness import all_but_slow, slow

STRANGER = """
import os, sys
from distributed import Client
with Client(sys.argv[1], timeout=5, set_as_default=False) as client:
    print(client.run_on_scheduler(os.getpid), *client.run(os.getpid).values())
"""
PAGES = ("/", "/status", "/info/main/workers.html", "/json/counts.json", "/health", "/metrics")
TERMINAL = Terminal(as_json=False, quiet=True)
SECONDS = 200
COMMANDS = {
    "bake": ("bake", "cornell_box", "--paths", "5e7", "--gather", "off", "--memory-limit", "400G"),
    "view": ("view", "cornell_box", "--no-browser"),
    "study": ("study", "curve-orders"),
}


def listening(process: psutil.Process) -> dict[int, str]:
    """Address of each port that a process and its children listen on."""
    found = {}
    for each in [process, *process.children(recursive=True)]:
        try:
            places_ = [c.laddr for c in each.net_connections("inet") if c.status == psutil.CONN_LISTEN]
        except psutil.NoSuchProcess:
            continue
        found.update({port: ip for ip, port in places_})
    return found


def assert_loopback_only(found: dict[int, str]) -> None:
    assert found
    assert {port: ip for port, ip in found.items() if not ipaddress.ip_address(ip).is_loopback} == {}


def run_by_stranger(address: str) -> str:
    """What another program of this machine gets from a scheduler without a certificate."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("DASK")}
    done = subprocess.run(
        [sys.executable, "-c", STRANGER, address], capture_output=True, text=True, env=environment, timeout=90
    )
    return done.stdout if done.returncode == 0 else ""


@pytest.mark.parametrize("workers", [1, slow(2)])
def test_a_stranger_reaches_nothing(workers):
    with places.place_of(workers, None, 1, TERMINAL) as place:
        assert place.workers == workers
        ports = listening(psutil.Process())
        assert_loopback_only(ports)
        address = place.client.scheduler.address
        assert address.startswith("tls://127.0.0.1:")
        for each in (address, address.replace("tls:", "tcp:")):
            assert run_by_stranger(each) == ""
        for port in ports:
            assert pages_of(port) == []
        scene = dl.scenes.cornell_box()
        with place.make(scene, dl.Samples([(0, 0.5, 0)], (0, 1, 0)), paths=500, gather="off") as session:
            session.bake()
            assert session.irradiance.all()


def pages_of(port: int) -> list[str]:
    """Pages that a port has."""
    found = []
    for page in PAGES:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
        try:
            connection.request("GET", page)
            if connection.getresponse().status != 404:
                found.append(page)
        except (OSError, http.client.HTTPException):  # no HTTP there
            pass
        finally:
            connection.close()
    return found


def test_the_same_stranger_gets_in_where_there_is_no_secret(client):
    """So that the test above can fail."""
    assert len(run_by_stranger(client.scheduler.address).split()) == 3


def test_keys_are_neither_in_arguments_nor_in_the_environment():
    with places.place_of(1, None, 1, TERMINAL) as place:
        key = place.client.security.tls_client_key
        assert "PRIVATE KEY" in key
        secret = key.splitlines()[1]
        for each in psutil.Process().children(recursive=True):
            assert secret not in " ".join(each.cmdline())
            assert secret not in " ".join(each.environ().values())


def test_each_start_has_a_secret_of_its_own():
    keys = set()
    for _ in range(2):
        with places.place_of(1, None, 1, TERMINAL) as place:
            keys.add(place.client.security.tls_client_key)
    assert len(keys) == 2


@contextmanager
def command(*words: str) -> Iterator[psutil.Process]:
    with subprocess.Popen(
        [sys.executable, "-m", "deltalux_program", *words],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        preexec_fn=listen_to_interrupts,
    ) as process:  # fmt: skip
        try:
            yield psutil.Process(process.pid)
        finally:
            with_children = psutil.Process(process.pid).children(recursive=True)
            process.send_signal(signal.SIGINT)
            try:
                process.wait(60)
            except subprocess.TimeoutExpired:
                for each in [process, *with_children]:
                    each.kill()


@pytest.mark.parametrize("name", all_but_slow(COMMANDS, "bake"))
def test_every_command_with_workers_listens_here_only(tmp_path: Path, name):
    words = COMMANDS[name]
    output = () if words[0] == "view" else ("-o", str(tmp_path / ("a.npz" if words[0] == "bake" else "out")))
    with command(*words, *output, "--workers", "1", "--threads", "1") as process:
        end = time.monotonic() + SECONDS
        found: dict[int, str] = {}
        # Scheduler with its (empty) server of pages, nanny, worker with its one.
        while len(found) < 5 and time.monotonic() < end:
            assert process.is_running() and process.status() != psutil.STATUS_ZOMBIE
            found = listening(process)
            time.sleep(0.1)
        assert len(found) >= 5
        assert_loopback_only(found)


@pytest.mark.parametrize("missing", ["distributed", extra.CERTIFICATES])
def test_a_missing_library_is_named(monkeypatch, missing):
    monkeypatch.setattr(extra, "find_spec", lambda name: None if name == missing else json)
    with (
        pytest.raises(Error, match=f"--workers: found no module {missing}, expected the extra; pip install"),
        places.place_of(1, None, 1, TERMINAL),
    ):
        pass


def test_a_cluster_of_the_users_own_needs_no_certificates(client, monkeypatch):
    monkeypatch.setattr(extra, "find_spec", lambda name: None if name == extra.CERTIFICATES else json)
    with places.place_of(None, client.scheduler.address, 1, TERMINAL) as place:
        assert place.workers == 2
