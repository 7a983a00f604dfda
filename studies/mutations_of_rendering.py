"""Errors of integrators, cameras and sessions that tests have to find."""

from studies.mutations import of

SURFACES, DIPOLE = "integrators/test_surfacepath.py", "integrators/test_dipole.py"
HERO = "integrators/test_hero_wavelength.py"
METROPOLIS, BDPT = "integrators/test_metropolis.py", "integrators/test_bdpt.py"
WALKS, OWEN = "integrators/test_randomwalk.py", "samplers/test_owen.py"
SKY = "test_sky_and_what_it_is_sampled_by_are_one"
SESSION, MATERIALS = "relume/test_session.py", "translator/test_materials.py"

shared = of("integrators/common.py", f"{DIPOLE}::test_emitter_hits_and_samples", DIPOLE)
paths = of("integrators/surfacepath.py", f"{SURFACES}::test_is_path_where_roulette_does_not_act")
chains = of("integrators/markovchains.py", f"{METROPOLIS}::test_constant_radiance")
steps = of("integrators/primarysamples.py", f"{METROPOLIS}::test_mutations_are_symmetric")
frame = of("integrators/metropolis.py", f"{METROPOLIS}::test_constant_parts")
mlt = of("integrators/pssmlt.py", f"{METROPOLIS}::test_constant_radiance")
redistribution = of("integrators/erpt.py", f"{METROPOLIS}::test_constant_radiance")
weights = of("integrators/misweights.py", "integrators/test_misweights.py")
starts = of("integrators/lightstarts.py", f"{BDPT}::test_light_tracing_alone_is_exact")
both_ends = of("integrators/bdpt.py", f"{BDPT}::test_light_tracing_alone_is_exact")
merging = of("integrators/merging.py", "integrators/test_merging.py::test_merging_alone_is_exact")
connections = of("integrators/eyesubpaths.py", f"{BDPT}::test_closed_room_that_shines")
walks = of("integrators/randomwalk.py", f"{WALKS}::test_white_furnace", WALKS)
along = of("integrators/walklights.py", WALKS)
jumps = of("integrators/walkjumps.py", WALKS)
between = of("integrators/walks.py", f"{WALKS}::{SKY}")
balls = of("integrators/spherejumps.py", "integrators/test_spherejumps.py", WALKS)
nets = of("samplers/owen.py", OWEN)
lamps = of("integrators/emission.py", f"{BDPT}::test_emission_is_as_dense_as_hits_have_it")
response = of("integrators/samplescale.py", "integrators/test_samplescale.py")
camera = of("sensors/screencamera.py", "sensors/test_screencamera.py")
pixels = of("sensors/pixelsamples.py", "sensors/test_pixelsamples.py")
session = of("relume/session.py", f"{SESSION}::test_a_sky_alone_is_exact")
aovs = of("relume/aovs.py", "relume/test_aovs.py")
accumulator = of("relume/accumulator.py", f"{SESSION}::test_a_sky_alone_is_exact")

