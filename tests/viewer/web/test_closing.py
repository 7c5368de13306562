# SPDX-License-Identifier: Apache-2.0
"""Ends of connections: the page's, ours, and the server library's own; none is an error of ours."""

from __future__ import annotations

import asyncio
import logging
import socket
from concurrent.futures import ThreadPoolExecutor

import pytest
from deltalux.server.drawn.geometry import geometry_of
from deltalux.server.exports import Exports
from deltalux.server.hub import Hub
from deltalux.server.web.app import BINARY_MESSAGE, TOO_MANY_MESSAGES, _serve_page
from starlette.websockets import WebSocket

from viewer.page_client import PageClient


class Connection:
    """A connection as uvicorn has it: once closed, by whomever, nothing may be sent."""

    def __init__(self, *messages):
        self._messages = list(messages)
        self.sent = []
        self.closed = asyncio.Event()

    async def receive(self):
        if self._messages:
            return self._messages.pop(0)
        await self.closed.wait()
        return {"type": "websocket.disconnect", "code": 1007}

    async def send(self, message):
        await asyncio.sleep(0)
        if self.closed.is_set():
            raise RuntimeError("Unexpected ASGI message 'websocket.send', after sending 'websocket.close'.")
        self.sent.append(message)
        if message["type"] == "websocket.close":
            self.closed.set()


def served(session, *messages, close_after=None):
    """Serve one page that says this; what was sent to it. The library closes after some messages."""

    async def serve():
        hub = Hub(session, Exports(None), geometry_of(session))
        connection = Connection({"type": "websocket.connect"}, *messages)

        async def send(message):
            await connection.send(message)
            if len(connection.sent) == close_after:
                connection.closed.set()

        hub.open()
        try:
            websocket = WebSocket({"type": "websocket", "query_string": b""}, connection.receive, send)
            await asyncio.wait_for(_serve_page(hub, websocket), 30)
            assert not hub._pages
        finally:
            await asyncio.to_thread(hub.close)
        return connection.sent

    with ThreadPoolExecutor(1) as aside:  # other tests may have left a loop running here
        return aside.submit(lambda: asyncio.run(serve())).result()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_connection_that_the_library_closed_ends_quietly(session, count):
    assert len(served(session, close_after=count)) == count


def test_nothing_is_sent_after_a_connection_was_closed_for_a_binary_message(session):
    sent = served(session, {"type": "websocket.receive", "bytes": b"\0"})
    assert sent[-1]["type"] == "websocket.close"
    assert sent[-1]["code"] == BINARY_MESSAGE
    assert sent[-1]["reason"] == "found a binary message, expected JSON"


def test_nothing_is_sent_after_a_connection_was_closed_for_too_many_messages(session):
    text = {"type": "websocket.receive", "text": '{"type": "undo", "id": 1}'}
    sent = served(session, *[text] * 400)
    assert [message["type"] for message in sent].index("websocket.close") == len(sent) - 1
    assert sent[-1]["code"] == TOO_MANY_MESSAGES


def test_text_that_is_no_utf_8_ends_its_connection_only(session, serve, caplog):
    server = serve(session)
    with PageClient(server) as page:
        page.rest()
        with caplog.at_level(logging.ERROR):
            for _ in range(10):
                with socket.create_connection(("127.0.0.1", server.port)) as link:
                    link.sendall(
                        f"GET /ws?token={server.token} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n"
                        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
                    )
                    assert link.recv(1 << 16).startswith(b"HTTP/1.1 101")
                    link.sendall(b"\x81\x82\0\0\0\0\xff\xfe")  # a masked text of two bytes
                    while link.recv(1 << 16):
                        pass
        page.ask("dim", group="desk", factor=0.5)
        page.rest()
    assert {r.getMessage() for r in caplog.records} <= {"Invalid UTF-8 sequence received from client."}
