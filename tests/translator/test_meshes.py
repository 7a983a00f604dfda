"""OBJ and MTL files through the translator: materials, colours, transforms, readers, errors."""

import math

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from relume.translator.diagnostics import SceneError
from relume.translator.scene_values import to_mitsuba

QUAD = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
FACE = "f 1/1 2/2 3/3 4/4\n"
OBJECT = "OBJECT\nobjfile m.obj\ncolor 0.5 0.25 0.125\nspecular 0.3 0.3 0.3\n"


@pytest.fixture
def write(tmp_path):
    """Write the files m.obj and m.mtl of a test."""

    def files(obj, mtl=None):
        head = "mtllib m.mtl\n" if mtl is not None else ""
        (tmp_path / "m.obj").write_text(head + obj)
        if mtl is not None:
            (tmp_path / "m.mtl").write_text(mtl)

    return files


@pytest.fixture
def parts(translated, write):
    """The shapes' dictionaries of an object `m.obj` with one quad of the material `m`."""

    def run(mtl, lines="reflection diffuse\n", obj=f"{QUAD}usemtl m\n{FACE}", dialect="manual"):
        write(obj, mtl)
        scene = translated(OBJECT + lines, dialect).scene
        return [e for name, e in scene.items() if name.startswith("object")]

    return run


def rgb(*values):
    return {"type": "rgb", "value": [pytest.approx(x) for x in values]}


def test_groups(parts):
    """One mesh per material; faces without a known one keep the object's attributes."""
    obj = f"{QUAD}{FACE}usemtl red\n{FACE}usemtl NONE\n{FACE}usemtl RED\n{FACE}"
    plain, red, unknown = parts("newmtl Red\nKd 1 0 0\n", obj=obj)
    assert [len(p["mesh"].faces) for p in (plain, red, unknown)] == [2, 4, 2]
    colors = [p["bsdf"]["bsdf"]["reflectance"] for p in (plain, red, unknown)]
    assert colors == [rgb(0.5, 0.25, 0.125), rgb(1, 0, 0), rgb(0.5, 0.25, 0.125)]


MATERIAL = "newmtl m\nKd 0.8 0.4 0.2\nKs 0.1 0.2 0.3\n"
WARD = {"type": "ward", "tangent_frame": "world", "alpha_u": 0.05, "alpha_v": 0.2}
KD, KS = rgb(0.8, 0.4, 0.2), rgb(0.1, 0.2, 0.3)
SHARE = 0.84 / (0.84 + 0.14)  # |Kd|² / (|Kd|² + |Ks|²)
GLASS = {"type": "schlickglass", "ext_ior": 1.0}


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        # k = 0 and 1: colour Kd and Ks; without #ROUGHNESS the share is that of Kd
        (
            "#REFLECTION 0\n#ROUGHNESS 1\n",
            {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": KD}},
        ),
        (
            "#REFLECTION 1\nKd 0 0 0\n",
            {
                "type": "twosided",
                "bsdf": {"type": "conductor", "material": "none", "specular_reflectance": KS},
            },
        ),
        (
            "#REFLECTION 1\n",
            {
                "type": "twosided",
                "bsdf": {
                    "type": "blendbsdf",
                    "weight": pytest.approx(SHARE),
                    "bsdf_0": {
                        "type": "conductor",
                        "material": "none",
                        "specular_reflectance": KS,
                    },
                    "bsdf_1": {"type": "diffuse", "reflectance": KS},
                },
            },
        ),
        # k = 2: colour Ks, index Ni, and the program's 0 (1.5) where it is missing
        (
            "#REFLECTION 2\nNi 1.8\n",
            GLASS | {"int_ior": 1.8, "specular_reflectance": KS, "specular_transmittance": KS},
        ),
        (
            "#REFLECTION 2\n",
            GLASS | {"int_ior": 1.5, "specular_reflectance": KS, "specular_transmittance": KS},
        ),
        # k = 3: Kd, Ks and #WARD
        (
            "#REFLECTION 3\n#WARD 0.05 0.2\n",
            {
                "type": "twosided",
                "bsdf": WARD | {"diffuse_reflectance": KD, "specular_reflectance": KS},
            },
        ),
        # k = 4: Kd, Ks and Ns, 5 where it is missing
        (
            "#REFLECTION 4\nNs 40\n",
            {
                "type": "twosided",
                "bsdf": {
                    "type": "phong",
                    "diffuse_reflectance": KD,
                    "specular_reflectance": KS,
                    "exponent": 40,
                },
            },
        ),
        (
            "#REFLECTION 4\n#COLOR 0 0 1\n#SPECULAR 1 0 0\n",
            {
                "type": "twosided",
                "bsdf": {
                    "type": "phong",
                    "diffuse_reflectance": rgb(0, 0, 1),
                    "specular_reflectance": rgb(1, 0, 0),
                    "exponent": 5,
                },
            },
        ),
    ],
)
def test_reflection_kinds(parts, keys, expected):
    """#REFLECTION sets the kind of surface and takes all its parameters from the MTL (12.2)."""
    (part,) = parts(MATERIAL + keys, lines="reflection reflection\nrefractive_index 1.3\n")
    assert part["bsdf"] == expected


