# SPDX-License-Identifier: Apache-2.0
"""Bake a room, move an object, and check that the update equals a recompute from scratch."""

import deltalux as dl

scene = dl.scenes.cornell_box()
name = scene.movable[0]
with dl.Session(scene, paths=100_000, gather=64) as session:
    bake = session.bake()
    print(f"{len(session.samples):,} samples, unit {scene.unit}, movable: {', '.join(scene.movable)}")

    pose = session.pose(name)  # 4x4, local to world
    pose[0, 3] += 0.05  # metres along +X
    session.move(name, pose)
    frame = session.update()
    print(f"{frame.affected_paths:,} of 100,000 paths traced again")

    updated = session.digest()
    session.recompute()
    assert session.digest() == updated
    print(f"update and recompute have the same digest: {updated}")
