# SPDX-License-Identifier: Apache-2.0
"""Lit .glb files of textured scenes: what a viewer shows of every point is texture times exposed light."""

from __future__ import annotations

import io
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import QUAD, QUAD_TRIANGLES, GltfBuilder, png
from deltalux import outputs
from deltalux.mesh.display_mesh import refine
from deltalux.outputs.of_session import baked_of
from deltalux.outputs.texture_coordinates import TextureCoordinates
from deltalux.scene import replace_scene
from deltalux.texels import srgb_to_linear
from deltalux.units import photopic
from PIL import Image
from written_results import Reader, result_for, shift

CLAMP, MIRROR, REPEAT, NEAREST = 33071, 33648, 10497, 9728
EXPOSURE = 4e-4  # irradiance is up to 900: nothing is clipped
PIXELS = np.random.default_rng(3).integers(20, 255, (4, 8, 3), dtype=np.uint8)
TRANSFORM = {"offset": [0.3, -0.2], "rotation": 0.4, "scale": [2.0, 1.5]}


def texels_at(pixels: np.ndarray, wrap: tuple[int, int], uv: np.ndarray) -> np.ndarray:
    """(n, 3) linear texels that viewers fetch without filtering."""
    index = []
    for axis, (mode, size) in enumerate(zip(wrap, pixels.shape[1::-1], strict=True)):
        at = np.floor(uv[:, axis] * size).astype(int)
        if mode == CLAMP:
            index.append(np.clip(at, 0, size - 1))
        else:
            folded = at % (2 * size)
            turned = np.where(folded < size, folded, 2 * size - 1 - folded)
            index.append(turned if mode == MIRROR else at % size)
    return srgb_to_linear(pixels[index[1], index[0]] / 255)


def transformed(uv: np.ndarray, transform: dict) -> np.ndarray:
    """KHR_texture_transform, as its specification multiplies it: translation, rotation, scale."""
    angle = transform["rotation"]
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return (uv * transform["scale"]) @ turn.T + transform["offset"]


class Viewer(Reader):
    """Shows points of a .glb as a viewer of unlit materials does."""

    def floats(self, accessor: int) -> np.ndarray:
        """(n, k) values, normalized ones in [0, 1]."""
        item = self.document.accessors[accessor]
        return self.array(accessor) / (65535.0 if item.componentType == 5123 and item.normalized else 1.0)

    def image(self, index: int) -> bytes:
        """Encoded bytes."""
        view = self.document.bufferViews[self.document.images[index].bufferView]
        return self.blob[view.byteOffset : view.byteOffset + view.byteLength]

    def primitives(self, node: str) -> list:
        return self.document.meshes[self.document.nodes[self.node(node)].mesh].primitives

    def shown(self, node: str, count: int = 40) -> SimpleNamespace:
        """Random points of each triangle: `points` in the world, `light` there, and `colour` as shown."""
        random = np.random.default_rng(11)
        world = self.world(self.node(node))
        found: dict[str, list] = {"points": [], "light": [], "colour": []}
        for primitive in self.primitives(node):
            attributes = primitive.attributes
            triangles = self.array(primitive.indices).reshape(-1, 3)
            weights = random.dirichlet(np.ones(3), (len(triangles), count))

            def at(accessor: int, triangles=triangles, weights=weights) -> np.ndarray:
                values = self.floats(accessor)[triangles]
                return np.einsum("tkw,twc->tkc", weights, values).reshape(-1, values.shape[-1])

            material = self.document.materials[primitive.material]
            base = material.pbrMetallicRoughness
            colour = at(attributes.COLOR_0)[:, :3] * base.baseColorFactor[:3]
            if base.baseColorTexture is not None:
                colour = colour * self._texels(base.baseColorTexture, at(attributes.TEXCOORD_0))
            found["points"].append(at(attributes.POSITION) @ world[:3, :3].T + world[:3, 3])
            found["light"].append(at(attributes._IRRADIANCE))
            found["colour"].append(colour)
        return SimpleNamespace(**{key: np.concatenate(parts) for key, parts in found.items()})

    def _texels(self, info, uv: np.ndarray) -> np.ndarray:
        transform = (info.extensions or {}).get("KHR_texture_transform")
        texture = self.document.textures[info.index]
        sampler = self.document.samplers[texture.sampler]
        pixels = np.asarray(Image.open(io.BytesIO(self.image(texture.source))).convert("RGB"))
        uv = uv if transform is None else transformed(uv, transform)
        return texels_at(pixels, (sampler.wrapS, sampler.wrapT), uv)


