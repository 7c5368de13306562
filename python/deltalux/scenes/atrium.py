# SPDX-License-Identifier: Apache-2.0
"""Demonstration scene: a two-storey arcaded courtyard under a skylight, in lux; a trolley to move."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from deltalux.errors import OptionError
from deltalux.scene import Camera, Material, Mesh, Scene, SunLight

from . import courtyard, furniture, masonry
from .placing import COOL, WARM, lamp_luminance, look_at, luminance
from .shapes import GAP, Shape, box, merge, room, sheet, tiles, tube

BAY = 3.6  # metres between columns; the gallery is one bay deep
COURT_BAYS = (7, 3)  # along x and z
COURT = (COURT_BAYS[0] * BAY / 2, COURT_BAYS[1] * BAY / 2)  # half sizes, to the columns' axes
OUTER = (COURT[0] + BAY, COURT[1] + BAY)  # half sizes, to the outer walls
UPPER_FLOOR, ROOF, SKYLIGHT = 5.4, 10.05, 11.6  # heights
STOREYS = (("ground", 0.0, 3.2), ("upper", UPPER_FLOOR, 8.0))  # floor and springing line of each
ARCH, WALL_HALF, RIB_HALF = 1.55, 0.25, 0.2  # radius of the openings; half thicknesses
SKY_LUMINANCE, SUN_LUX = 900.0, 4500.0
LAMP_LUMENS = 2200.0
LAMP_DROP = 1.5  # metres from the vaults' crowns down to the lanterns' centres
TROLLEY_AT = (-5.9, 0.4)  # x, z
CLOTHS = ("cloth_red", "cloth_blue", "cloth_green")
MAX_TROLLEY = 0.12


def atrium(detail: float = 1.0, *, trolley_size: float = 0.03, sun: bool = False) -> Scene:
    """A courtyard of 25 x 11 m within galleries on two floors, 32 x 18 x 12 m in all.

    Parameters
    ----------
    detail : float
        Number of triangles of the static geometry relative to the default's 290,000, accurate to
        10 % from 1 upwards. The trolley and the lamps do not change.
    trolley_size : float
        Diagonal of the trolley's bounding box as a share of the scene's.
    sun : bool
        Leave the middle row of the skylight open and let the sun in, as group "sun".

    Returns
    -------
    Scene
        Unit "lux"; light groups "skylight", "ground lamps", "upper lamps"; movable "trolley"
        (at the default size the court's floor is free for x -10 to 5, z -3.5 to 3.5, urns and benches
        standing beyond that); cameras "main" and "gallery".

    Raises
    ------
    OptionError
        If `detail` or `trolley_size` is out of range.
    """
    if not 0.5 <= detail <= 100:
        raise OptionError(f"atrium: detail: found {detail}, expected 0.5 to 100")
    if not 0 < trolley_size <= MAX_TROLLEY:
        raise OptionError(
            f"atrium: trolley_size: found {trolley_size}, expected a share of the scene's diameter, "
            f"above 0 and up to {MAX_TROLLEY}"
        )
    # Triangles are about 75,000 + 294,000 * fine^2, since plain blocks stay as they are.
    fine = float(np.sqrt(0.98 * detail - 0.26))
    static = [*_shell(fine), *_skylight(sun), *_structure(fine), *_furnishing(fine), *_lanterns()]
    return Scene(
        [*static, _trolley(static, trolley_size)],
        _materials(),
        [SunLight("sun", (0.42, -1.0, -0.30), luminance(SUN_LUX, (1.0, 0.93, 0.80)))] if sun else [],
        unit="lux",
        cameras=_cameras(),
    )


def _cameras() -> list[Camera]:
    return [
        look_at("main", (-11.2, 2.3, 2.6), (0.2, 2.9, -0.9), 58),
        look_at("gallery", (10.2, 7.3, -6.4), (-4.0, 3.0, 2.0), 60),
    ]


def _materials() -> list[Material]:
    plain = {
        "stucco": (0.62, 0.52, 0.38),
        "stone": (0.58, 0.53, 0.46),
        "stone_light": (0.68, 0.64, 0.57),
        "vault": (0.72, 0.69, 0.63),
        "dado": (0.40, 0.24, 0.17),
        "recess": (0.30, 0.36, 0.38),
        "marble_white": (0.50, 0.47, 0.42),
        "marble_red": (0.34, 0.17, 0.13),
        "marble_dark": (0.15, 0.16, 0.17),
        "brick": (0.42, 0.27, 0.18),
        "brick_light": (0.50, 0.35, 0.24),
        "iron": (0.10, 0.10, 0.10),
        "brass": (0.55, 0.40, 0.16),
        "clay": (0.52, 0.28, 0.18),
        "soil": (0.07, 0.05, 0.03),
        "leaf": (0.12, 0.28, 0.08),
        "water": (0.12, 0.22, 0.24),
        "cloth_red": (0.52, 0.07, 0.06),
        "cloth_blue": (0.09, 0.16, 0.42),
        "cloth_green": (0.10, 0.33, 0.14),
        "wood": (0.42, 0.26, 0.13),
        "crate": (0.58, 0.42, 0.22),
        "rubber": (0.06, 0.06, 0.06),
        "sackcloth": (0.60, 0.52, 0.38),
    }
    sky = luminance(SKY_LUMINANCE, COOL)
    globe = lamp_luminance(LAMP_LUMENS, courtyard.globe_area(), WARM)
    return [
        *(Material(name, reflectance) for name, reflectance in plain.items()),
        Material("sky", (0.3, 0.3, 0.3), sky, "skylight"),
        Material("globe_ground", (0.6, 0.6, 0.6), globe, "ground lamps"),
        Material("globe_upper", (0.6, 0.6, 0.6), globe, "upper lamps"),
    ]


def _shell(fine: float) -> list[Mesh]:
    """Outer walls and floors; sheets that face inwards."""
    walls = room(2 * OUTER[0], ROOF, 2 * OUTER[1], [None, None, *["stucco"] * 4])
    inner = (COURT[0] - 0.05, COURT[1] - 0.05)  # the upper floor's edge, hidden in the cornice
    strips = []
    for sign in (-1, 1):
        strips.append(_paving((-OUTER[0], OUTER[0]), (inner[1] * sign, OUTER[1] * sign), 0.6, fine, _brick))
        strips.append(_paving((inner[0] * sign, OUTER[0] * sign), (-inner[1], inner[1]), 0.6, fine, _brick))
    return [
        walls.mesh("outer_walls"),
        _paving((-OUTER[0], OUTER[0]), (-OUTER[1], OUTER[1]), 0.6, fine, _marble).mesh("ground_floor"),
        merge(strips).moved(0, UPPER_FLOOR).mesh("upper_floor"),
    ]


def _paving(
    x: tuple[float, float],
    z: tuple[float, float],
    slab: float,
    fine: float,
    name: Callable[[float, float], str],
) -> Shape:
    """Slabs of about `slab` metres, each cut finer with `fine`; `name(x, z)` at a slab's centre."""
    cuts = max(1, round(fine))
    xs, zs = (
        np.linspace(min(ends), max(ends), max(1, round(abs(ends[1] - ends[0]) / slab)) * cuts + 1)
        for ends in (x, z)
    )

    def slab_of(i: int, j: int) -> str:
        i, j = i // cuts * cuts, j // cuts * cuts
        return name(float(xs[i] + xs[i + cuts]) / 2, float(zs[j] + zs[j + cuts]) / 2)

    return tiles(xs, zs, slab_of)


