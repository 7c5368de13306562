# SPDX-License-Identifier: Apache-2.0
"""KHR_lights_punctual, light units, groups, plausibility, and cameras."""

import math

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import GltfBuilder
from deltalux.scene.adding import NO_LIGHT

HALF = math.sqrt(0.5)
DOWN = [-HALF, 0, 0, HALF]  # turns -Z to -Y


def scene_with(tmp_path, *, light_units="spec", generator=None, node=None, **light):
    builder = GltfBuilder()
    if generator:
        builder.json["asset"]["generator"] = generator
    builder.node(mesh=builder.quad(builder.material(colour=(0.5, 0.5, 0.5))), name="floor")
    builder.node(**({"name": "lamp", "extensions": builder.light(**light)} | (node or {})))
    return dl.load(builder.write(tmp_path), light_units=light_units)


def test_point_light(tmp_path):
    node = {"translation": [1, 2, 3], "scale": [5, 5, 5]}  # scale changes no intensity
    scene = scene_with(tmp_path, type="point", color=[1, 0.5, 0], intensity=40, node=node)
    (light,) = scene.lights
    assert isinstance(light, dl.PointLight)
    assert light.name == "lamp"
    assert light.group is None
    np.testing.assert_array_equal(light.position, (1, 2, 3))
    np.testing.assert_array_equal(light.intensity, (40, 20, 0))
    assert scene.unit == "lux"


def test_spot_light_shines_along_minus_z_of_its_node(tmp_path):
    spot = {"innerConeAngle": 0.2, "outerConeAngle": 0.5}
    node = {"rotation": DOWN, "scale": [1, 2, -3]}
    (light,) = scene_with(tmp_path, type="spot", intensity=100, spot=spot, node={"rotation": DOWN}).lights
    assert isinstance(light, dl.SpotLight)
    np.testing.assert_allclose(light.direction, (0, -1, 0), atol=1e-12)
    np.testing.assert_array_equal(light.intensity, (100, 100, 100))
    assert (light.inner_angle, light.outer_angle) == (0.2, 0.5)
    (light,) = scene_with(tmp_path, type="spot", intensity=100, spot=spot, node=node).lights
    np.testing.assert_allclose(light.direction, (0, 1, 0), atol=1e-12)  # mirrored along its axis


def test_spot_defaults_and_hard_edge(tmp_path):
    (light,) = scene_with(tmp_path, type="spot", intensity=100).lights
    assert (light.inner_angle, light.outer_angle) == (0.0, math.pi / 4)
    hard = {"innerConeAngle": 0.5, "outerConeAngle": 0.5}
    scene = scene_with(tmp_path, type="spot", intensity=100, spot=hard)
    assert 0.499 < scene.lights[0].inner_angle < scene.lights[0].outer_angle == 0.5
    assert "spot cones without a soft edge are given one of 0.1 % (lamp)" in scene.warnings


def test_directional_light(tmp_path):
    (light,) = scene_with(tmp_path, type="directional", intensity=2000, node={"rotation": DOWN}).lights
    assert isinstance(light, dl.SunLight)
    np.testing.assert_allclose(light.direction, (0, -1, 0), atol=1e-12)
    np.testing.assert_array_equal(light.irradiance, (2000, 2000, 2000))


def test_intensity_defaults_to_one_and_range_is_not_honoured(tmp_path):
    scene = scene_with(tmp_path, type="point", range=4)
    np.testing.assert_array_equal(scene.lights[0].intensity, (1, 1, 1))
    assert "the range of lights is not honoured (lamp)" in scene.warnings


@pytest.mark.parametrize("value", [0, -1])
def test_a_range_that_is_not_positive_is_refused(tmp_path, value):
    text = rf'light "lamp": range: found {value}.0, expected a number above 0, or none at all'
    with pytest.raises(dl.FormatError, match=text):
        scene_with(tmp_path, type="point", range=value)


@pytest.mark.parametrize(
    ("light_units", "point", "sun", "unit"),
    [
        ("spec", 100.0, 100.0, "lux"),
        ("blender-watts", 100 / (4 * math.pi), 100.0, "W/m2"),
        ("unitless", 100.0, 100.0, "W/m2"),
    ],
)
@pytest.mark.parametrize("kind", ["point", "spot", "directional"])
def test_light_units(tmp_path, kind, light_units, point, sun, unit):
    scene = scene_with(tmp_path, type=kind, intensity=100, light_units=light_units)
    (light,) = scene.lights
    value = light.irradiance if kind == "directional" else light.intensity
    np.testing.assert_allclose(value, [sun if kind == "directional" else point] * 3)
    assert scene.unit == unit