def textured(builder: GltfBuilder, *, factor=(1, 1, 1, 1), transform=None, sampler=None, **fields) -> int:
    """Append a material whose base colour is PIXELS."""
    texture = builder.texture(png(PIXELS))
    if sampler is not None:
        builder.json.setdefault("samplers", []).append(sampler)
        builder.json["textures"][texture]["sampler"] = len(builder.json["samplers"]) - 1
    info = {"index": texture}
    if transform is not None:
        builder.use("KHR_texture_transform")
        info["extensions"] = {"KHR_texture_transform": transform}
    pbr = {"baseColorFactor": list(factor), "baseColorTexture": info, "metallicFactor": 0}
    return builder.material(pbrMetallicRoughness=pbr, name="picture", **fields)


def quad(builder: GltfBuilder, material: int, uv: np.ndarray, name: str = "TEXCOORD_0") -> int:
    """Append the unit square with texture coordinates."""
    attributes = {"POSITION": builder.accessor(QUAD), name: builder.accessor(uv)}
    return builder.mesh(
        {"attributes": attributes, "indices": builder.accessor(QUAD_TRIANGLES), "material": material}
    )


UV = np.array([[0.1, 0.2], [1.9, 0.3], [1.7, 1.4], [-0.6, 1.1]], np.float32)


def uv_of(local: np.ndarray, uv: np.ndarray = UV) -> np.ndarray:
    """Coordinates at points (n, 2) of the unit square, linear in each of its two triangles."""
    x, y = local.T
    lower = uv[0] + x[:, None] * (uv[1] - uv[0]) + y[:, None] * (uv[2] - uv[1])
    upper = uv[0] + y[:, None] * (uv[3] - uv[0]) + x[:, None] * (uv[2] - uv[3])
    return np.where((x >= y)[:, None], lower, upper)


def lit(tmp_path: Path, scene: dl.Scene, poses=None, spacing: float = 0.23, light=None) -> Viewer:
    """The file for random light, or for `light` (n, 3) at the vertices."""
    display = refine(scene, spacing)
    result = result_for(*display.world(scene, poses))
    if light is not None:
        result.irradiance[:] = light
    given = outputs.Baked(result, scene, display, poses or {}, exposure=EXPOSURE)
    outputs.write(tmp_path / "lit.glb", given)
    return Viewer(tmp_path / "lit.glb")


def assert_shows(seen: SimpleNamespace, expected: np.ndarray) -> None:
    """The colours, but where rounding fetches a neighbouring texel."""
    off = np.abs(seen.colour - expected).max(axis=1) > 2e-5
    assert off.mean() < 1e-3, (off.mean(), seen.colour[off][:3], expected[off][:3])
    assert seen.colour.std() > 0.01


WRAPS = [(REPEAT, REPEAT), (CLAMP, MIRROR), (MIRROR, CLAMP)]


@pytest.mark.parametrize("transform", [None, TRANSFORM])
@pytest.mark.parametrize("wrap", WRAPS)
def test_every_point_shows_its_texel_times_its_light(tmp_path: Path, wrap, transform):
    builder, factor = GltfBuilder(), np.array([0.9, 0.5, 0.7])
    sampler = {"wrapS": wrap[0], "wrapT": wrap[1], "magFilter": NEAREST, "minFilter": NEAREST}
    material = textured(builder, factor=(*factor, 1), transform=transform, sampler=sampler)
    mesh = quad(builder, material, UV)
    builder.node(mesh=mesh, name="plain")
    builder.node(mesh=mesh, name="mirrored", scale=[-2, 1, 1], translation=[5, 0, 0])
    builder.node(mesh=mesh, name="MOVE_card", translation=[0, 0, 7])
    scene = dl.load(builder.write(tmp_path))
    viewer = lit(tmp_path, scene, {"MOVE_card": shift(1, 2, 3)})
    places = {"plain": np.eye(4), "mirrored": shift(5, 0, 0) @ np.diag([-2.0, 1, 1, 1])}
    for node, place in (places | {"MOVE_card": shift(1, 2, 3)}).items():
        seen = viewer.shown(node)
        local = (seen.points - place[:3, 3]) @ np.linalg.inv(place[:3, :3]).T
        uv = uv_of(local[:, :2])
        texels = texels_at(PIXELS, wrap, uv if transform is None else transformed(uv, transform))
        assert_shows(seen, EXPOSURE * seen.light * factor * texels)
    document = viewer.document
    assert viewer.image(0) == png(PIXELS)
    assert (len(document.images), len(document.textures), len(document.materials)) == (1, 1, 1)
    written = document.samplers[0]
    assert (written.wrapS, written.wrapT, written.magFilter, written.minFilter) == (*wrap, NEAREST, NEAREST)
    assert ("KHR_texture_transform" in document.extensionsUsed) is (transform is not None)


