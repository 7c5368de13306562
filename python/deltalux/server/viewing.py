# SPDX-License-Identifier: Apache-2.0
"""`dl.view`: shows a session in the browser, or in a cell of a notebook."""

from __future__ import annotations

import atexit
import os
import sys
import webbrowser
from html import escape
from typing import Any

from deltalux.errors import OptionError
from deltalux.scene import Scene
from deltalux.session import Session

from .extra import check_extra

HEIGHT = 640  # pixels, height of the frame in a cell


class View:
    """A session that is being shown; a notebook displays it as the page itself.

    Parameters
    ----------
    server : the server of the session
    """

    def __init__(self, server: Any) -> None:
        self._server = server
        atexit.register(self.close)  # no thread may be inside the core when the interpreter ends

    @property
    def url(self) -> str:
        """Address of the page; whoever knows it can edit the session."""
        return self._server.url

    @property
    def places(self) -> dict[str, Any]:
        """For programs: `address`, `websocket`, `token`, `port`, and `page`: whether there is a page."""
        return self._server.places

    def close(self) -> None:
        """Stop serving; the caller may then use the session again, in the state that it reached."""
        atexit.unregister(self.close)
        self._server.close()

    def wait(self) -> None:
        """Block until Ctrl-C, then close."""
        try:
            while True:
                self._server.wait(0.5)
        except KeyboardInterrupt:
            pass
        finally:
            self.close()

    def __enter__(self) -> View:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _repr_html_(self) -> str:
        size = f'width="100%" height="{HEIGHT}" style="border:0"'
        return f'<iframe src="{escape(self.url, quote=True)}" {size} allowfullscreen></iframe>'

    def __repr__(self) -> str:
        return f"View({self.url!r})"


def view(
    what: Session | Scene,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    folder: str | os.PathLike[str] | None = None,
    open_browser: bool = True,
    block: bool | None = None,
) -> View:
    """Show a session in the browser; when objects are dragged there, the light follows.

    The page edits the session itself. Until the view is closed, nobody else may use the session.

    Parameters
    ----------
    what : Session, or Scene
        A session without light is baked first, with progress and previews; for a scene, a session with
        the default options is made.
    host, port : address to listen on. Everybody who can reach the host and knows the page's address can edit
        the session and write into `folder`; by default only this machine can. Port 0 = a free one.
    folder : where the page may export to; None = exports are refused
    open_browser : bool
    block : wait for Ctrl-C, then close; None = yes, except in a notebook

    Returns
    -------
    View
        With `url` and `close()`; a notebook displays the page.

    Raises
    ------
    Error
        If the extra is not installed.
    OptionError
        For samples that are not on the scene's display mesh (`Samples.on_vertices`).
    """
    check_extra("view")
    if not isinstance(what, (Session, Scene)):
        raise OptionError(f"view: found {type(what).__name__}, expected a Session or a Scene")
    from .web.serving import Server  # requires the extra

    session = Session(what) if isinstance(what, Scene) else what
    shown = View(Server(session, host, port, folder))
    notebook = _in_notebook()
    if open_browser and not notebook:
        webbrowser.open(shown.url)
    if not notebook if block is None else block:
        shown.wait()
    return shown


def serve(
    session: Session,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    folder: str | os.PathLike[str] | None = None,
) -> View:
    """Serve a session to programs in this or other processes: see `connect`.

    This is the viewer's server without opening a browser: if the samples are on the scene's display mesh, the
    page is available, too. Until the server is closed, nobody else may use the session.

    Parameters
    ----------
    session : Session
        A session without light is baked first.
    host, port, folder : see `view`

    Returns
    -------
    View
        With `url`, `close()` and `wait()`.

    Raises
    ------
    Error
        If the extra is not installed.
    OptionError, OSError
        For a host, port or folder that cannot be used.
    """
    check_extra("serve")
    if not isinstance(session, Session):
        raise OptionError(f"serve: found {type(session).__name__}, expected a Session")
    from .web.serving import Server  # requires the extra

    return View(Server(session, host, port, folder, shown=False))


def _in_notebook() -> bool:
    """Whether an IPython kernel runs this code, so that cells display their results."""
    shell = sys.modules.get("IPython")
    running = shell and shell.get_ipython()
    return running is not None and hasattr(running, "kernel")