def test_light_units_must_be_known(tmp_path):
    with pytest.raises(
        dl.OptionError, match="light_units: found 'lumen', expected one of spec, blender-watts"
    ):
        scene_with(tmp_path, type="point", light_units="lumen")


@pytest.mark.parametrize(
    ("kind", "intensity", "message"),
    [
        ("point", 0.5, "lamps outside 10 to 1e+06 lm"),
        ("point", 1e6, "lamps outside 10 to 1e+06 lm"),
        ("point", 100, None),
        ("directional", 0.01, "suns outside 0.1 to 200,000 lx"),
        ("directional", 1e6, "suns outside 0.1 to 200,000 lx"),
        ("directional", 1e5, None),
    ],
)
def test_plausibility(tmp_path, kind, intensity, message):
    warnings = scene_with(tmp_path, type=kind, intensity=intensity).warnings
    assert [w.split(":")[0] for w in warnings if "outside" in w] == ([message] if message else [])
    radiometric = scene_with(tmp_path, type=kind, intensity=intensity, light_units="unitless")
    assert not [w for w in radiometric.warnings if "outside" in w]


@pytest.mark.parametrize(("strength", "warned"), [(1.0, True), (100.0, False), (1e7, True)])
def test_plausibility_of_luminous_surfaces(tmp_path, strength, warned):
    builder = GltfBuilder()
    extension = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
    builder.node(mesh=builder.quad(builder.material(emissiveFactor=[1, 1, 1], extensions=extension)))
    warnings = dl.load(builder.write(tmp_path)).warnings
    assert any(w.startswith("luminous surfaces outside") for w in warnings) is warned


@pytest.mark.parametrize(
    ("generator", "warned"),
    [
        ("Khronos glTF Blender I/O v3.3.32", True),
        ("Khronos glTF Blender I/O v3.4.38", True),
        ("Khronos Blender glTF 2.0 I/O", True),
        ("Khronos glTF Blender I/O v3.4.39", False),
        ("Khronos glTF Blender I/O v4.1.62", False),
        ("other 1.0", False),
    ],
)
def test_old_blender_exporters_are_named(tmp_path, generator, warned):
    scene = scene_with(tmp_path, type="point", intensity=100, generator=generator)
    assert any("try --light-units blender-watts" in w for w in scene.warnings) is warned


def test_a_light_on_two_nodes_is_two_lights(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad())
    extensions = builder.light(type="point", intensity=50, name="bulb")
    for x in (1, 2):
        builder.node(name="lamp", extensions=extensions, translation=[x, 0, 0])
    builder.node(extensions=extensions)
    scene = dl.load(builder.write(tmp_path))
    assert [light.name for light in scene.lights] == ["lamp", "lamp#2", "bulb"]
    assert scene.groups == ("lamp", "lamp#2", "bulb")
    assert dl.load(tmp_path / "scene.glb", groups="name").groups == ("lamp", "bulb")


def test_groups(tmp_path):
    """The node's extras.group, inherited, comes before the light's or material's, then the node's name."""
    builder = GltfBuilder()
    extras = {"extras": {"group": "of the thing"}}
    glow = builder.material(name="glow", emissiveFactor=[9, 9, 9], **extras)
    plain = builder.material(name="plain", emissiveFactor=[9, 9, 9])
    point = builder.light(type="point", intensity=9, **extras)
    inside = [
        builder.node(root=False, name="quad", mesh=builder.quad(glow)),
        builder.node(root=False, name="point", extensions=point),
    ]
    builder.node(name="all", extras={"group": "of the node"}, children=inside)
    builder.node(name="quad", mesh=builder.quad(glow))
    builder.node(name="point", extensions=point)
    builder.node(name="bare", mesh=builder.quad(plain))
    builder.node(name="bare", mesh=builder.quad(plain))
    scene = dl.load(builder.write(tmp_path))
    group = {m.name: m.group for m in scene.materials}
    by_mesh = {m.name: [group[name] or m.name for name in m.material] for m in scene.meshes}
    assert by_mesh == {
        "quad": ["of the node"],
        "quad#2": ["of the thing"],
        "bare": ["bare"],
        "bare#2": ["bare#2"],
    }
    assert [light.group for light in scene.lights] == ["of the node", "of the thing"]
    assert set(scene.groups) == {"of the node", "of the thing", "bare", "bare#2"}
    assert set(dl.load(tmp_path / "scene.glb", groups="name").groups) == {
        "of the node",
        "of the thing",
        "bare",
    }