def test_vertices_at_one_place_keep_their_own_coordinates(tmp_path: Path):
    """Both triangles of a square have coordinates of their own along the edge that they share."""
    builder = GltfBuilder()
    uv = np.array([[0, 0], [1, 0], [1, 1], [5, 0], [4, 1], [4.25, 0]], np.float32)
    attributes = {"POSITION": builder.accessor(QUAD[QUAD_TRIANGLES]), "TEXCOORD_0": builder.accessor(uv)}
    builder.node(mesh=builder.mesh({"attributes": attributes, "material": textured(builder)}), name="card")
    viewer = lit(tmp_path, dl.load(builder.write(tmp_path)))
    seen = viewer.shown("card")
    x, y, _ = seen.points.T
    upper = uv[3] + y[:, None] * (uv[5] - uv[3]) + x[:, None] * (uv[4] - uv[5])
    at = np.where((x > y)[:, None], np.stack([x, y], axis=1), upper)
    assert_shows(seen, EXPOSURE * seen.light * texels_at(PIXELS, (REPEAT, REPEAT), at))
    (primitive,) = viewer.primitives("card")
    points = viewer.array(primitive.attributes.POSITION)
    corners = viewer.array(primitive.indices)
    assert len(np.unique(points, axis=0)) < len(points) < len(corners)  # split along the seam alone
    assert viewer.document.accessors[primitive.indices].componentType == 5123


def test_a_smooth_texture_adds_no_vertices(tmp_path: Path):
    """Triangles on both sides of an edge find the same coordinates, to the last bit."""
    x, y = np.meshgrid(np.arange(31), np.arange(31), indexing="ij")
    points = np.stack([x, y, np.sin(x + 2 * y)], axis=-1).reshape(-1, 3).astype(np.float32)
    first = (x * 31 + y)[:-1, :-1].ravel()
    corners = np.stack([first, first + 31, first + 32, first, first + 32, first + 1], axis=1).ravel()
    random = np.random.default_rng(2).uniform(-3, 3, (len(points), 2)).astype(np.float32)
    counts = []
    for uv in (random, np.full_like(random, np.nan)):  # without coordinates: as without a texture
        builder = GltfBuilder()
        attributes = {"POSITION": builder.accessor(points), "TEXCOORD_0": builder.accessor(uv)}
        indices = builder.accessor(corners.astype(np.uint16))
        mesh = {"attributes": attributes, "indices": indices, "material": textured(builder)}
        builder.node(mesh=builder.mesh(mesh), name="card", rotation=[0.1, 0.2, 0.3, 0.86**0.5])
        scene = dl.load(builder.write(tmp_path))
        scene = dl.scene.replace_scene(scene, meshes=[replace(scene.meshes[0], smooth_angle=180)])
        viewer = lit(tmp_path, scene, spacing=0.6)
        (primitive,) = viewer.primitives("card")
        counts.append(viewer.document.accessors[primitive.attributes.POSITION].count)
    assert counts[0] == counts[1] > 5000


def test_surfaces_without_coordinates_show_the_mean_colour(tmp_path: Path):
    builder = GltfBuilder()
    material = textured(builder, factor=(0.5, 1, 1, 1))
    builder.node(mesh=builder.quad(material), name="bare")
    builder.node(mesh=quad(builder, material, UV), name="card")
    scene = dl.load(builder.write(tmp_path))
    viewer = lit(tmp_path, scene)
    seen = viewer.shown("bare")
    mean = srgb_to_linear(PIXELS / 255).mean(axis=(0, 1)) * (0.5, 1, 1)
    np.testing.assert_allclose(seen.colour, EXPOSURE * seen.light * mean, atol=1e-5)
    assert viewer.primitives("bare")[0].attributes.TEXCOORD_0 is None
    assert viewer.primitives("card")[0].attributes.TEXCOORD_0 is not None


