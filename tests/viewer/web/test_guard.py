# SPDX-License-Identifier: Apache-2.0
"""Strangers and vandals: wrong hosts, origins and tokens, floods, huge and broken frames."""

from __future__ import annotations

import json
import os
import socket
import struct
from urllib.error import HTTPError

import pytest
from deltalux.server.protocol.messages import MAX_TEXT
from deltalux.server.web.guard import BURST, Guard, RateLimit
from deltalux.server.web.hosts import is_loopback
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from thoroughness import examples
from websockets.exceptions import ConnectionClosed, InvalidStatus

from viewer.page_client import TIMEOUT, PageClient, get

GUARDED = ("/scene.json", "/geometry.bin", "/textures/0", "/files/a.glb", "/ws")


@pytest.fixture
def server(session, serve):
    return serve(session)


@pytest.fixture
def expected(session):
    """The digest before the engine has the session."""
    return session.digest()


def refusal(server, path="/scene.json", **options):
    with pytest.raises(HTTPError) as caught:
        get(server, path, **options)
    assert caught.value.code == 403
    return caught.value.read().decode()


@pytest.mark.parametrize("path", GUARDED)
def test_a_missing_or_wrong_token_is_refused(server, path):
    assert "found no token" in refusal(server, path, token="")
    assert "found no token" in refusal(server, path, token=server.token[:-1])


def test_the_page_itself_needs_no_token_and_keeps_to_itself(server):
    response = get(server, "/", token="")
    assert response.read() == b"<p>a page"
    policy = response.headers["content-security-policy"]
    assert policy.startswith("default-src 'self'")
    assert f"connect-src 'self' ws://127.0.0.1:{server.port}" in policy
    assert response.headers["x-content-type-options"] == "nosniff"
    assert response.headers["referrer-policy"] == "no-referrer"


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "", "a b", "10.0.0.1"]
)
def test_a_foreign_host_is_refused(server, host):
    assert "foreign Host" in refusal(server, "/", Host=host)


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"])
def test_a_foreign_origin_is_refused(server, origin):
    assert "foreign Origin" in refusal(server, Origin=origin)
    with pytest.raises(InvalidStatus) as caught:
        PageClient(server, origin=origin)
    assert caught.value.response.status_code == 403


def test_its_own_origin_is_not(server):
    assert get(server, "/scene.json", Origin=f"http://127.0.0.1:{server.port}").status == 200
    with PageClient(server, origin=f"http://127.0.0.1:{server.port}") as page:
        assert page.take()["type"] == "state"


def test_names_of_this_machine():
    assert is_loopback("127.0.0.1")
    assert is_loopback("::1")
    assert is_loopback("localhost")
    assert not is_loopback("0.0.0.0")
    assert not is_loopback("example.org")


@pytest.mark.parametrize(
    ("bound", "host", "known"),
    [
        ("127.0.0.1", "localhost:8000", True),
        ("127.0.0.1", "[::1]:8000", True),
        ("127.0.0.1", "192.168.0.7:8000", False),
        ("0.0.0.0", "192.168.0.7:8000", True),
        ("0.0.0.0", socket.gethostname(), True),
        ("0.0.0.0", "evil.example:8000", False),
        ("studio.local", "studio.local:8000", True),
    ],
)
def test_hosts_by_where_the_server_listens(bound, host, known):
    assert Guard(None, bound, "token", ())._known_host(host) is known


def closed(page):
    """Close code of a connection that the server ends; what else comes is left out."""
    with pytest.raises(ConnectionClosed) as caught:
        while True:
            page.connection.recv(TIMEOUT)
    return caught.value.rcvd.code if caught.value.rcvd else None


def assert_digest(server, expected):
    with PageClient(server) as page:
        page.rest()
        assert page.digest() == expected


def test_floods_binary_messages_and_long_texts_end_the_connection(expected, server):
    with PageClient(server) as page:
        page.take()
        for _ in range(int(BURST) + 300):
            try:
                page.connection.send('{"type": "ack", "seq": 1}')
            except ConnectionClosed:
                break
        assert closed(page) == 1008
    with PageClient(server) as page:
        page.connection.send(b"\x00\x01")
        assert closed(page) == 1003
    with PageClient(server) as page:
        page.connection.send('{"type": "' + "x" * MAX_TEXT + '"}')
        # None: closed while the text was still coming, which resets the connection before the code is read
        assert closed(page) in (1009, None)
    assert_digest(server, expected)


def test_a_frame_of_a_gibibyte_is_refused_when_it_is_announced(expected, server):
    with PageClient(server) as page:
        page.take()
        # FIN + text, masked, 64-bit length; of its bytes only the first few are sent
        page.connection.socket.sendall(struct.pack(">BBQ", 0x81, 0xFF, 1 << 30) + b"mask" + b"x" * 100)
        assert closed(page) == 1009
    assert_digest(server, expected)


@pytest.mark.parametrize("whole", [True, False])
def test_a_text_that_is_no_utf_8_ends_the_connection_without_a_word(expected, server, caplog, capfd, whole):
    with PageClient(server) as page:
        page.take()
        # masked with zeros; in two pieces the character at their border is good, what follows is not
        pieces = [b"\x81\x82\0\0\0\0\xc3\x28"]
        if not whole:
            pieces = [b"\x01\x81\0\0\0\0\xc3", b"\x80\x82\0\0\0\0\xa4\xff"]
        page.connection.socket.sendall(b"".join(pieces))
        assert closed(page) == 1007
    assert_digest(server, expected)
    assert caplog.records == []
    assert capfd.readouterr().err == ""


def test_random_bytes_end_the_connection_and_nothing_else(expected, server):
    for seed in range(5):
        with PageClient(server) as page:
            page.take()
            page.connection.socket.sendall(b"\xf7" + os.urandom(200) + bytes([seed]))
            assert closed(page) == 1002
    with socket.create_connection(("127.0.0.1", server.port), TIMEOUT) as raw:
        raw.sendall(os.urandom(500) + b"\r\n\r\n")
        assert raw.recv(1 << 16).startswith(b"HTTP/1.1 400")
    assert_digest(server, expected)


JSON = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


def test_malformed_messages_get_an_error_and_change_nothing(expected, server):
    with PageClient(server) as page:
        page.rest()
        before = page.state

        @settings(max_examples=examples(40), suppress_health_check=[HealthCheck.too_slow])
        @given(JSON)
        def refused(data):
            page.connection.send(json.dumps(data))
            assert page.until(lambda data: data["type"] in ("error", "accepted"))["type"] == "error"

        refused()
        answer = page.ask("move", name="block", pose=[0.0] * 16)
        assert answer["type"] == "error"
        assert "scales, shears or mirrors" in answer["message"]
        assert page.state == before
        assert page.digest() == expected


def test_the_bucket_fills_with_time():
    limit = RateLimit(rate=0.0, burst=3)
    assert [limit.allows() for _ in range(4)] == [True, True, True, False]
    limit = RateLimit(rate=1e9, burst=3)
    assert all(limit.allows() for _ in range(100))