def lamps(builder, count):
    """Panels of one name and material, each with a point light of that name below it."""
    glow = builder.material(name="glow", emissiveFactor=[9, 9, 9])
    quad, point = builder.quad(glow), builder.light(type="point", intensity=9)
    for x in range(count):
        inner = builder.node(root=False, name="bulb", extensions=point)
        builder.node(name="panel", mesh=quad, translation=[2 * x, 0, 0], children=[inner])
    return builder


@pytest.mark.parametrize("count", [1, 4])
def test_lamps_of_one_name_are_groups_of_their_own(tmp_path, count):
    scene = dl.load(lamps(GltfBuilder(), count).write(tmp_path))
    numbered = ["", "#2", "#3", "#4"][:count]
    assert set(scene.groups) == {f"{name}{n}" for name in ("panel", "bulb") for n in numbered}
    assert [m.name for m in scene.materials] == ["glow"]  # one material in four groups, by the meshes' names
    assert not [w for w in scene.warnings if "light groups" in w]


def test_more_lamps_than_groups_with_sums_share_by_name(tmp_path):
    path = lamps(GltfBuilder(), 5).write(tmp_path)
    scene = dl.load(path)
    assert scene.groups == ("bulb", "panel")
    (told,) = (w for w in scene.warnings if "light groups" in w)
    assert told.startswith("10 lamps, more than the 8 light groups that are dimmed at once: those of one")
    apart = dl.load(path, groups="lamp")
    assert len(apart.groups) == 10
    assert not [w for w in apart.warnings if "light groups" in w]
    assert [m.name for m in apart.meshes] == [m.name for m in scene.meshes]
    assert [light.name for light in apart.lights] == [light.name for light in scene.lights]
    with pytest.raises(dl.OptionError, match="groups: found 'none', expected one of lamp, name, auto"):
        dl.load(path, groups="none")


def test_groups_by_name_leave_nothing_of_a_look_for_groups_by_lamp(tmp_path):
    builder = lamps(GltfBuilder(), 5)
    other = builder.material(name="other", emissiveFactor=[3, 3, 3])
    builder.node(name="panel", mesh=builder.quad(other), translation=[20, 0, 0])
    path = builder.write(tmp_path)
    found, by_name = dl.load(path), dl.load(path, groups="name")
    assert len(found.groups) == 2
    assert [(m.name, m.group) for m in found.materials] == [(m.name, m.group) for m in by_name.materials]


def test_many_lamps_with_names_of_their_own_stay_apart(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad())
    point = builder.light(type="point", intensity=9)
    for k in range(10):
        builder.node(name=f"lamp {k}", extensions=point)
    scene = dl.load(builder.write(tmp_path))
    assert len(scene.groups) == 10
    assert not [w for w in scene.warnings if "light groups" in w]


def test_a_dark_material_is_not_split_by_groups(tmp_path):
    builder = GltfBuilder()
    grey = builder.material(name="grey", colour=(0.5, 0.5, 0.5))
    for group in ("a", "b"):
        builder.node(mesh=builder.quad(grey), extras={"group": group})
    assert [m.name for m in dl.load(builder.write(tmp_path)).materials] == ["grey"]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"type": "area"}, "light \"lamp\": type: found 'area', expected point, spot or directional"),
        ({"type": "point", "intensity": -1}, "expected no negative channel"),
        (
            {"type": "spot", "spot": {"innerConeAngle": 1, "outerConeAngle": 0.5}},
            "0 <= inner < outer <= pi/2",
        ),
        ({"type": "spot", "spot": {"outerConeAngle": 3}}, "0 <= inner < outer <= pi/2"),
        ({"type": "spot", "node": {"scale": [0, 0, 0]}}, "a node whose scale leaves no direction"),
    ],
)
def test_bad_lights_are_refused(tmp_path, fields, message):
    with pytest.raises(dl.FormatError) as error:
        scene_with(tmp_path, **fields)
    assert message in str(error.value)


def test_no_light_is_told(tmp_path):
    builder = GltfBuilder()
    builder.node(mesh=builder.quad())
    warnings = dl.load(builder.write(tmp_path)).warnings
    assert NO_LIGHT in warnings