@pytest.mark.parametrize("reflectance", [(0.02, 0.3, 0.1), (0.95, 0.9, 0.01)])
def test_a_changed_reflectance_tints_the_texture(tmp_path: Path, reflectance):
    """Also beyond what a factor of at most 1 can do."""
    builder = GltfBuilder()
    builder.node(mesh=quad(builder, textured(builder), UV), name="card")
    scene = dl.load(builder.write(tmp_path))
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=0.3), paths=10, gather="off") as session:
        session.bake()
        session.set_reflectance("picture", reflectance)
        present = baked_of(session, "").scene
    viewer = lit(tmp_path, present, light=200.0)
    seen = viewer.shown("card")
    mean = present.materials[0].look.colour.mean
    texels = texels_at(PIXELS, (REPEAT, REPEAT), uv_of(seen.points[:, :2]))
    assert_shows(seen, EXPOSURE * seen.light * texels * reflectance / mean)


def test_a_texture_that_cannot_be_made_so_bright_is_left_out(tmp_path: Path):
    builder = GltfBuilder()
    builder.node(mesh=quad(builder, textured(builder), UV), name="card")
    scene = dl.load(builder.write(tmp_path))
    (material,) = scene.materials
    dark = replace(material.look.colour, mean=material.look.colour.mean / 20)
    material = replace(material, look=replace(material.look, colour=dark), reflectance=(0.1, 0.1, 0.9))
    viewer = lit(tmp_path, dl.scene.replace_scene(scene, materials=[material]))
    seen = viewer.shown("card")
    np.testing.assert_allclose(seen.colour, EXPOSURE * seen.light * (0.1, 0.1, 0.9), atol=1e-5)
    assert not viewer.document.images


@pytest.mark.parametrize(("light", "share"), [(0.5, 1), (800.0, 1), (0.01, 0.1)])
def test_luminous_materials_show_the_brighter_of_their_textures(tmp_path: Path, light: float, share: float):
    """A panel in the dark shows what glows, unless that is a small lamp; in bright light, what it carries."""
    builder = GltfBuilder()
    whole = PIXELS[::-1, ::-1].copy()
    glowing = whole if share == 1 else np.where(np.arange(8)[:, None] > 6, whole, np.uint8(0))
    pixels = whole if light < 1 and share == 1 else PIXELS
    material = textured(
        builder, emissiveFactor=[1, 1, 1], emissiveTexture={"index": builder.texture(png(glowing))}
    )
    builder.node(mesh=quad(builder, material, UV), name="panel")
    scene = dl.load(builder.write(tmp_path))
    viewer = lit(tmp_path, scene, light=light)
    seen = viewer.shown("panel")
    (panel,) = scene.materials
    mean = (panel.look.colour if pixels is PIXELS else panel.look.glow).mean
    texels = texels_at(pixels, (REPEAT, REPEAT), uv_of(seen.points[:, :2]))
    # What belongs to the other texture keeps its brightness.
    grey = np.full(3, photopic(mean))
    over = (mean, grey) if pixels is PIXELS else (grey, mean)
    total = panel.reflectance * light / over[0] + np.pi * panel.emission / over[1]
    off = np.abs(seen.colour - EXPOSURE * total * texels).max(axis=1) > 2e-5
    assert off.mean() < 1e-3
    assert (viewer.document.materials[0].pbrMetallicRoughness.baseColorFactor) == [1, 1, 1, 1]


@pytest.mark.parametrize(
    ("mode", "cutoff"), [("MASK", 0.3), ("MASK", None), ("BLEND", None), ("OPAQUE", None)]
)
def test_transparency_is_kept(tmp_path: Path, mode: str, cutoff: float | None):
    builder = GltfBuilder()
    fields = {"alphaMode": mode} | ({} if cutoff is None else {"alphaCutoff": cutoff})
    material = textured(builder, factor=(1, 1, 1, 0.6), **fields)
    builder.node(mesh=quad(builder, material, UV), name="leaf")
    (written,) = lit(tmp_path, dl.load(builder.write(tmp_path))).document.materials
    opaque = mode == "OPAQUE"
    assert written.alphaMode == mode  # pygltflib's default is glTF's
    assert written.alphaCutoff == ((cutoff or 0.5) if mode == "MASK" else None)
    assert written.pbrMetallicRoughness.baseColorFactor[3] == pytest.approx(1 if opaque else 0.6)


