# SPDX-License-Identifier: Apache-2.0
"""`dl.view` and `deltalux view`, as users start them."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import types
import urllib.request

import deltalux as dl
import deltalux.server.extra as extra
import deltalux.server.viewing as viewing
import pytest
from deltalux.cli import run
from session_files import rewrite

from viewer.commands import environment, running


def test_a_view_serves_until_it_is_closed(session):
    with dl.view(session, open_browser=False, block=False) as shown:
        page = urllib.request.urlopen(shown.url, timeout=30)
        assert b"<html" in page.read()
        assert shown.url in shown._repr_html_()
        assert shown._repr_html_().startswith("<iframe")
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(shown.url, timeout=30)
    shown.close()  # once more does no harm
    assert session.update().done == 1


def test_in_a_notebook_it_neither_blocks_nor_opens_a_browser(session, monkeypatch):
    kernel = types.SimpleNamespace(get_ipython=lambda: types.SimpleNamespace(kernel=1))
    monkeypatch.setitem(sys.modules, "IPython", kernel)
    monkeypatch.setattr(viewing.webbrowser, "open", lambda url: pytest.fail("opened a browser"))
    dl.view(session).close()


def interrupt(*_):
    raise KeyboardInterrupt


def test_elsewhere_it_opens_the_browser_and_blocks_until_ctrl_c(session, monkeypatch):
    opened = []
    monkeypatch.setattr(viewing.webbrowser, "open", opened.append)
    monkeypatch.setattr("deltalux.server.web.serving.Server.wait", interrupt)
    shown = dl.view(session)
    assert opened == [shown.url]
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(shown.url, timeout=30)


def test_without_the_extra_there_is_one_clear_error(session, monkeypatch):
    monkeypatch.setattr(extra, "find_spec", lambda name: None if name == "uvicorn" else 1)
    with pytest.raises(dl.Error, match=r'found no module uvicorn, .* pip install "deltalux\[view\]"'):
        dl.view(session)


def test_the_package_can_be_imported_without_the_extra():
    code = (
        "import sys; sys.modules.update(starlette=None, uvicorn=None, websockets=None)\n"
        "import deltalux as dl, deltalux.cli; print(callable(dl.view))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment())
    assert done.stdout == "True\n", done.stderr


def test_what_is_neither_session_nor_scene_is_refused():
    with pytest.raises(dl.OptionError, match="view: found str, expected a Session or a Scene"):
        dl.view("office")


def test_the_command_prints_the_address_and_ends_with_ctrl_c(baked_file, tmp_path):
    with running("view", str(baked_file), "--no-browser", "--folder", str(tmp_path)) as process:
        line = process.stdout.readline()
        address = line.split()[-1]
        assert address.startswith("http://127.0.0.1:")
        assert urllib.request.urlopen(address, timeout=30).status == 200
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 0
    assert errors == ""


@pytest.mark.parametrize("option", [["--paths", "10"], ["--movable", "block"], ["--light-units", "spec"]])
def test_a_session_file_takes_no_options_of_the_bake(baked_file, capsys, option):
    assert run(["view", str(baked_file), *option]) == 2
    assert f"was baked already; leave out {option[0]}" in " ".join(capsys.readouterr().err.split())


def test_a_host_that_others_reach_is_warned_of(baked_file, capsys, monkeypatch):
    monkeypatch.setattr(
        "deltalux.server.web.serving.Server.wait", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt)
    )
    assert run(["view", str(baked_file), "--no-browser", "--host", "0.0.0.0"]) == 0
    captured = capsys.readouterr()
    assert "warning: 0.0.0.0 can be reached from other machines" in captured.err
    assert "http://localhost:" in captured.out


def test_a_session_of_another_build_is_computed_again(baked_file, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(
        "deltalux.server.web.serving.Server.wait", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt)
    )
    foreign = shutil.copy(baked_file, tmp_path / "foreign.dlx")
    rewrite(foreign, index=lambda index: index.update(built_by="another build"))
    assert run(["view", str(foreign), "--no-browser"]) == 0
    assert f"warning: {foreign}: its light was computed by another build" in capsys.readouterr().err


def test_a_folder_that_is_missing_is_refused_before_anything(baked_file, capsys):
    assert run(["view", str(baked_file), "--no-browser", "--folder", "nowhere"]) == 1
    assert 'folder: found no folder "nowhere"' in capsys.readouterr().err
