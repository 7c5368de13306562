# SPDX-License-Identifier: Apache-2.0
"""Types of the page and tables of the protocol are those that the server declares."""

from __future__ import annotations

from typing import Literal, TypedDict

import make_protocol
import pytest
from deltalux.server.protocol import messages, told


def test_committed_files_are_what_the_declarations_make(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["make_protocol.py", "--check"])
    assert make_protocol.main() == 0, capsys.readouterr().out


def test_a_stale_file_is_named_and_left_alone(capsys, monkeypatch, tmp_path):
    stale = tmp_path / "messages.ts"
    stale.write_text("export type Nothing = never")
    monkeypatch.setattr(make_protocol, "ROOT", tmp_path)
    monkeypatch.setattr(make_protocol, "TYPES", stale)
    page = tmp_path / "page.md"
    page.write_text(make_protocol.PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.setattr(make_protocol, "PAGE", page)
    monkeypatch.setattr("sys.argv", ["make_protocol.py", "--check"])
    assert make_protocol.main() == 1
    assert capsys.readouterr().out.startswith(
        "messages.ts: found one that the server's declarations do not make"
    )
    assert stale.read_text() == "export type Nothing = never"
    monkeypatch.setattr("sys.argv", ["make_protocol.py"])
    assert make_protocol.main() == 0
    assert stale.read_text(encoding="utf-8") == make_protocol.types_text()


def test_a_new_field_reaches_types_and_page(monkeypatch):
    class CheckedMessage(TypedDict):
        """After `check`."""

        type: Literal["checked"]
        same: bool
        worst: dict[str, tuple[float, ...] | None]

    assert make_protocol.interface(CheckedMessage, "CheckedMessage") == (
        "export interface CheckedMessage {\n  type: 'checked'\n  same: boolean\n"
        "  worst: Record<string, number[] | null>\n}"
    )
    assert make_protocol.row(CheckedMessage) == "| `checked` | `same`, `worst` | After `check`. |"


@pytest.mark.parametrize("kind", [*messages.REQUESTS.values(), *make_protocol.get_args(told.Told)])
def test_every_message_says_what_it_is_for(kind):
    assert make_protocol.row(kind).count("|") == 4
    assert make_protocol.row(kind).rstrip(" |").endswith((".", ")"))