def test_material_without_reflection_keeps_the_kind(parts):
    """Only the colours come from the MTL: for Ward both, scaled by rho_d and rho_s."""
    (part,) = parts(MATERIAL, lines="reflection ward_brdf\nward_brdf 0.5 0.25 0.05 0.2\n")
    lobes = {
        "diffuse_reflectance": rgb(0.4, 0.2, 0.1),
        "specular_reflectance": rgb(0.025, 0.05, 0.075),
    }
    assert part["bsdf"]["bsdf"] == WARD | lobes


def test_emission(parts):
    """#EMISSION counts with #REFLECTION alone; otherwise the object's holds."""
    keys = "#REFLECTION 0\n#EMISSION 1 2 3\n"
    (part,) = parts(MATERIAL + keys, lines="reflection diffuse\nemission 9 9 9\n")
    assert part["emitter"]["radiance"] == rgb(1, 2, 3)
    (part,) = parts(MATERIAL + "#EMISSION 1 2 3\n", lines="reflection diffuse\nemission 9 9 9\n")
    assert part["emitter"]["radiance"] == rgb(9, 9, 9)


@pytest.mark.parametrize(("keys", "opacity"), [("d 0.25\n", 0.25), ("Tr 0.25\n", 0.75), ("", None)])
def test_constant_alpha(parts, keys, opacity):
    """d is opacity, Tr transparency."""
    (part,) = parts(MATERIAL + keys)
    assert part["bsdf"].get("opacity") == opacity


def test_map_kd(parts, write_picture):
    """map_Kd: the object's colour times the texel, Kd is not used; its alpha replaces d."""
    pixels = np.full((3, 3, 4), (100, 200, 50, 51))
    write_picture("a.png", pixels)
    (part,) = parts(MATERIAL + "d 0.5\nmap_Kd a.png\n")
    assert part["bsdf"]["type"] == "mask"
    assert np.allclose(part["bsdf"]["opacity"]["picture"].pixels, 0.2)
    texels = part["bsdf"]["bsdf"]["bsdf"]["reflectance"]["picture"].pixels
    assert np.allclose(texels, np.array([100, 200, 50]) / 255 * [0.5, 0.25, 0.125])


@pytest.mark.parametrize("shown", ["", "d 0.5\n"])
def test_an_objects_texture_takes_precedence_over_map_kd(parts, write_picture, shown):
    """Row texture-over-map: the object's own texel, not its colour times that of map_Kd; the
    picture's alpha, not `d`, says where it is."""
    write_picture("a.png", np.full((2, 2, 3), 200))
    write_picture("b.png", np.full((2, 2, 3), 100))
    lines = "reflection diffuse\ncolor 0.5 0.5 0.5\ntexture b.png\n"
    (part,) = parts(MATERIAL + shown + "map_Kd a.png\n", lines)
    bsdf = part["bsdf"]
    assert bsdf["type"] == "twosided"
    texels = np.asarray(bsdf["bsdf"]["reflectance"]["picture"].pixels)
    np.testing.assert_allclose(texels, 100 / 255, rtol=1e-6)



def test_missing_map_is_noted(translated, write):
    """A missing picture of an MTL file does not stop the scene; the object's colour stays."""
    write(f"{QUAD}usemtl m\n{FACE}", "newmtl m\nmap_Kd gone.png\nmap_Bump lost.png\n")
    translation = translated(OBJECT + "reflection diffuse\n")
    notes = [r.note for r in translation.document.lines.all if r.outcome == "approximated"]
    assert len(notes) == 1
    assert "no such file 'gone.png' for map_Kd" in notes[0]
    assert "no such file 'lost.png' for map_Bump" in notes[0]


def center(load, text, target=(0, 0, 0)):
    """Lambert's colour of what is seen from +Z at the middle of a mesh, (3,)."""
    scene = load(text)
    origin = mi.Point3f(target[0], target[1], 9)
    si = scene.ray_intersect(mi.Ray3f(origin, mi.Vector3f(0, 0, -1)))
    value = np.array(si.bsdf().eval(mi.BSDFContext(), si, si.wi)).ravel()
    return value * math.pi / float(si.wi.z[0])