RENDERING = [
    shared(
        "roulette 2 % too bright",
        "throughput * dr.rcp(survival)",
        "throughput * 1.02 * dr.rcp(survival)",
        f"{SURFACES}::test_closed_rooms",
    ),
    shared(
        "roulette beside translucent objects 2 % too bright",
        "throughput * dr.rcp(survival)",
        "throughput * 1.02 * dr.rcp(survival)",
        f"{DIPOLE}::test_closed_rooms",
    ),
    shared(
        "lamps that rays hit beside translucent objects 2 % too bright",
        "return ds.emitter.eval(si, active) * power",
        "return 1.02 * ds.emitter.eval(si, active) * power",
    ),
    paths(
        "lamps that rays hit 2 % too bright",
        "Le = ds.emitter.eval(si, shown) *",
        "Le = 1.02 * ds.emitter.eval(si, shown) *",
    ),
    paths(
        "sampled lamps 2 % too bright",
        "direct = f * Le * dr.detach(mis)",
        "direct = 1.02 * f * Le * dr.detach(mis)",
    ),
    paths(
        "hero wavelength 2 % too bright",
        "mi.Float(len(mi.Spectrum())), 1)",
        "mi.Float(1.02 * len(mi.Spectrum())), 1)",
        f"{HERO}::test_white_furnace",
    ),
    chains(
        "acceptance of chains 2 % too high",
        "dr.minimum(1, I_new / I), 1)",
        "dr.minimum(1, 1.02 * I_new / I), 1)",
        f"{METROPOLIS}::test_chains_visit_by_density",
    ),
    chains(
        "states of chains 2 % too bright",
        "weight, weight_new) * units[1]",
        "weight, weight_new) * 1.02 * units[1]",
    ),
    chains(
        "large steps 2 % too bright",
        "large_new) * c * units[0]",
        "large_new) * c * 1.02 * units[0]",
    ),
    chains(
        "proposals 2 % too dark", "weight_new, large_new = a,", "weight_new, large_new = 0.98 * a,"
    ),
    steps("steps of one size 2 % off centre", "(2 * r - 1) * size", "(2 * r - 0.98) * size"),
    frame(
        "direct light of chains 2 % too bright",
        "self.direct, rng, count, False)",
        "self.direct, rng, count, False) * 1.02",
    ),
    mlt("b 2 % too high", "b = I.mean(1)", "b = 1.02 * I.mean(1)"),
    mlt("2 % off in the correction of b", "- capped / count", "- 0.98 * capped / count"),
    mlt(
        "bright paths correct b in full",
        "MAX_SHARE = 1 / 16",
        "MAX_SHARE = 1e9",
        f"{METROPOLIS}::test_few_seeds_leave_no_negative_pixels",
    ),
    redistribution("energy of the seeds 2 % too high", "(I.mean() *", "(1.02 * I.mean() *"),
    response(
        "limit of the luminance 2 % too high",
        "self.luminance_limit / dr",
        "1.02 * self.luminance_limit / dr",
    ),
    response(
        "response 2 % too high", "return L * self.response,", "return 1.02 * L * self.response,"
    ),
    camera("picture 2 % too wide", "(0.5 - p) * self.width", "(0.5 - p) * 1.02 * self.width"),
    camera("focus 2 % too far", "/ focus_distance)", "/ (1.02 * focus_distance))"),
    camera("lens 2 % too large", "0) * radius", "0) * 1.02 * radius"),
    session(
        "sum of a pass 2 % too high",
        "samples = [*color, ",
        "samples = [*(1.02 * color), ",
    ),
    session(
        "sum of a pass by other integrators 2 % too high",
        "else channels[:3]) * np.float32(spp)",
        "else channels[:3]) * np.float32(1.02 * spp)",
    ),
    accumulator(
        "half a percent of the samples lost",
        "self.sum.value() / self.spp)",
        "self.sum.value() / (1.005 * self.spp))",
    ),
    accumulator(
        "variance of a picture divided by n",
        "((n - 1) * self.spp)",
        "(n * self.spp)",
        "relume/test_accumulator.py",
    ),
    accumulator(
        "squares of a pass 2 % too low",
        "self.squares.add(found.squares)",
        "self.squares.add(np.float32(0.98) * found.squares)",
        "relume/test_accumulator.py",
    ),
    pixels(
        "tent 2 % too wide",
        "radius = 0.5 if abs",
        "radius = 0.51 if abs",
    ),
    weights(
        "density of scattering 2 % too large in the weights of paths from both ends",
        "p = dr.select(pdf > 0, dr.rcp(pdf), 0)",
        "p = dr.select(pdf > 0, dr.rcp(1.02 * pdf), 0)",
    ),
    weights(
        "density of connections 2 % too large in their weights",
        "dr.fma(pdf_y, others_y, pdf_x * others_x)",
        "dr.fma(1.02 * pdf_y, others_y, pdf_x * others_x)",
    ),
    lamps(
        "density of emission 2 % too large in the weights of paths from both ends",
        "Row(AREA, R=float(density.max())",
        "Row(AREA, R=1.02 * float(density.max())",
    ),
    accumulator(
        "variance of two sequences 2 % too high",
        "scatter**2 / (",
        "1.02 * scatter**2 / (",
        "relume/test_accumulator.py",
    ),
    aovs("albedo 2 % too high", "dr.clip(linear_rgb(", "dr.clip(1.02 * linear_rgb("),
    aovs("depth 2 % too far", "seen, si.t, NOWHERE", "seen, 1.02 * si.t, NOWHERE"),
    aovs(
        "albedo smaller by the square of the index",
        "dr.square(dr.select(meets, sample.eta, 1))",
        "dr.select(meets, 1, 1)",
    ),
    both_ends(
        "light subpaths shown to the camera 2 % too bright",
        "splats.picture() * (pixels / paths)",
        "splats.picture() * (1.02 * pixels / paths)",
    ),
    connections(
        "connections of paths from both ends 2 % too bright",
        "value *= w * count / distance2",
        "value *= 1.02 * w * count / distance2",
        f"{BDPT}::test_connections_alone_are_exact",
    ),
    merging(
        "merged vertices 2 % too bright",
        "return L * grid.density",
        "return L * (1.02 * grid.density)",
    ),
    connections(
        "lamps sampled by paths from both ends 2 % too bright",
        "direct = lamp.f * Le * w",
        "direct = 1.02 * lamp.f * Le * w",
    ),
    starts(
        "light subpaths begin 2 % too bright",
        "dr.select(E > 0, Le / E, 0), power)",
        "dr.select(E > 0, 1.02 * Le / E, 0), power)",
    ),
    walks(
        "scatterings of walks lose 2 % too much",
        "dr.select(scatters, inner.albedo, 1)",
        "dr.select(scatters, 0.98 * inner.albedo, 1)",
    ),
    walks(
        "flights 2 % too long",
        "1 - sampler.next_1d()) / sigma",
        "1 - sampler.next_1d()) / (0.98 * sigma)",
        f"{WALKS}::test_what_is_not_scattered_is_beers_law",
    ),
    along(
        "lamps that walks see 2 % too bright",
        "β * f * left * Le * mis, 0)",
        "β * f * left * Le * 1.02 * mis, 0)",
        f"{WALKS}::{SKY}",
    ),
    jumps(
        "balls crossed 2 % too bright",
        "survival(r * reduced, a, kappa), 1)",
        "1.02 * survival(r * reduced, a, kappa), 1)",
        f"{WALKS}::test_walks_of_any_length_keep_the_mean",
    ),
    between(
        "lamps 2 % too bright behind media",
        "T *= dr.select(inside, around.media",
        "T *= dr.select(inside, 1.02 * around.media",
    ),
    balls("cosines at which walks leave balls 2 % too high", "m = EXTRAPOLATED", "m = 0.725"),
    balls("balls 2 % too large", "x = kappa * (", "x = 1.02 * kappa * ("),
    nets("numbers 2 % too small", "* 2.0**-24", "* 0.98 * 2.0**-24"),
    nets(
        "dimensions 16 apart share the order of their points",
        "dr.select(pair < PAIRS, self.digits, again)",
        "self.digits",
    ),
]
