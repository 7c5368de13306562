# SPDX-License-Identifier: Apache-2.0
"""`deltalux serve` as a process, who cannot connect, and messages as other languages send them."""

from __future__ import annotations

import hashlib
import http.server
import json
import re
import signal
import socket
import threading
from pathlib import Path

import deltalux as dl
import pytest
from deltalux.client.connection import socket_address
from deltalux.server.web.serving import Server

from viewer.commands import running
from viewer.page_client import PageClient
from viewer.test_client import TIMEOUT, edit

# ---- who cannot connect ------------------------------------------------------------------------------


def test_a_wrong_token_is_refused_in_words(served: Server) -> None:
    for address in (served.url[:-1], served.url.partition("?")[0]):
        with pytest.raises(dl.OptionError, match="found no token, or one of another run; open the address"):
            dl.connect(address)


@pytest.mark.parametrize("address", ["", "office.dlx", "ftp://127.0.0.1/", "http://", "http://a:b/", 3, None])
def test_what_is_no_address_is_refused(address: object) -> None:
    with pytest.raises(dl.OptionError, match="expected the address that `deltalux serve` printed"):
        dl.connect(address)  # type: ignore[arg-type]


def test_addresses_of_pages_and_sockets_are_one() -> None:
    expected = "ws://127.0.0.1:8000/ws?token=a&frames=0"
    assert socket_address("http://127.0.0.1:8000/?token=a") == expected
    assert socket_address("ws://127.0.0.1:8000/ws?token=a") == expected
    assert socket_address("https://[::1]/deep/?token=a") == "wss://[::1]/deep/ws?token=a&frames=0"


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def test_where_no_server_is_it_says_how_to_start_one() -> None:
    with pytest.raises(dl.Error, match=r"found no server there .*deltalux serve SESSION.dlx"):
        dl.connect(f"http://127.0.0.1:{free_port()}/?token=a")


@pytest.mark.parametrize(
    ("version", "text"),
    [("HTTP/1.1", "found another server there"), ("HTTP/1.0", "found no server of Deltalux")],
)
def test_another_server_is_none(version: str, text: str) -> None:
    class Quiet(http.server.SimpleHTTPRequestHandler):
        protocol_version = version

        def log_message(self, *_: object) -> None:
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Quiet) as other:
        threading.Thread(target=other.serve_forever, daemon=True).start()
        with pytest.raises(dl.Error, match=text):
            dl.connect(f"http://127.0.0.1:{other.server_port}/?token=a")
        other.shutdown()


def test_a_server_that_does_not_answer_is_waited_for_some_seconds_only() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as silent,
        pytest.raises(dl.Error, match=r"found no answer within 0.2 s"),
    ):
        dl.connect(f"http://127.0.0.1:{silent.getsockname()[1]}/?token=a", timeout=0.2)
    with pytest.raises(dl.OptionError, match="timeout: found 0"):
        dl.connect("http://127.0.0.1:1/", timeout=0)


# ---- messages ----------------------------------------------------------------------------------------


def test_messages_of_other_languages(served: Server, own: dl.Session) -> None:
    """The protocol as docs/reference/viewer-protocol.md has it."""
    with PageClient(served) as page:
        page.rest()
        edits = [{"type": "dim", "group": "desk", "factor": 0.5}, {"type": "remove", "name": "block"}]
        assert page.ask("edit", edits=edits) == {"type": "accepted", "id": 1, "revision": 1}
        finished = page.ask("finish", digest=True)
        own.dim("desk", 0.5)
        own.remove("block")
        own.update()
        assert finished["digest"] == own.digest()
        assert (finished["type"], finished["revision"]) == ("finished", 1)
        assert finished["frame"]["done"] == 1
        assert page.ask("finish")["digest"] is None
        before = page.state
        for edits, text in (
            ([{"type": "undo"}], "expected a message of type move, remove, add, dim, reflectance"),
            ([{"type": "remove", "id": 2, "name": "lamp"}], "found an id"),
            ([{"type": "remove"}], "remove: found no name"),
            ([3], "edits: found 3"),
            ({}, "edits: found {}, expected a list"),
            (
                [{"type": "dim", "group": "desk", "factor": 1.0}, {"type": "remove", "name": "block"}],
                'remove "block": it is taken away',
            ),
        ):
            answer = page.ask("edit", edits=edits)
            assert answer["type"] == "error"
            assert text in answer["message"]
        assert page.ask("read", arrays=["all"])["type"] == "error"
        assert page.ask("finish", digest=1)["message"] == "digest: found 1, expected true or false"
        assert page.state == before


def test_one_client_has_one_read_at_a_time(served: Server) -> None:
    with PageClient(served) as page:
        page.rest()
        for _ in range(20):
            last = page.send("finish", digest=True)
        answers = [page.until(lambda data: data["type"] in ("finished", "error")) for _ in range(20)]
        refused = [answer for answer in answers if answer["type"] == "error"]
        assert len(refused) < 20
        assert all("found one that is not answered yet" in answer["message"] for answer in refused)
        assert {answer["id"] for answer in answers} == set(range(1, last + 1))


# ---- the command -------------------------------------------------------------------------------------


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_the_command_serves_until_it_is_ended_and_leaves_the_file_as_it_is(
    baked_file: Path, tmp_path: Path, own: dl.Session, end: signal.Signals
) -> None:
    before = hashlib.sha256(baked_file.read_bytes()).digest()
    with running("serve", str(baked_file), "--json", "--folder", str(tmp_path)) as process:
        assert process.stdout is not None
        said = json.loads(process.stdout.readline())
        assert said["pid"] == process.pid
        assert (said["session"], said["folder"], said["page"]) == (str(baked_file), str(tmp_path), True)
        assert said["address"] == f"http://127.0.0.1:{said['port']}/?token={said['token']}"
        for address in (said["address"], said["websocket"]):
            with dl.connect(address) as client:
                edit(client) if address == said["address"] else None
                client.update()
                digest = client.digest()
        with pytest.raises(dl.OptionError, match="found no token"):
            dl.connect(said["address"][:-1])
        process.send_signal(end)
        out, errors = process.communicate(timeout=TIMEOUT)
    assert (process.returncode, out, errors) == (0, "", "")
    edit(own)
    own.update()
    assert digest == own.digest()
    assert hashlib.sha256(baked_file.read_bytes()).digest() == before
    assert list(tmp_path.iterdir()) == []


def test_the_command_says_what_is_wrong(baked_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from deltalux.cli import run

    for words, text in (
        ([str(baked_file), "--folder", "nowhere"], 'folder: found no folder "nowhere"'),
        ([str(baked_file), "--host", "no such host"], "host: found 'no such host'"),
        (["nowhere.dlx"], "nowhere.dlx"),
    ):
        assert run(["serve", *words]) == 1
        error = capsys.readouterr().err
        assert text in re.sub(r"\s+", " ", error)
        assert len(error.splitlines()) == 1
