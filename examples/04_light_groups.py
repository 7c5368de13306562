# SPDX-License-Identifier: Apache-2.0
"""Dim the office's lamps, group by group: no path is traced again."""

import deltalux as dl

scene = dl.scenes.office()
with dl.Session(scene, paths=100_000, gather=64) as session:
    session.bake()
    full = session.irradiance.mean()
    print("all lamps at full power: 100 %")
    for group in scene.groups:
        session.dim(group, 0.0)
        frame = session.update()
        assert frame.affected_paths == 0
        print(f'without "{group}": {session.irradiance.mean() / full:.0%} of the light, no path traced again')
        session.dim(group, 1.0)
    session.update()
    assert session.irradiance.mean() == full
