# SPDX-License-Identifier: Apache-2.0
"""Strangers that never finish a request: they leave, others are served, the log stays short."""

from __future__ import annotations

import asyncio
import errno
import json
import logging
import resource
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress

import deltalux as dl
import pytest
from deltalux.server.web import connections, serving, short_log
from deltalux.server.web.connections import MOST, Connections, most_connections
from deltalux.server.web.short_log import Seldom, keep_loop_short, keep_short
from thoroughness import slow

from viewer.commands import environment
from viewer.page_client import TIMEOUT, PageClient, get

HALF = b"GET / HTTP/1.1\r\nHost: x"
LARGE = 16 << 20  # bytes, more than sockets hold on their way
STRANGERS = {
    "says nothing": b"",
    "says half a request": HALF,
    "never ends its headers": HALF + b"\r\nX: " + b"y" * 2000,
    "announces a body": b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000\r\n\r\nz",
    "is refused and stays": b"GET /scene.json HTTP/1.1\r\nHost: x\r\n\r\n",
    "asks for a WebSocket": b"GET /ws HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: upgrade\r\n",
    "begins another request": b"GET / HTTP/1.1\r\nHost: x\r\n\r\n" + HALF,
}
every_stranger = pytest.mark.parametrize("says", STRANGERS.values(), ids=STRANGERS)


def stranger(port: int, says: bytes) -> socket.socket:
    """A connection on which these bytes were sent, and no more."""
    connected = socket.create_connection(("127.0.0.1", port), TIMEOUT)
    connected.sendall(says)
    return connected


def ended(connected: socket.socket) -> bool:
    """Wait until the other side has closed a connection; what it said before is left out."""
    try:
        while connected.recv(1 << 16):
            pass
    except ConnectionResetError:
        pass
    return True


def wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


@every_stranger
def test_a_stranger_has_only_so_much_time(session, serve, monkeypatch, says):
    monkeypatch.setattr(connections, "HEAD_SECONDS", 0.2)
    server = serve(session)
    with stranger(server.port, says) as connected:
        assert ended(connected)


def test_bytes_now_and_then_gain_no_time(session, serve, monkeypatch):
    monkeypatch.setattr(connections, "HEAD_SECONDS", 0.5)
    server = serve(session)
    with stranger(server.port, HALF) as connected:
        connected.settimeout(0.05)
        end = time.monotonic() + TIMEOUT
        while time.monotonic() < end:
            try:
                connected.sendall(b"x")
                if connected.recv(1) == b"":
                    return
            except TimeoutError:
                pass
            except OSError as error:
                assert error.errno in (errno.ECONNRESET, errno.EPIPE)
                return
    pytest.fail("the connection is still open")


@every_stranger
@pytest.mark.parametrize("most", [slow(1), 6])
def test_too_many_strangers_push_out_each_other_and_nobody_else(session, serve, monkeypatch, says, most):
    monkeypatch.setattr(serving, "most_connections", lambda: most)
    server = serve(session)
    with PageClient(server) as page, ExitStack() as stack:
        page.rest()
        many = [stack.enter_context(stranger(server.port, says)) for _ in range(5 * most)]
        assert get(server, "/scene.json").status == 200
        assert all(map(ended, many[:-most]))
        assert get(server, "/").read() == b"<p>a page"
        page.digest()  # its WebSocket is still open


def test_who_does_not_read_is_left(session, serve, stub_page, monkeypatch):
    monkeypatch.setattr(connections, "STALL_SECONDS", 0.2)
    (stub_page / "large.bin").write_bytes(bytes(LARGE))
    server = serve(session)
    says = f"GET /large.bin HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode()
    open_ = server._server.server_state.connections
    with stranger(server.port, says) as connected:
        wait_until(lambda: bool(open_))
        wait_until(lambda: not open_)
        found = 0
        try:
            while part := connected.recv(1 << 20):
                found += len(part)
        except ConnectionResetError:
            pass
        assert found < LARGE
    with stranger(server.port, says) as connected:  # who reads gets everything
        found = 0
        while found < LARGE and (part := connected.recv(1 << 20)):
            found += len(part)
        assert found >= LARGE


def test_requests_on_one_connection_have_time_each(session, serve):
    server = serve(session)
    says = f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode()
    with stranger(server.port, says) as connected:
        for _ in range(3):
            answer = b""
            while not answer.endswith(b"<p>a page"):
                answer += connected.recv(1 << 16)
            assert answer.startswith(b"HTTP/1.1 200")
            connected.sendall(says)


class Known:
    """A connection that tells when it is pushed out."""

    def __init__(self, others: Connections) -> None:
        self.others, self.pushed_out = others, False

    def end(self) -> None:
        self.pushed_out = True
        self.others.leave(self)  # type: ignore[arg-type]


def test_who_waits_longest_goes_first_then_who_is_served():
    others = Connections(3)
    a, b, c, d, e, f = (Known(others) for _ in range(6))
    for each in (a, b, c):
        others.wait(each)
    others.serve(a)
    others.wait(a)  # has got an answer, and waits again
    others.wait(d)
    assert [each.pushed_out for each in (a, b, c, d)] == [False, True, False, False]
    for each in (d, c, a):
        others.serve(each)
    others.serve(b)  # is gone already
    others.wait(e)
    assert [each.pushed_out for each in (a, c, d, e)] == [False, False, True, False]
    others.wait(f)
    assert e.pushed_out and len(others) == 3


