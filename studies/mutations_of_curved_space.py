"""Errors of light in curved space that tests have to find."""

from studies.mutations import of

METRICS = "integrators/metrics"
HOLE, SPIN, THROAT = (f"{METRICS}/test_{n}.py" for n in ("schwarzschild", "kerr", "wormhole"))
SCENES, SHIFT = "integrators/test_curvedspace.py", "integrators/test_dopplershift.py"
CAMERA, DISK = "sensors/test_relativisticcamera.py", "textures/test_accretiondisk.py"
APPLICATION = "relume/test_curved_space.py"

steps = of(f"{METRICS}/metric.py", f"{HOLE}::test_deflection")
hole = of(f"{METRICS}/schwarzschild.py", f"{HOLE}::test_deflection")
spin = of(f"{METRICS}/kerr.py", f"{SPIN}::test_rays_off_the_equator")
throat = of(f"{METRICS}/wormhole.py", f"{THROAT}::test_swept_angles")
scenes = of("integrators/curvedspace.py", SCENES)
shift = of("sensors/doppler.py", SHIFT)
camera = of("sensors/relativisticcamera.py", CAMERA)
disk = of("textures/accretiondisk.py", DISK)
bounds = of("relume/black_holes.py", "translator/test_curved_space.py::test_the_largest_spins")
written = of("relume/convert.py", APPLICATION)
pictures = of("relume/picture_formats.py", APPLICATION)
bodies = of("textures/blackbodies.py", f"{DISK}::test_black_bodies")

CURVED_SPACE = [
    steps("error of steps a hundred times larger", "TOLERANCE = 2e-7", "TOLERANCE = 2e-5"),
    steps("a weight of a step 2 % too small", "(37 / 378, 0.0", "(0.98 * 37 / 378, 0.0"),
    hole("attraction 2 % too strong", "k = 3 * dr.squared_norm", "k = 3.06 * dr.squared_norm"),
    hole(
        "energy of light without the hole",
        "v = d * dr.rsqrt(dr.maximum(dr.fma(f, 1 - cos2, cos2), 1e-12))",
        "v = d * dr.rsqrt(dr.maximum(dr.fma(1, 1 - cos2, cos2), 1e-12))",
        f"{HOLE}::test_edge_of_the_shadow",
        equivalent="the path of light does not depend on its energy",
    ),
    hole(
        "observers at rest see 2 % less",
        "(dr.safe_sqrt(f) - 1) * dr.dot(d, n)",
        "(0.98 * dr.safe_sqrt(f) - 1) * dr.dot(d, n)",
        f"{HOLE}::test_edge_of_the_shadow",
    ),
    hole(
        "rest of the deflection left out",
        "return dr.normalize(v - bend * (x - along * v)), rest",
        "return v, rest",
    ),
    spin("spin 2 % too large", "self.a = mi.Float(-spin)", "self.a = mi.Float(-1.02 * spin)"),
    spin(
        "spin the wrong way round",
        "self.a = mi.Float(-spin)",
        "self.a = mi.Float(spin + 0)",
        f"{SPIN}::test_edges_of_the_shadow",
    ),
    spin(
        "azimuth of the scene 2 % off",
        "-dr.atan2(self.a, r) - self.a * log",
        "-dr.atan2(self.a, r) - 1.02 * self.a * log",
    ),
    spin("a force 2 % too strong", "lp_r = (p.x * x.x", "lp_r = 1.02 * (p.x * x.x"),
    throat(
        "throat 2 % too wide", 'mi.Float(number(props, "rho', 'mi.Float(1.02 * number(props, "rho'
    ),
    throat("lensing 2 % too wide", "LENSING_WIDTH = 1.42953", "LENSING_WIDTH = 1.40150"),
    throat("throat 2 % too long", 'mi.Float(number(props, "a', 'mi.Float(1.02 * number(props, "a'),
    throat(
        "distance from the mouth 2 a too small",
        "return dr.fma(0.5 * dr.pi * self.M, x, self.a)",
        "return dr.fma(0.5 * dr.pi * self.M, x, -self.a)",
        f"{THROAT}::test_radii_and_distances",
    ),
    scenes(
        "surfaces see the chord",
        "si.wi = si.to_local(-tangent)",
        "si.wi = si.to_local(-path.d)",
        f"{SCENES}::test_mirrors_see_the_tangent",
    ),
    scenes(
        "geodesics begin anew behind a veil",
        "path.g = dr.select(passes, path.g, g)",
        "path.g = g",
        f"{SCENES}::test_veils_do_not_bend_light",
    ),
    scenes(
        "hits beyond the chord",
        "dr.select(path.final, dr.largest(mi.Float), length)",
        "dr.select(path.final, dr.largest(mi.Float), length + 2)",
        f"{SCENES}::test_hits_lie_on_the_path",
    ),
    scenes(
        "emission at the end of a geodesic 2 % too bright",
        "Le = si.shape.emitter().eval(si, shown)",
        "Le = 1.02 * si.shape.emitter().eval(si, shown)",
        f"{SCENES}::test_flat_limit_of_what_is_seen",
    ),
    shift("frequencies 2 % off", "* (1 + dr.dot(d, velocity))", "* (1.02 + dr.dot(d, velocity))"),
    shift(
        "aberration 2 % too weak",
        "gamma * gamma / (gamma + 1)",
        "0.98 * gamma * gamma / (gamma + 1)",
        f"{CAMERA}::test_aberration",
    ),
    shift("primaries 2 % too narrow", "WIDTH = 100.0", "WIDTH = 98.0"),
    camera(
        "Mollweide's latitudes 2 % off", "dr.sin(2 * theta)) / dr.pi", "dr.sin(2 * theta)) / 3.2"
    ),
    disk("orbits 2 % too slow", "L = self.turn * (g_phi", "L = 0.98 * self.turn * (g_phi"),
    disk(
        "no red shift of the orbit",
        "dr.safe_sqrt(1 - 3 / r + 2 * a * w) / rest",
        "dr.safe_sqrt(1 - 2 / r + 2 * a * w) / rest",
    ),
    disk("speed of gas 2 % too low", "beta = rate * A", "beta = 0.98 * rate * A"),
    disk(
        "picture of the disk 2 % too small", "(self.R - self.inner)", "(0.98 * self.R - self.inner)"
    ),
    disk(
        "temperatures 2 % too high",
        "return self.temperature * dr",
        "return 1.02 * self.temperature * dr",
    ),
    bounds("largest spin 2 % too small", "MOST_SPIN = 0.999999", "MOST_SPIN = 0.98"),
    bounds(
        "innermost orbit 2 % too far",
        "return 3 + z2 -",
        "return 3.06 + z2 -",
        "relume/test_black_holes.py",
    ),
    written(
        "the scene on the other side without its type",
        '.replace("<scene name=", \'<scene type="scene" name=\')',
        "",
        f"{APPLICATION}::test_both_sides_of_a_wormhole_are_converted",
    ),
    pictures(
        "EXR files without their comment",
        'names = {COMMENT: "comments"}',
        'names = {COMMENT: "comment"}',
        f"{APPLICATION}::test_metadata_of_pictures",
    ),
    bodies("Planck's constant 2 % too large", "1.438777e7", "1.467e7"),
]