FORMS = {
    "bytes": (np.uint8, 255, True), "shorts": (np.uint16, 65535, True),
    "signed": (np.int16, 32767, True), "quantized": (np.int8, 1, False),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_forms_of_texture_coordinates(tmp_path: Path, form: str):
    dtype, scale, normalized = FORMS[form]
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    builder = GltfBuilder()
    builder.node(mesh=quad(builder, textured(builder), (uv * scale).astype(dtype)), name="card")
    builder.json["accessors"][1]["normalized"] = normalized
    (mesh,) = dl.load(builder.write(tmp_path)).meshes
    np.testing.assert_array_equal(mesh.coordinates, uv[QUAD_TRIANGLES].reshape(2, 3, 2))


@pytest.mark.parametrize("by_transform", [False, True])
def test_the_set_that_the_texture_names(tmp_path: Path, by_transform: bool):
    builder = GltfBuilder()
    material = textured(builder, transform={"texCoord": 3} if by_transform else None)
    if not by_transform:
        info = builder.json["materials"][material]["pbrMetallicRoughness"]["baseColorTexture"]
        info["texCoord"] = 3
    mesh = quad(builder, material, UV, "TEXCOORD_3")
    builder.json["meshes"][mesh]["primitives"][0]["attributes"]["TEXCOORD_0"] = builder.accessor(UV * 0)
    builder.node(mesh=mesh, name="card")
    scene = dl.load(builder.write(tmp_path))
    np.testing.assert_array_equal(scene.meshes[0].coordinates, UV[QUAD_TRIANGLES].reshape(2, 3, 2))
    written = lit(tmp_path, scene).document.materials[0].pbrMetallicRoughness.baseColorTexture
    assert written.texCoord in (None, 0)
    assert not written.extensions


def test_instances_share_their_coordinates(tmp_path: Path):
    builder = GltfBuilder()
    mesh = quad(builder, textured(builder), UV)
    for i in range(3):
        builder.node(mesh=mesh, name=f"card{i}", scale=[1, 1 - 2 * (i == 2), 1])
    one, two, mirrored = (m.coordinates for m in dl.load(builder.write(tmp_path)).meshes)
    assert np.shares_memory(one, two)
    assert np.shares_memory(one, mirrored)
    assert not one.flags.writeable
    given = np.zeros((2, 3, 2), np.float32)
    kept = dl.Mesh("m", QUAD, QUAD_TRIANGLES.reshape(-1, 3), coordinates=given).coordinates
    given[:] = 5
    assert (kept == 0).all()
    for odd in (given[:1], np.full((2, 3, 2), np.inf)):
        with pytest.raises(
            dl.SceneError, match=r'mesh "m": coordinates: found shape .*, expected \(2, 3, 2\)'
        ):
            dl.Mesh("m", QUAD, QUAD_TRIANGLES.reshape(-1, 3), coordinates=odd)


def test_triangles_without_area_show_their_first_corner(tmp_path: Path):
    builder = GltfBuilder()
    builder.node(mesh=quad(builder, textured(builder), UV), name="card")
    scene = dl.load(builder.write(tmp_path))
    display = refine(scene, 0.5)
    tiny = replace(scene.meshes[0], vertices=scene.meshes[0].vertices * 1e-300)
    found = TextureCoordinates(replace_scene(scene, meshes=[tiny]), display)
    with np.errstate(all="raise", under="ignore"):
        coordinates = found.of(np.arange(len(display.triangles)))
    first = tiny.coordinates[display.source_triangle][:, :1]
    np.testing.assert_array_equal(coordinates, np.repeat(first, 3, axis=1))


def test_coordinates_of_other_vertices_are_refused(tmp_path: Path):
    builder = GltfBuilder()
    builder.node(mesh=quad(builder, textured(builder), UV[:3]), name="card")
    with pytest.raises(
        dl.FormatError, match=r"accessors\[1\]: found 3 elements, expected one for each of 4 vert"
    ):
        dl.load(builder.write(tmp_path))


def test_webp_images_say_so(tmp_path: Path):
    stream = io.BytesIO()
    Image.fromarray(PIXELS).save(stream, "WEBP", lossless=True)
    builder = GltfBuilder()
    material = textured(builder)
    source = builder.json["textures"][builder.texture(stream.getvalue())].pop("source")
    builder.json["textures"][0]["extensions"] = {"EXT_texture_webp": {"source": source}}
    builder.use("EXT_texture_webp")
    builder.json["textures"].pop()
    builder.node(mesh=quad(builder, material, UV), name="card")
    viewer = lit(tmp_path, dl.load(builder.write(tmp_path)))
    document = viewer.document
    assert (document.images[0].mimeType, viewer.image(0)) == ("image/webp", stream.getvalue())
    assert document.textures[0].extensions == {"EXT_texture_webp": {"source": 0}}
    assert document.extensionsRequired == ["EXT_texture_webp"]


OBJ = (
    "mtllib s.mtl\nvt 0.1 0.2\nvt 1.9 0.3\nvt 1.7 1.4\nvt -0.6 1.1\n"
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no card\n"
)


@pytest.mark.parametrize(
    ("options", "scale", "offset", "wrap"),
    [("", (1, 1), (0, 0), REPEAT), ("-s 3 2 1 -o 0.25 0.5 -clamp on", (3, 2), (0.25, 0.5), CLAMP)],
)
def test_obj(tmp_path: Path, options, scale, offset, wrap):
    """OBJ counts v from the image's lower edge."""
    (tmp_path / "p.png").write_bytes(png(PIXELS))
    (tmp_path / "s.mtl").write_text(f"newmtl m\nKd 0.5 0.5 0.5\nmap_Kd {options} p.png\n")
    (tmp_path / "s.obj").write_text(OBJ + "usemtl m\nf 1/1 2/2 3/-2 4/4\no bare\nusemtl m\nf 1 2 3\n")
    viewer = lit(tmp_path, dl.load(tmp_path / "s.obj"))
    seen = viewer.shown("card")
    # The fan's second triangle is that of the unit square.
    uv = uv_of(seen.points[:, :2]) * scale + offset
    texels = texels_at(PIXELS, (wrap, wrap), np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1))
    assert_shows(seen, 0.5 * EXPOSURE * seen.light * texels)
    assert viewer.primitives("bare")[0].attributes.TEXCOORD_0 is None