def _marble(x: float, z: float) -> str:
    """Chequered court with a dark border; diagonal bands in the galleries."""
    i, j = int(np.floor(x / 0.6)), int(np.floor(z / 0.6))
    if abs(x) < COURT[0] - 0.3 and abs(z) < COURT[1] - 0.3:
        rim = abs(x) > COURT[0] - 1.5 or abs(z) > COURT[1] - 1.5
        return ("marble_dark" if rim else "marble_red") if (i + j) % 2 else "marble_white"
    if abs(x) < COURT[0] + 0.3 and abs(z) < COURT[1] + 0.3:
        return "marble_dark"
    return ("brick", "brick_light")[(i + j) % 2]


def _brick(x: float, z: float) -> str:
    return ("brick", "brick_light")[int(np.floor(x / 0.6) + np.floor(z / 0.6)) % 2]


def _skylight(sun: bool) -> list[Mesh]:
    """Attic wall above the court, a grid of beams and luminous panes that face down."""
    half = (COURT[0] + 0.11, COURT[1] + 0.11)  # within the walls below and the outer beams
    attic = room(2 * half[0], SKYLIGHT - ROOF + 0.25, 2 * half[1], [None, None, *["stucco"] * 4])
    rafter = box(0.24, 0.36, 2 * half[1] + 0.2, "iron").moved(0, SKYLIGHT - 0.22)
    purlin = box(2 * half[0] + 0.16, 0.30, 0.20, "iron").moved(0, SKYLIGHT - 0.18)
    beams = [rafter.moved(x) for x in _axes(0)] + [purlin.moved(0, 0, z) for z in _axes(1)]
    w, d = BAY / 2 - 0.11, BAY / 2 - 0.09  # 1 cm into the beams
    pane = sheet([(-w, 0, -d), (w, 0, -d), (w, 0, d), (-w, 0, d)], "sky")
    rows = [z for z in _middles(1) if not (sun and z == 0)]
    # One mesh, hence one light: its panes are equally bright, and the cost of shadow rays is per light.
    panes = merge(pane.moved(x, SKYLIGHT, z) for x in _middles(0) for z in rows)
    return [
        attic.moved(0, ROOF - 0.15).mesh("attic"),
        merge(beams).mesh("skylight_beams"),
        panes.mesh("skylight"),
    ]


