# SPDX-License-Identifier: Apache-2.0
"""`dl.view`: a session in the browser, or in a cell of a notebook."""

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

HEIGHT = 640  # pixels of a cell's frame


class View:
    """A session that is being shown; in a notebook it is the page itself.

    Parameters
    ----------
    server : what serves it
    """

    def __init__(self, server: Any) -> None:
        self._server = server
        atexit.register(self.close)  # no thread may be inside the engine when the interpreter ends

    @property
    def url(self) -> str:
        """The page's address; whoever knows it can edit the session."""
        return self._server.url

    @property
    def places(self) -> dict[str, Any]:
        """For programs: `address`, `websocket`, `token`, `port`, and `page`, whether there is one."""
        return self._server.places

    def close(self) -> None:
        """Stop serving; from now on the session is its owner's again, in the state that was reached."""
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
    """Show a session in the browser: drag objects, and the light follows.

    The page edits the session itself. Until the view is closed, nobody else may use the session.

    Parameters
    ----------
    what : Session, or Scene
        A session without light is baked first, with progress and previews; a scene gets a session with
        the default options.
    host, port : where to listen. Everybody who can reach the host and knows the address can edit the
        session and write into `folder`; the default is for this machine only. Port 0 takes a free one.
    folder : where the page may export to; None = nowhere
    open_browser : bool
    block : wait for Ctrl-C, then close; None = unless in a notebook

    Returns
    -------
    View
        With `url` and `close()`; in a notebook it shows the page.

    Raises
    ------
    Error
        Where the extra is not installed.
    OptionError
        For samples that are not on the scene's display mesh (`Samples.on_vertices`).
    """
    check_extra("view")
    if not isinstance(what, (Session, Scene)):
        raise OptionError(f"view: found {type(what).__name__}, expected a Session or a Scene")
    from .serving import Server  # wants the extra

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
    """Serve a session to programs, here or in other processes: see `connect`.

    It is the viewer's server without a browser: where the samples are on the scene's display mesh, the page
    is at its address. Until it is closed, nobody else may use the session.

    Parameters
    ----------
    session : Session
        One without light is baked first.
    host, port, folder : see `view`

    Returns
    -------
    View
        With `url`, `close()` and `wait()`.

    Raises
    ------
    Error
        Where the extra is not installed.
    OptionError, OSError
        For a host, port or folder that cannot be used.
    """
    check_extra("serve")
    if not isinstance(session, Session):
        raise OptionError(f"serve: found {type(session).__name__}, expected a Session")
    from .serving import Server  # wants the extra

    return View(Server(session, host, port, folder, shown=False))


def _in_notebook() -> bool:
    """Whether an IPython kernel runs this, that is, cells show what they return."""
    shell = sys.modules.get("IPython")
    running = shell and shell.get_ipython()
    return running is not None and hasattr(running, "kernel")
