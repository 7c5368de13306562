# SPDX-License-Identifier: Apache-2.0
"""Exports: what is written, what is served, and what never leaves the folder."""

from __future__ import annotations

from urllib.error import HTTPError

import deltalux as dl
import numpy as np
import pytest
from deltalux.outputs import read
from deltalux.server.exports import Exports
from rooms import translation

from viewer.page_client import PageClient, get

OUTSIDE = [
    "../a.glb", "..", ".", "", "/tmp/a.glb", "a/b.glb", "a\\b.glb", "..\\a.glb", "C:a.glb", "c:\\a.glb",
    ".a.glb", "a.glb\0.png", "a\n.glb", "~a.glb", "a.glb ", "a.glb.", "x" * 120 + ".glb", "a%2f.glb",
    "%2e%2e.glb", "a*.glb",
]  # fmt: skip


@pytest.mark.parametrize("name", OUTSIDE)
def test_names_that_are_not_plain_are_refused(tmp_path, name):
    with pytest.raises(dl.OptionError, match="expected a plain name"):
        Exports(tmp_path).checked_name(name)


@pytest.mark.parametrize("name", ["a", "a.exe", "a.glb.py", "a.GLB"])
def test_unknown_suffixes_are_refused(tmp_path, name):
    with pytest.raises(dl.OptionError, match=r"expected one of .csv, .glb, .npz, .png, .dlx"):
        Exports(tmp_path).checked_name(name)


def test_without_a_folder_nothing_is_exported():
    exports = Exports(None)
    assert not exports.allowed
    with pytest.raises(dl.OptionError, match="start it with --folder"):
        exports.checked_name("a.glb")


def test_a_folder_must_exist(tmp_path):
    with pytest.raises(dl.OptionError, match="found no folder"):
        Exports(tmp_path / "nowhere")


def test_only_files_of_this_run_are_replaced_and_served(tmp_path, session):
    (tmp_path / "mine.csv").write_text("precious")
    (tmp_path / "mine-2.csv").write_text("precious, too")
    exports = Exports(tmp_path)
    with pytest.raises(dl.OptionError, match=r'not of this run; "mine-3.csv" is free'):
        exports.checked_name("mine.csv")
    assert exports.path_of("mine.csv") is None
    for _ in range(2):
        size, address = exports.write("new.csv", session)
        assert size == (tmp_path / "new.csv").stat().st_size
        assert address == "files/new.csv"
    assert exports.path_of("new.csv") == tmp_path / "new.csv"
    assert (tmp_path / "mine.csv").read_text() == "precious"


def test_links_lead_nowhere(tmp_path, session):
    inside, outside = tmp_path / "in", tmp_path / "out.csv"
    inside.mkdir()
    (inside / "link.csv").symlink_to(outside)  # dangling: writing through it would create the file
    exports = Exports(inside)
    with pytest.raises(dl.OptionError, match="not of this run"):
        exports.checked_name("link.csv")
    exports.write("a.csv", session)
    (inside / "a.csv").unlink()
    outside.write_text("secret")
    (inside / "a.csv").symlink_to(outside)
    assert exports.path_of("a.csv") is None
    exports.write("a.csv", session)  # takes the link's place
    assert outside.read_text() == "secret"
    assert not (inside / "a.csv").is_symlink()


def test_pages_export_the_present_state(session, serve, tmp_path):
    server = serve(session, folder=tmp_path)
    with PageClient(server) as page:
        page.rest()
        pose = translation(0.1, 0.4, 0.2)
        page.ask("move", name="block", pose=pose.T.ravel().tolist())
        answers = {name: page.ask("export", file=name) for name in ("a.csv", "a.glb", "a.npz", "a.dlx")}
        assert {answer["type"] for answer in answers.values()} == {"exported"}
        digest = page.digest()
    data = get(server, "/" + answers["a.csv"]["address"]).read()
    assert len(data) == answers["a.csv"]["bytes"] == (tmp_path / "a.csv").stat().st_size
    with dl.Session.open(tmp_path / "a.dlx") as saved:
        assert saved.digest() == digest
        assert np.array_equal(saved.pose("block"), pose)
        assert read(tmp_path / "a.npz").irradiance == pytest.approx(saved.irradiance)


def test_refused_exports_answer_with_an_error(session, serve, tmp_path):
    server = serve(session, folder=tmp_path)
    with PageClient(server) as page:
        page.rest()
        for name in ("../a.glb", "a.exe"):
            answer = page.ask("export", file=name)
            assert answer["type"] == "error"
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("path", ["/files/other.csv", "/files/..%2fother.csv", "/files/%2e%2e/other.csv"])
def test_other_files_are_not_served(session, serve, tmp_path, path):
    (tmp_path / "folder").mkdir()
    for place in (tmp_path, tmp_path / "folder"):
        (place / "other.csv").write_text("secret")
    server = serve(session, folder=tmp_path / "folder")
    with pytest.raises(HTTPError) as caught:
        get(server, path)
    assert caught.value.code == 404