def _axes(side: int) -> np.ndarray:
    """Positions of the columns' axes along x (0) or z (1)."""
    return (np.arange(COURT_BAYS[side] + 1) - COURT_BAYS[side] / 2) * BAY


def _middles(side: int) -> np.ndarray:
    """Positions of the bays' centres between the columns' axes."""
    return (_axes(side)[:-1] + _axes(side)[1:]) / 2


def _structure(fine: float) -> Iterator[Mesh]:
    for name, floor, spring in STOREYS:
        yield from _supports(name, floor, spring, fine)
        yield from _arches(name, spring, fine)
        relief = masonry.arch_moulding(0.85, 1.45, 0.16, 0.07, fine, "stone_light")
        vault = masonry.groin_vault(BAY / 2, fine, "vault")
        yield merge(vault.moved(x, spring, z) for x, z in _gallery_cells()).mesh(f"{name}_vaults")
        for part, piece, height in (
            ("dado", masonry.dado(BAY - 0.36, 0.82, "dado", "stone"), floor + 0.002),
            ("wall_arches", relief, floor + 0.815),
            ("wall_panels", masonry.arched_panel(0.88, 1.45, 0.02, fine, "recess"), floor + 0.81),
        ):
            pieces = [piece.turned(turn).moved(x, height, z) for x, z, turn in _wall_bays()]
            yield merge(pieces).mesh(f"{name}_{part}")
    for name, low, height, proud in (
        ("lower_cornice", UPPER_FLOOR - 0.24, 0.26, 0.26),
        ("upper_cornice", ROOF - 0.3, 0.45, 0.42),
    ):
        half = (COURT[0] - WALL_HALF, COURT[1] - WALL_HALF)
        profile = masonry.cornice(low, height, proud)
        yield masonry.moulding_loop(profile, *half, 0.9 / fine, "stone_light").mesh(name)
    yield from _balustrade(fine)


def _supports(name: str, floor: float, spring: float, fine: float) -> Iterator[Mesh]:
    """Columns along the court, piers at its corners, pilasters on the outer walls."""
    foot = GAP if floor == 0 else floor - 0.02
    height = spring - foot + 0.005  # they end inside the vault or arch above
    radius, flutes = (0.22, 0) if floor == 0 else (0.20, 16)
    column = masonry.column(height, radius, fine, "stone", "stone_light", flutes)
    places = [(x, z) for x in _axes(0)[1:-1] for z in (-COURT[1], COURT[1])]
    places += [(x, z) for x in (-COURT[0], COURT[0]) for z in _axes(1)[1:-1]]
    yield merge(column.moved(x, foot, z) for x, z in places).mesh(f"{name}_columns")
    pier = masonry.pier(height + 0.005, 0.27, 0.27, "stone")
    corners = [(x, z) for x in (-COURT[0], COURT[0]) for z in (-COURT[1], COURT[1])]
    yield merge(pier.moved(x, foot, z) for x, z in corners).mesh(f"{name}_piers")
    pilaster = masonry.pier(height + 0.005, 0.22, 0.14, "stone")
    # Their backs lie 5 mm behind the wall.
    x, z = OUTER[0] - 0.135, OUTER[1] - 0.135
    shafts = [pilaster.moved(at, foot, side * z) for at in _axes(0) for side in (-1, 1)]
    shafts += [pilaster.turned(90).moved(side * x, foot, at) for at in _axes(1) for side in (-1, 1)]
    yield merge(shafts).mesh(f"{name}_pilasters")


