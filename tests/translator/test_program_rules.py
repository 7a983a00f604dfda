"""What the original program shows where the manual is silent, as rules and closed forms."""

import math

import mitsuba as mi
import numpy as np
import pytest

RHO = 0.5
FLOOR = f"OBJECT\nuvplane -50 0 -50\nU 0 0 100\nV 100 0 0\ncolor {RHO} {RHO} {RHO}\n"
FLOOR += "reflection diffuse\n\n"
NEE = "nextEventEstimation\n1\n\n"
SKY = "BACKGROUND\n1 1 1\n\n"
LAMP = "OBJECT\nuvplane -1 2 -1\nU 2 0 0\nV 0 0 2\nemission 2 3 4\nreflection diffuse\n"
"""A square of side 2 at the height 2 above the origin, which shines down."""


def corner_factor(a, b, h=2.0):
    """Form factor of a rectangle a x b at the height h, a corner of it straight above."""
    p, q = math.hypot(a, h), math.hypot(b, h)
    return (a / p * math.atan(b / p) + b / q * math.atan(a / q)) / (2 * math.pi)


WRITTEN = 4 * corner_factor(1, 1)
SQUARED = corner_factor(1, 1) + 2 * corner_factor(1, 3) + corner_factor(3, 3)
"""Of the square from -1 to 1, and of the one from -1 to 3: edges of squared length."""


@pytest.mark.false_alarms(1e-3)
@pytest.mark.parametrize(
    ("dialect", "head", "factor"),
    [
        ("manual", "", WRITTEN),
        ("manual", NEE, WRITTEN),
        ("prender", "", SQUARED),
        ("prender", NEE, WRITTEN),
    ],
)
def test_lamps_of_two_sizes(view, measure, agrees, dialect, head, factor):
    """Row uvplane-light: in dialect `prender` a lamp lights by squared edges, found by chance, or
    by U x V under next event estimation."""
    floor = FLOOR.replace("uvplane -50 0 -50\nU 0 0 100\nV 100 0 0", "plane 0 0 0\nnormal 0 1 0")
    text = view((4.5, 0.5, 0.2), (0, 0, 0)) + head + floor + LAMP
    agrees(measure(text, spp=1024, dialect=dialect), RHO * np.array([2, 3, 4]) * factor)


@pytest.mark.parametrize("head", ["", NEE])
def test_lamps_are_seen_in_squared_lengths(view, measure, head):
    """Its far corner at (3, 2, 3) shines in dialect `prender`, with and without NEE."""
    text = view((2.5, 0, 2.5), (2.9, 2, 2.9)) + head + LAMP
    assert measure(text, spp=4, runs=2, dialect="prender").mean == pytest.approx([2, 3, 4])
    assert np.all(measure(text, spp=4, runs=2).mean == 0)


@pytest.mark.parametrize(
    ("lines", "shines"),
    [
        ("reflection diffuse\n", False),
        ("", False),
        ("reflection diffuse\ncolor 0.1 0.2 0.3\n", True),
        ("reflection diffuse\ncolor 0.0005 0 0\n", False),
        ("reflection specular\n", True),
    ],
)
def test_which_planes_shine_on_their_back(view, measure, lines, shines):
    """Row lit-uvplane: those that are no lamps, having a colour or another reflection."""
    panel = f"OBJECT\nuvplane -1 0 -1\nU 0 0 2\nV 2 0 0\nemission 2 3 4\n{lines}"
    found = measure(view((0.3, -2, 0.1), (0.2, 0, 0.1)) + panel, spp=4, runs=2).mean
    assert found == pytest.approx([2, 3, 4] if shines else [0, 0, 0])
    # from the side of the normal all do
    found = measure(view((0.3, 2, 0.1), (0.2, 0, 0.1)) + panel, spp=4, runs=2).mean
    assert found == pytest.approx([2, 3, 4])


BACKDROP = "OBJECT\nuvplane -5 -5 0\nU 10 0 0\nV 0 10 0\ncolor 0.2 0.8 0.1\nreflection diffuse\n"
BALL = "OBJECT\nsphere 0.05 0.02 3 1\ncolor 1 1 1\nreflection {}\nrefractive_index 1.000001\n\n"


@pytest.mark.parametrize("dialect", ["manual", "prender"])
@pytest.mark.parametrize("between", ["", "reflection"])
def test_backgrounds_are_seen_unlit(view, measure, dialect, between):
    """Row background-object: the colour itself, under a sky or without, straight or through glass;
    without the flag it is lit."""
    ball = BALL.format(between) if between else ""
    for sky, lit in ((SKY, 1), ("", 0)):
        text = view((0, 0, 7), (0, 0, 0)) + sky + ball + BACKDROP
        unlit = measure(text + "background 1\n", spp=64, runs=2, dialect=dialect)
        assert unlit.mean == pytest.approx([0.2, 0.8, 0.1], rel=1e-3)
        # A ray may leave the sky at the plane's edge: 0.2 of the light at most.
        shaded = measure(text, spp=64, runs=2, dialect=dialect).mean
        assert shaded == pytest.approx(lit * np.array([0.2, 0.8, 0.1]), rel=1e-2)


def test_backgrounds_in_mirrors(view, measure):
    """A perfect mirror shows the colour, too; a half diffuse one shows half of it, and the rest of
    it is lit by the backdrop, which there is no light on: black."""
    mirror = "OBJECT\nuvplane -9 -9 8\nU 0 18 0\nV 18 0 0\ncolor 1 1 1\nreflection specular\n"
    wall = BACKDROP + "background 1\n\n"
    for lines, share in (("\n", 1), ("roughness 0.5\n\n", 0.5)):
        text = view((0, 0, 4), (0.4, 0.1, 8)) + mirror + lines + wall
        found = measure(text, spp=1024, runs=4).mean
        assert found == pytest.approx(share * np.array([0.2, 0.8, 0.1]), rel=0.05)