COLORED = "v -1 -1 0 1 0 0\nv 1 -1 0 0 1 0\nv 1 1 0 0 0 1\nv -1 1 0 1 1 1\nf 1 2 3\nf 1 3 4\n"


@pytest.mark.parametrize(
    ("lines", "factor"),
    [
        ("reflection diffuse\n", 1),
        # rho_d scales vertex colours like any other; the specular part is black here
        ("specular 0 0 0\nreflection ward_brdf\nward_brdf 0.5 1 0.1 0.1\n", 0.5),
    ],
)
def test_vertex_colors(load, write, lines, factor):
    """The interpolated colour replaces `color`; in the first triangle a third of each corner."""
    write(COLORED)
    found = center(load, OBJECT + lines, (1 / 3, -1 / 3))
    assert np.allclose(found, np.full(3, factor / 3), atol=1e-4)


def test_material_colors_come_before_vertex_colors(load, write):
    """A Kd beats the colours of the vertices."""
    write(COLORED.replace("f 1", "usemtl m\nf 1", 1), "newmtl m\nKd 0.1 0.2 0.3\n")
    assert np.allclose(center(load, OBJECT + "reflection diffuse\n"), [0.1, 0.2, 0.3], atol=1e-5)


SLOPED = f"{QUAD}vn 0.6 0 0.8\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"
MIRRORING = "scale -1 1 1\n"


@pytest.mark.parametrize("reader", ["stock", "own"])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("smooth", [False, True])
def test_normals(load, write, reader, turned, mirrored, smooth):
    """normal -1 turns normals round, a mirroring scale only reflects them.

    Faces are shaded with the normals of the file, which are the same at all corners here, whether
    they are smooth or not.
    """
    write(SLOPED if reader == "stock" else "usemtl m\n" + SLOPED)
    lines = "reflection diffuse\n" + f"smooth {int(smooth)}\n"
    lines += MIRRORING * mirrored + "normal -1\n" * turned
    scene = load(OBJECT + lines)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(0.3, 0.2, 9), mi.Vector3f(0, 0, -1)))
    expected = np.array([0.6 if not mirrored else -0.6, 0, 0.8])
    sign = -1 if turned else 1
    assert np.allclose(np.array(si.sh_frame.n).ravel(), sign * expected, atol=1e-5)
    assert np.allclose(np.array(si.n).ravel(), [0, 0, sign], atol=1e-5)


def test_transforms(translated, write):
    """scale, rotation, translate in file order about the origin: x -> 2 x, to +Y, up by 5."""
    write(f"usemtl m\n{QUAD}{FACE}")
    lines = "reflection diffuse\nscale 2 1 1\nrotation 0 0 90\ntranslate 0 0 5\n"
    scene = translated(OBJECT + lines).scene
    (mesh,) = (e["mesh"] for e in scene.values() if "mesh" in e)
    assert np.allclose(mesh.vertices, [[1, -2, 5], [1, 2, 5], [-1, 2, 5], [-1, -2, 5]])


def torus(rows=24, columns=40, normals=True):
    """OBJ text of a torus of triangles with texture coordinates, and with normals."""
    lines = []
    for i in range(rows):
        for j in range(columns):
            a, b = 2 * math.pi * i / rows, 2 * math.pi * j / columns
            n = math.cos(a) * math.cos(b), math.sin(a), math.cos(a) * math.sin(b)
            p = [math.cos(b) + 0.4 * n[0], 0.4 * n[1], math.sin(b) + 0.4 * n[2]]
            lines.append("v {:.6f} {:.6f} {:.6f}".format(*p))
            if normals:
                lines.append("vn {:.6f} {:.6f} {:.6f}".format(*n))
            lines.append(f"vt {j / columns:.6f} {i / rows:.6f}")
    for i in range(rows):
        for j in range(columns):
            k, m = i, (i + 1) % rows
            f, g = j, (j + 1) % columns
            quad = [r * columns + c + 1 for r, c in ((k, f), (m, f), (m, g), (k, g))]
            form = "{0}/{0}/{0}" if normals else "{0}/{0}"
            for corners in (quad[:3], [quad[0], *quad[2:]]):
                lines.append("f " + " ".join(form.format(x) for x in corners))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("smooth", [0, 1])