@pytest.mark.parametrize(
    ("files", "most"),
    [(resource.RLIM_INFINITY, MOST), (4096, MOST), (1024, MOST), (256, 64), (20, 5), (1, 1)],
)
def test_as_many_connections_as_leave_files_to_open(monkeypatch, files, most):
    monkeypatch.setattr(connections.resource, "getrlimit", lambda _: (files, files))
    assert most_connections() == most


@pytest.mark.parametrize("files", [96, slow(256)])
def test_more_strangers_than_files_neither_block_nor_fill_the_log(baked_file, tmp_path, files):
    def few_files() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))

    words = [sys.executable, "-m", "deltalux.cli", "serve", str(baked_file), "--json"]
    with (
        (tmp_path / "log").open("w+") as log,
        subprocess.Popen(
            [*words, "--folder", str(tmp_path)], stdout=subprocess.PIPE, stderr=log, text=True,
            env=environment(), preexec_fn=few_files,
        ) as process,
        ExitStack() as stack,
    ):  # fmt: skip
        assert process.stdout is not None
        try:
            place = json.loads(process.stdout.readline())
            for number in range(2 * files):
                says = list(STRANGERS.values())[number % len(STRANGERS)]
                connected = socket.create_connection(("127.0.0.1", place["port"]), TIMEOUT)
                stack.enter_context(connected)
                with suppress(OSError):  # pushed out already
                    connected.sendall(says)
            asks = (
                f"GET /scene.json?token={place['token']} HTTP/1.1\r\nHost: 127.0.0.1:{place['port']}\r\n\r\n"
            )
            with stranger(place["port"], asks.encode()) as connected:
                assert connected.recv(100).startswith(b"HTTP/1.1 200")
        finally:
            process.terminate()
        assert process.wait(60) in (0, -15)
        log.seek(0)
        assert len(log.readlines()) <= 3


# ---- the log ------------------------------------------------------------------------------------------


def test_each_text_is_told_once_in_a_while():
    now = [0.0]
    seldom = Seldom(10.0, lambda: now[0])
    assert [seldom.line(text) for text in ("a", "a", "b", "a")] == ["a", None, "b", None]
    now[0] = 9.0
    assert seldom.line("a") is None
    now[0] = 10.0
    assert seldom.line("a") == "a (3 more of these before)"
    assert seldom.line("b") == "b"
    now[0] = 30.0
    assert seldom.line("c") == "c"
    assert len(seldom._told) == 1  # the others are forgotten


def test_requests_that_are_none_fill_no_log(session, serve, caplog, monkeypatch):
    monkeypatch.setattr(short_log, "_warnings", Seldom())
    server = serve(session)
    for _ in range(30):
        with stranger(server.port, b"\0\1\2\r\n\r\n") as connected:
            assert ended(connected)
    assert [record.getMessage() for record in caplog.records] == ["Invalid HTTP request received."]


@pytest.mark.parametrize("level", [logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR])
@pytest.mark.parametrize(
    "text", ['"WebSocket /ws?token=%s" [accepted]', "< GET /a?x=1&token=%s&y=2 HTTP/1.1"]
)
def test_no_log_holds_a_token(caplog, level, text):
    keep_short()
    with caplog.at_level(logging.DEBUG, "uvicorn.error"):
        logging.getLogger("uvicorn.error").log(level, text, "se-cret_1")
    (line,) = (record.getMessage() for record in caplog.records)
    assert line == text.replace("%s", "…")


@pytest.mark.parametrize(
    "address",
    ["127.0.0.1:8000/?token=se-cret_1", "ftp://a/?x=1&token=se-cret_1", "http://[a/?token=se-cret_1"],
)
def test_no_error_of_a_client_holds_a_token(address):
    with pytest.raises(dl.OptionError, match=r"connect: found .*token=…") as caught:
        dl.connect(address)
    assert "se-cret" not in str(caught.value)


def test_an_accepted_page_leaves_no_token_in_the_log(session, serve, caplog):
    with caplog.at_level(logging.DEBUG):
        server = serve(session)
        with PageClient(server) as page:
            page.rest()
        server.close()
    own = [r for r in caplog.records if r.name.startswith("uvicorn")]
    assert any("/ws?token=" in record.getMessage() for record in own)
    assert not any(server.token in record.getMessage() for record in own)


@pytest.mark.parametrize("error", [OSError(errno.EMFILE, "Too many open files"), ValueError("a defect")])
def test_a_loop_that_fails_again_and_again_says_so_once(caplog, error):
    loop = asyncio.new_event_loop()
    try:
        keep_loop_short(loop)
        for _ in range(1000):
            loop.call_exception_handler({"message": "accept failed", "exception": error})
    finally:
        loop.close()
    (record,) = caplog.records
    assert record.getMessage() == f"accept failed: {error}"
    assert (record.exc_info is None) == isinstance(error, OSError)  # what is a defect is told with its place