def test_obj_faces_with_odd_coordinates_are_plain(tmp_path: Path):
    (tmp_path / "p.png").write_bytes(png(PIXELS))
    (tmp_path / "s.mtl").write_text("newmtl m\nmap_Kd -s x -o 1e99 nan p.png\n")
    faces = "f 1/9 2/1 3/1\nf 1/x 2/1 3/1\nf 1/1 2/1 3\nf 1/1 2/5 3/1\nf 1/1 2/2 3/3\n"
    (tmp_path / "s.obj").write_text(OBJ + "vt a b\nusemtl m\n" + faces)
    (mesh,) = dl.load(tmp_path / "s.obj").meshes
    assert np.isfinite(mesh.coordinates).all(axis=(1, 2)).tolist() == [False] * 4 + [True]


# ---- sessions ----------------------------------------------------------------------------------


def textured_scene(tmp_path: Path) -> dl.Scene:
    builder = GltfBuilder()
    sampler = {"wrapS": CLAMP, "wrapT": MIRROR, "magFilter": NEAREST}
    material = textured(builder, transform=TRANSFORM, sampler=sampler, alphaMode="MASK", alphaCutoff=0.25)
    builder.json["textures"].append({"source": 0})
    glow = builder.material(emissiveFactor=[9, 9, 9], emissiveTexture={"index": 1})
    builder.node(mesh=quad(builder, material, UV), name="card")
    builder.node(mesh=quad(builder, glow, UV), name="lamp", rotation=[0, 1, 0, 0], translation=[1, 0, 1])
    builder.node(mesh=builder.quad(), name="MOVE_bare", translation=[0, 0, 0.5])
    return dl.load(builder.write(tmp_path))


def test_sessions_keep_textures(tmp_path: Path):
    """An opened session writes the same files as the one that was saved, and has its digest."""
    scene = textured_scene(tmp_path)
    samples = dl.Samples.on_vertices(scene, spacing=0.3)
    with dl.Session(scene, samples, paths=500, threads=1) as session:
        session.bake()
        expected = session.digest()
        outputs.write(tmp_path / "a.glb", baked_of(session, "x"))
        session.save(tmp_path / "a.dlx")
    with dl.Session.open(tmp_path / "a.dlx", threads=1) as opened:
        assert opened.digest() == expected
        outputs.write(tmp_path / "b.glb", baked_of(opened, "x"))
        opened.save(tmp_path / "b.dlx")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    assert (tmp_path / "a.dlx").read_bytes() == (tmp_path / "b.dlx").read_bytes()
    document = Viewer(tmp_path / "b.glb").document
    assert (len(document.images), len(document.textures)) == (1, 2)  # one image with two samplers
    with zipfile.ZipFile(tmp_path / "a.dlx") as archive:
        held = b"".join(archive.read(name) for name in archive.namelist())
    assert held.count(png(PIXELS)) == 1
