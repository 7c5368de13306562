# SPDX-License-Identifier: Apache-2.0
"""The HTTP routes and the WebSocket of the server."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from deltalux.errors import OptionError
from deltalux.scene.look import media_type
from deltalux.server.drawn.geometry import Geometry
from deltalux.server.exports import Exports
from deltalux.server.hub import Hub
from deltalux.server.page import Page

from .guard import Guard, RateLimit
from .short_log import keep_loop_short

NEEDS_TOKEN = ("/scene.json", "/geometry.bin", "/textures/", "/files/", "/ws")
GONE = 410  # status
NO_STORE = {"Cache-Control": "no-store"}
# Close codes of the WebSocket protocol.
BINARY_MESSAGE, TOO_MANY_MESSAGES, TRY_LATER = 1003, 1008, 1013


def make_app(hub: Hub, exports: Exports, *, run: str, host: str, token: str, page: Path) -> ASGIApp:
    """The application behind its guard.

    Parameters
    ----------
    hub, exports : what the application serves; without geometry there is no page
    run : a string that differs from start to start
    host, token : see `Guard`
    page : folder of the page's static files
    """

    async def file(request: Request) -> Response:
        path = exports.path_of(request.path_params["name"])
        if path is None:
            return PlainTextResponse("404: found no file of that name that was written in this run\n", 404)
        return FileResponse(path, filename=path.name, media_type="application/octet-stream", headers=NO_STORE)

    async def socket(websocket: WebSocket) -> None:
        await _serve_page(hub, websocket)

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        keep_loop_short(asyncio.get_running_loop())
        hub.open()
        yield
        await asyncio.to_thread(hub.close)

    routes: list[BaseRoute] = [Route("/files/{name}", file), WebSocketRoute("/ws", socket)]
    if hub.geometry is not None:
        routes += _routes_of_page(hub, {"run": run, "folder": exports.allowed}, page)
    return Guard(Starlette(routes=routes, lifespan=lifespan), host, token, NEEDS_TOKEN)


def _routes_of_page(hub: Hub, more: dict[str, Any], page: Path) -> list[BaseRoute]:
    def asked(request: Request) -> Geometry | None:
        """The geometry, unless the one that is asked for by its number is gone."""
        number = request.query_params.get("geometry")
        assert hub.geometry is not None
        return hub.geometry if number in (None, str(hub.geometry.number)) else None

    async def scene(request: Request) -> Response:
        if (geometry := asked(request)) is None:
            return _gone()
        return JSONResponse(geometry.description | more | {"lit": hub.lit}, headers=NO_STORE)

    async def data(request: Request) -> Response:
        if (geometry := asked(request)) is None:
            return _gone()
        return Response(geometry.data, media_type="application/octet-stream", headers=NO_STORE)

    async def texture(request: Request) -> Response:
        number = request.path_params["number"]
        assert hub.geometry is not None
        if number >= len(hub.geometry.images):
            return PlainTextResponse("404: found no image of that number in scene.json\n", 404)
        image = hub.geometry.images[number]
        return Response(image, media_type=media_type(image), headers=NO_STORE)

    return [
        Route("/scene.json", scene),
        Route("/geometry.bin", data),
        Route("/textures/{number:int}", texture),
        Mount("/", StaticFiles(directory=page, html=True)),
    ]


def _gone() -> Response:
    return PlainTextResponse("410: found a geometry of another number; ask for scene.json again\n", GONE)


async def _serve_page(hub: Hub, websocket: WebSocket) -> None:
    """Serve one page until it leaves or misbehaves; with frames, if there is a mesh."""
    await websocket.accept()
    wanted = websocket.query_params.get("frames") != "0"
    try:
        page = hub.connect(frames=wanted and hub.geometry is not None)
    except OptionError as error:
        await websocket.close(TRY_LATER, str(error))
        return
    sending = asyncio.create_task(page.send_all(websocket.send_text, websocket.send_bytes))
    receiving = asyncio.create_task(_receive_all(hub, page, websocket))
    try:
        await asyncio.wait((sending, receiving), return_when=asyncio.FIRST_COMPLETED)
    finally:
        sending.cancel()
        receiving.cancel()
        hub.disconnect(page)
    # RuntimeError: the server itself has closed the connection, for example after invalid UTF-8.
    with suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
        await sending
    with suppress(asyncio.CancelledError, WebSocketDisconnect):
        if objection := await receiving:  # closing requires that nothing is being sent any more
            await websocket.close(*objection)


async def _receive_all(hub: Hub, page: Page, websocket: WebSocket) -> tuple[int, str] | None:
    """Process messages until the page leaves; otherwise return the code and reason for closing."""
    limit = RateLimit()
    while True:
        message = await websocket.receive()
        if message["type"] == "websocket.disconnect":
            return None
        if message.get("text") is None:
            return BINARY_MESSAGE, "found a binary message, expected JSON"
        if not limit.allows() or page.overflows:
            return TOO_MANY_MESSAGES, "found too many messages, expected 300 a second"
        hub.receive(page, message["text"])