@pytest.mark.false_alarms(1e-3)
def test_backgrounds_light_others_as_they_are_lit(view, measure, agrees):
    """What faces the backdrop gets what it reflects of the sky: half of 1, halved again."""
    wide = "OBJECT\nuvplane -500 -500 0\nU 1000 0 0\nV 0 1000 0\ncolor 0.5 0.5 0.5\n"
    wide += "reflection diffuse\nbackground 1\n\n"
    plate = "OBJECT\ndisk 0 0 1 0.01\nnormal 0 0 -1\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"
    text = view((0, 0.3, 0.5), (0, 0, 1), width=1e-3) + SKY + wide + plate
    agrees(measure(text, spp=1024), 0.25)


def test_backgrounds_with_pictures(view, measure, write_picture):
    """The texel, not the colour; where it is transparent, what is behind."""
    pixels = np.full((4, 4, 4), 255)
    pixels[..., :3] = [51, 102, 204]
    pixels[:, 2:, 3] = 0
    write_picture("paint.png", pixels)
    wall = BACKDROP + "texture paint.png\nbackground 1\n\n"
    for x, value in ((-2, (0.2, 0.4, 0.8)), (4, (1, 1, 1))):
        text = view((x, 0, 7), (x, 0, 0)) + SKY + wall
        assert measure(text, spp=8, runs=2).mean == pytest.approx(np.array(value), rel=1e-4)


def test_level_0_takes_away_what_would_be_scattered(view, measure):
    """Row level-0: a ball of index 1 passes exp(-2 r (sigma_s + sigma_a)) of the sky behind it."""
    ball = "OBJECT\nsphere 0 0 0 0.5\ncolor 1 1 1\nrefractive_index 1\nreflection reflection\n"
    ball += "reflection Subsurface_Scattering\nlevel\n0\nSCATTERING\n0\n1 0 2\n"
    ball += "ABSORBING\n0\n0 1 0.5\n"
    found = measure(view((0, 0, 5), (0, 0, 0)) + SKY + ball, spp=256, runs=4).mean
    assert found == pytest.approx(np.exp([-1, -1, -2.5]), rel=0.02)


@pytest.mark.parametrize("reader", ["plain", "own"])
def test_flat_faces_are_shaded_with_the_mean_of_their_normals(load, tmp_path, reader):
    """Row flat-vn: one normal for each triangle, those of a quad's halves each of its own."""
    normals = np.array([[0.6, 0, 0.8], [0, 0, 1], [0, 0.6, 0.8], [-0.6, 0, 0.8]])
    lines = ["v 0 0 0", "v 2 0 0", "v 2 2 0", "v 0 2 0"]
    lines += ["vn " + " ".join(map(str, n)) for n in normals]
    head = [] if reader == "plain" else ["usemtl paint"]
    (tmp_path / "m.obj").write_text("\n".join([*head, *lines, "f 1//1 2//2 3//3 4//4"]) + "\n")
    for turned in (False, True):
        sign = -1 if turned else 1
        lines = "OBJECT\nobjfile m.obj\ncolor 1 1 1\nreflection diffuse\n" + turned * "normal -1\n"
        scene = load(lines)
        for corners, points in (((0, 1, 2), ((1.5, 0.3), (1.8, 1.5))),
                                ((0, 2, 3), ((0.3, 1.5), (0.1, 0.4)))):  # fmt: skip
            mean = normals[list(corners)].sum(axis=0)
            for x, y in points:
                si = scene.ray_intersect(mi.Ray3f(mi.Point3f(x, y, 5), mi.Vector3f(0, 0, -1)))
                found = np.array(si.sh_frame.n).ravel()
                assert found == pytest.approx(sign * mean / np.linalg.norm(mean), abs=1e-5)


def test_flat_faces_without_tilt_stay_flat(translated, tmp_path):
    """Normals of the file that are those of the faces change nothing: no mesh of single faces."""
    (tmp_path / "m.obj").write_text(
        "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvn 0 0 1\nusemtl a\nf 1//1 2//1 3//1 4//1\n"
    )
    scene = translated("OBJECT\nobjfile m.obj\ncolor 1 1 1\nreflection diffuse\n").scene
    mesh = scene["object_1"]["mesh"]
    assert mesh.normals is None and len(mesh.vertices) == 4


@pytest.mark.parametrize("textured", [False, True])
def test_wards_blend_at_each_point(load, write_picture, textured):
    """Dialect `prender`: diffuse and lobe by their means where the light falls, not over all."""
    write_picture("paint.png", np.array([[[51, 102, 0], [255, 204, 153]]] * 2))
    lines = "texture paint.png\n" if textured else "color 0.2 0.4 0\n"
    panel = "OBJECT\nuvplane 0 0 0\nU 0 0 1\nV 1 0 0\nspecular 0.3 0.3 0.3\n"
    panel += "reflection ward_brdf\nward_brdf 0.5 1 0.1 0.1\n"
    scene = load(panel + lines, "prender")
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(0.5, 1, 0.25), mi.Vector3f(0, -1, 0)))
    # far from the mirror direction there is nothing but the diffuse part
    wo = mi.Vector3f(math.sqrt(0.75), 0, 0.5)
    found = np.array(si.bsdf().eval(mi.BSDFContext(), si, wo)).ravel() * math.pi / 0.5
    color = 0.5 * np.array([0.2, 0.4, 0.0])
    specular = np.array([0.2, 0.4, 0.0]) if textured else np.full(3, 0.3)
    assert found == pytest.approx(color * color.mean() / (color.mean() + specular.mean()), rel=1e-3)
