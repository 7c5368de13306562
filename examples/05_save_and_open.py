# SPDX-License-Identifier: Apache-2.0
"""Save a session, open it, remove an object and put it back: the last bit is as it was."""

import tempfile
from pathlib import Path

import deltalux as dl

scene = dl.scenes.cornell_box()
name = scene.movable[0]
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "box.dlx"
    with dl.Session(scene, paths=50_000, gather=64) as session:
        session.bake()
        session.save(file)
        original = session.digest()
    with dl.Session.open(file) as session:
        assert session.digest() == original
        session.remove(name)
        session.update()
        assert session.digest() != original
        session.add(name)
        session.update()
        assert session.digest() == original
        print(f"{name} removed and put back: digest {session.digest()}")