def _arches(name: str, spring: float, fine: float) -> Iterator[Mesh]:
    """Arcade walls around the court with archivolts, and ribs across the galleries."""
    top = (UPPER_FLOOR if spring < UPPER_FLOOR else ROOF) - 0.05
    # The short walls end inside the long ones and are a little lower, so that no faces coincide.
    long = masonry.arcade_wall(
        COURT_BAYS[0], BAY, ARCH, spring, top, WALL_HALF - 0.005, WALL_HALF, fine, "stucco"
    )
    short = masonry.arcade_wall(
        COURT_BAYS[1], BAY, ARCH, spring + 0.002, top - 0.01, 0.6 * WALL_HALF, WALL_HALF, fine, "stucco"
    )
    walls = [long.moved(0, 0, side * COURT[1]) for side in (-1, 1)]
    walls += [short.turned(90).moved(side * COURT[0]) for side in (-1, 1)]
    yield merge(walls).mesh(f"{name}_arcades")

    moulding = masonry.arch_moulding(ARCH + 0.02, 0.0, 0.17, 0.05, fine, "stone_light")
    bands = []
    for turn, side, across in ((0, 0, 1), (180, 0, 1), (90, 1, 0), (-90, 1, 0)):
        for middle in _middles(side):
            place = np.array([middle, WALL_HALF - COURT[across]]) * (1 if turn in (0, 90) else -1)
            x, z = place if side == 0 else place[::-1]
            bands.append(moulding.turned(turn).moved(x, spring + 0.004 + 0.002 * side, z))
    yield merge(bands).mesh(f"{name}_archivolts")

    rib = masonry.rib(ARCH, BAY / 2 - 0.02 - ARCH, RIB_HALF, fine, "stone")
    ribs = [
        rib.turned(90).moved(x, spring + 0.007, side * (COURT[1] + BAY / 2))
        for x in _axes(0)
        for side in (-1, 1)
    ]
    ribs += [rib.moved(side * (COURT[0] + BAY / 2), spring + 0.008, z) for z in _axes(1) for side in (-1, 1)]
    yield merge(ribs).mesh(f"{name}_ribs")


def _gallery_cells() -> list[tuple[float, float]]:
    """Centres (x, z) of the vaulted bays around the court."""
    x = (np.arange(COURT_BAYS[0] + 2) - (COURT_BAYS[0] + 1) / 2) * BAY
    z = (np.arange(COURT_BAYS[1] + 2) - (COURT_BAYS[1] + 1) / 2) * BAY
    return [(a, b) for a in x for b in z if a in (x[0], x[-1]) or b in (z[0], z[-1])]


def _wall_bays() -> list[tuple[float, float, float]]:
    """Centre (x, z) of each bay of the outer walls, and its inward rotation about +y, degrees."""
    bays = []
    for x, z in _gallery_cells():
        if abs(z) > COURT[1]:
            bays.append((x, float(np.sign(z)) * OUTER[1], 0.0 if z < 0 else 180.0))
        if abs(x) > COURT[0]:
            bays.append((float(np.sign(x)) * OUTER[0], z, 90.0 if x < 0 else -90.0))
    return bays


def _balustrade(fine: float) -> Iterator[Mesh]:
    """Kerb, balusters and handrail between the upper columns."""
    posts = 7
    kerb = masonry.rail(BAY - 0.5, 0.11, 0.24, "stone").moved(0, 0.01)
    handrail = masonry.rail(BAY - 0.34, 0.13, 0.24, "stone_light").moved(0, 0.83)
    baluster = masonry.baluster(0.725, fine, "stone_light").moved(0, 0.113)
    xs = (np.arange(posts) - (posts - 1) / 2) * (BAY - 0.62) / posts
    turned = merge(baluster.moved(x) for x in xs)
    for name, piece in (("kerbs", kerb), ("balusters", turned), ("handrails", handrail)):
        bays = []
        for side, turn in ((0, 0), (1, 90)):
            for middle in _middles(side):
                for edge in (-COURT[1 - side], COURT[1 - side]):
                    x, z = (middle, edge) if side == 0 else (edge, middle)
                    bays.append(piece.turned(turn).moved(x, UPPER_FLOOR, z))
        yield merge(bays).mesh(name)