def test_both_readers_give_one_picture(load, view, write, translated, write_picture, smooth):
    """A plain file takes Mitsuba's reader, the same with `usemtl` our own: equal pictures.

    Flat faces have no normals in the file: those would shade them.

    The same paths are traced; a ray in ten thousand may take the other side of an edge, where the
    two readers round a vertex differently.
    """
    write_picture("a.png", np.random.default_rng(1).integers(0, 255, (6, 9, 3)))
    text = view((1, 2.5, 2), (0, 0, 0), width=1, size=(48, 48)) + "BACKGROUND\n1 1 1\n\n" + OBJECT
    text += f"reflection diffuse\ntexture a.png\nsmooth {smooth}\nscale 1 1.2 0.9\n"
    pictures, kinds = [], []
    for head in ("", "usemtl none\n"):
        write(head + torus(normals=smooth == 1))
        kinds += [e["type"] for e in translated(text).scene.values() if isinstance(e, dict)]
        pictures.append(np.array(mi.render(load(text), spp=16, seed=1)))
    assert "obj" in kinds
    assert "mesh" in kinds
    different = np.abs(pictures[0] - pictures[1]).max(axis=2) > 1e-3
    assert different.mean() < 0.01
    assert abs(np.mean(pictures[0]) - np.mean(pictures[1])) < 1e-3


def test_several_libraries_and_odd_names(translated, write, write_picture, tmp_path):
    """All files of an `mtllib` line are read, names with blanks and comments are understood."""
    (tmp_path / "a.mtl").write_text("newmtl red # the first\nKd 1 0 0\n")
    (tmp_path / "the other.mtl").write_text("newmtl wood\nmap_Kd my\\ wood.png # oak\n")
    write_picture("my wood.png", np.full((2, 2, 3), 51))
    faces = f"usemtl red\n{FACE}usemtl wood # 2\n{FACE}usemtl none\n{FACE}"
    write(f"mtllib a.mtl the\\ other.mtl absent.mtl # all\n{QUAD}{faces}")
    result = translated(OBJECT + "reflection diffuse\n")
    red, wood, none = [e for name, e in result.scene.items() if name.startswith("object")]
    assert red["bsdf"]["bsdf"]["reflectance"] == rgb(1, 0, 0)
    assert wood["bsdf"]["bsdf"]["reflectance"]["type"] == "bitmap"
    assert none["bsdf"]["bsdf"]["reflectance"] == rgb(0.5, 0.25, 0.125)
    notes = result.document.objects[0].lines.all[0].note
    assert "m.obj:1: no such file 'absent.mtl'" in notes
    assert "m.obj: no MTL file defines 'none'" in notes


def test_options_of_a_picture(parts, write_picture):
    """`-clamp on` lets the edge go on, `-mm base gain` is base + gain x."""
    write_picture("a.png", np.full((3, 3, 3), 102))
    (part,) = parts("newmtl m\nmap_Kd -clamp on -mm 0.1 0.5 a.png\n", lines="color 1 1 1\n")
    picture = part["bsdf"]["bsdf"]["reflectance"]
    assert picture["wrap_mode"] == "clamp"
    np.testing.assert_allclose(picture["picture"].pixels, 0.1 + 0.5 * 102 / 255, rtol=1e-6)


@pytest.mark.parametrize(
    ("options", "scale", "offset", "repeat", "clamp"),
    [
        ("", (1, 1), (0, 0), 1, False),
        ("-s 2", (2, 1), (0, 0), 1, False),
        ("-s 0.5 0.75", (0.5, 0.75), (0, 0), 1, False),
        ("-s 1.5 2.5 -o 0.25 0.125", (1.5, 2.5), (0.25, 0.125), 1, False),
        ("-o 0.5 0.25 -s 0.5 0.5", (0.5, 0.5), (0.5, 0.25), 3, False),
        ("-clamp on", (1, 1), (0, 0), 1, True),
        ("-clamp on -s 2 2", (2, 2), (0, 0), 1, True),
        ("-clamp on -s 0.5 3 -o 0.75 -0.5", (0.5, 3), (0.75, -0.5), 1, True),
        ("-CLAMP ON -s 2 0.5 -o -0.5 0.25", (2, 0.5), (-0.5, 0.25), 2, True),
    ],
)
def test_placing_of_a_picture(parts, load, write_picture, options, scale, offset, repeat, clamp):
    """Proves: the texel seen at (u, v) is that at (s u + o, s v + o) of the picture, whose v grows
    upwards, repeated or, with `-clamp on`, held at the edges.

    The picture has 4 x 4 texels that are used (section 11.1); the values tell them apart.
    """
    load("")  # sets the variant
    values = np.arange(25).reshape(5, 5)
    write_picture("a.png", np.repeat(values[..., None], 3, axis=2))
    mtl = f"newmtl m\nmap_Kd {options} a.png\n#REPEAT {repeat}\n"
    (part,) = parts(mtl, lines="color 1 1 1\n")
    texture = mi.load_dict(to_mitsuba(part["bsdf"]["bsdf"]["reflectance"]) | {"raw": True})
    u, v = np.random.default_rng(5).uniform(-0.6, 1.6, (2, 500))
    si = dr.zeros(mi.SurfaceInteraction3f, 500)
    si.uv = mi.Point2f(u, 1 - v)  # meshes are read so
    seen = np.array(texture.eval(si))[0] * 255
    place = np.array([repeat * (s * x + o) for s, o, x in zip(scale, offset, (u, v), strict=True)])
    place = np.clip(place, 0, 0.999) if clamp else place % 1
    column, row = (4 * place).astype(int)
    clear = (np.abs(4 * place - np.round(4 * place)) > 1e-4).all(axis=0) | clamp
    np.testing.assert_allclose(seen[clear], values[4 - row, column][clear], atol=1e-3)