def _furnishing(fine: float) -> Iterator[Mesh]:
    """Curtains, tapestries, urns, benches and the fountain."""
    rods = []
    spots = [(1, -1), (3, -1), (5, -1), (0, 1), (2, 1), (4, 1), (6, 1)]
    for i, (bay, side) in enumerate(spots):
        x = _axes(0)[bay] + BAY / 2
        z = side * COURT[1]
        rods.append(tube([(x - BAY / 2, 3.03, z), (x + BAY / 2, 3.03, z)], 0.02, 12, "brass"))
        shift = 0.72 if i % 2 else -0.72
        cloth = courtyard.curtain(1.45, 2.86, 6.5, fine, CLOTHS[i % 3])
        yield cloth.turned(180.0 * (i % 2)).moved(x + shift, 0.16, z).mesh(f"curtain_{i + 1}")
    yield merge(rods).mesh("curtain_rods")
    front = COURT[1] - WALL_HALF - 0.26 - GAP
    for i, (column, side) in enumerate([(2, -1), (4, -1), (6, -1), (1, 1), (3, 1), (5, 1)]):
        drape = courtyard.drape(1.15, 2.25, fine, CLOTHS[(i + 1) % 3], "brass")
        drape = drape.turned(0 if side < 0 else 180).moved(
            _axes(0)[column], UPPER_FLOOR - 0.005, side * front
        )
        yield drape.mesh(f"tapestry_{i + 1}")
    urns = [(1, -1), (3, -1), (5, -1), (7, -1), (0, 1), (2, 1), (4, 1), (6, 1)]
    for i, (column, side) in enumerate(urns):
        urn = merge(
            [
                courtyard.urn(fine, "clay", "stone", "soil"),
                furniture.foliage("leaf", 50 + i).scaled(0.8).moved(0, 0.905),
            ]
        )
        x = _axes(0)[column] + (0.55 if column == 0 else -0.55 if column == 7 else 0.0)
        yield urn.moved(x, GAP, side * (COURT[1] - 0.72)).mesh(f"urn_{i + 1}")
    for i, (bay, side) in enumerate([(2, -1), (4, -1), (1, 1), (5, 1)]):
        bench = courtyard.stone_bench("stone").moved(_axes(0)[bay] + BAY / 2, GAP, side * (COURT[1] - 0.75))
        yield bench.mesh(f"bench_{i + 1}")
    yield courtyard.fountain(fine, "stone_light", "water").moved(8.2, GAP).mesh("fountain")


def _lanterns() -> Iterator[Mesh]:
    """Sixteen globes under the vaults, eight on each floor."""
    z = COURT[1] + BAY / 2
    ground = [(x, side * z) for x in (-10.8, -3.6, 3.6, 10.8) for side in (-1, 1)]
    upper = [(x, side * z) for x in (-7.2, 0.0, 7.2) for side in (-1, 1)]
    upper += [(side * (COURT[0] + BAY / 2), 0.0) for side in (-1, 1)]
    for (name, _, spring), places in zip(STOREYS, (ground, upper), strict=True):
        lantern = courtyard.lantern(LAMP_DROP, "iron", f"globe_{name}")
        for i, (x, depth) in enumerate(places):
            yield lantern.moved(x, spring + BAY / 2 - 0.01, depth).mesh(f"lantern_{name}_{i + 1}")


def _trolley(static: list[Mesh], share: float) -> Mesh:
    corners = np.concatenate([mesh.vertices for mesh in static])
    diameter = float(np.linalg.norm(np.ptp(corners, axis=0)))
    trolley = courtyard.trolley("wood", "iron", "rubber", "crate", "sackcloth", "clay", "leaf")
    x, z = TROLLEY_AT
    return trolley.scaled(share * diameter / trolley.diameter).mesh(
        "trolley", at=(x, GAP, z), degrees=-40, movable=True
    )