@pytest.mark.parametrize(
    ("obj", "mtl", "message"),
    [
        ("v 0 0 0\nv 1 0\nf 1 2 1\nusemtl m\n", None, "m.obj:2:1: vertex with 2 of 3 numbers"),
        (f"{QUAD}usemtl m\nf 1 2 9\n", None, "m.obj:10:7: '9' names no vertex: there are 4"),
        ("usemtl m\nv 0 0 0\n", None, "m.obj: has no faces"),
        ("usemtl m\nv 0 0 \0\n", None, "m.obj:2: binary data"),
        (f"{QUAD}usemtl m\n{FACE}", "newmtl m\nKd 1 1\n", "m.mtl:2:1: Kd with 2 of 3 numbers"),
        (f"{QUAD}usemtl m\n{FACE}", "newmtl m\n#REFLECTION 9\n", "#REFLECTION takes 0 to 8"),
        (f"{QUAD}usemtl m\n{FACE}", "newmtl m\nmap_Kd bad.png\n", "bad.png"),
    ],
)
def test_broken_files_give_located_errors(translated, write, tmp_path, obj, mtl, message):
    """Errors of kind asset at the object's line, with the place in the broken file."""
    (tmp_path / "bad.png").write_bytes(b"\x89PNG\r\n\x1a\nbroken")
    write(obj, mtl)
    with pytest.raises(SceneError) as caught:
        translated(f"IMAGE\n8 8\n\n{OBJECT}reflection diffuse\n")
    (problem,) = caught.value.problems
    assert (problem.line, problem.kind) == (5, "asset")
    assert message in problem.message


@pytest.mark.parametrize("shape", ["sphere 0 0 0 1", "objfile m.obj"])
@pytest.mark.parametrize("keyword", ["texture", "bump_texture", "ibl_texture"])
def test_broken_pictures_are_told_at_their_lines(translated, write, tmp_path, keyword, shape):
    """The error stands where the scene names the picture, as that of a missing one does."""
    (tmp_path / "bad.png").write_bytes(b"\x89PNG\r\n\x1a\nbroken")
    write(f"{QUAD}usemtl m\n{FACE}")
    with pytest.raises(SceneError) as caught:
        translated(f"OBJECT\n{shape}\ncolor 1 1 1\nreflection diffuse\n{keyword} bad.png\n")
    (problem,) = caught.value.problems
    assert (problem.line, problem.column, problem.kind) == (5, len(keyword) + 2, "asset")
    assert "bad.png: damaged or not supported: " in problem.message


def test_a_broken_background_is_told_at_its_line(translated, tmp_path):
    """As other pictures."""
    (tmp_path / "bad.hdr").write_bytes(b"#?RADIANCE\nbroken")
    with pytest.raises(SceneError, match=r"scene.txt:4:20: .*bad.hdr: the Radiance header has no"):
        translated("IMAGE\n8 8\n\nbackground_texture bad.hdr\n")


def test_every_broken_file_is_told(translated, tmp_path):
    """All objects are looked at before the scene is refused."""
    (tmp_path / "a.obj").write_text("usemtl m\nf 1 2 3\n")
    (tmp_path / "b.obj").write_text("usemtl m\nv x 0 0\n")
    end = "color 1 1 1\nreflection diffuse\n\n"
    with pytest.raises(SceneError) as caught:
        translated(f"OBJECT\nobjfile a.obj\n{end}OBJECT\nobjfile b.obj\n{end}")
    assert [p.line for p in caught.value.problems] == [2, 7]
