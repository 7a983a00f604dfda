"""Errors of 2 % that tests have to find: see `error_injection`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutation:
    """One error.

    Attributes:
        file: which is changed.
        says: what is wrong then.
        old: text that the file holds once.
        new: what takes its place.
        tests: those that may find it, below `tests/`, the quickest first.
        equivalent: why no picture changes, if none does.
    """

    file: str
    says: str
    old: str
    new: str
    tests: tuple
    equivalent: str = ""


def of(file, *tests):
    """A function that makes mutations of a file."""

    def mutation(says, old, new, *others, equivalent=""):
        return Mutation(file, says, old, new, others or tests, equivalent)

    return mutation


WARD, PHONG = "bsdfs/test_ward.py", "bsdfs/test_phong.py"
GLASS, DISPERSION = "bsdfs/test_schlickglass.py", "bsdfs/test_dispersion.py"
SPOT, BEAM = "emitters/test_falloffspot.py", "emitters/test_parallelbeam.py"
AREA, DOME = "emitters/test_twosidedarea.py", "emitters/test_ibldome.py"
DISPERSIVE, DIPOLE = "integrators/test_dispersivepath.py", "integrators/test_dipole.py"
DIFFUSION = "integrators/test_diffusion.py"
METROPOLIS = "integrators/test_metropolis.py"
SESSION, MATERIALS = "relume/test_session.py", "translator/test_materials.py"
LIGHTS, GOLDENS = "translator/test_lights.py", "translator/test_goldens.py"
STATISTICS = "relume/workbench/test_statistics.py"
COARSE = "::test_sample_follows_pdf_in_coarse_cells"

ward = of("bsdfs/ward.py", f"{WARD}::test_eval_is_the_formula")
phong = of("bsdfs/phong.py", f"{PHONG}::test_eval_is_the_formula")
lobes = of("bsdfs/common.py", PHONG + COARSE)
glass = of("bsdfs/schlickglass.py", f"{GLASS}::test_lobes_are_the_formulas")
dispersion = of("bsdfs/dispersion.py", f"{DISPERSION}::test_published_indices")
phase = of("phasefunctions/henyeygreenstein.py", "phasefunctions/test_henyeygreenstein.py")
catcher = of("bsdfs/shadowcatcher.py", "bsdfs/test_shadowcatcher.py")
translucent = of("bsdfs/subsurface.py", DIFFUSION, DIPOLE)
profiles = of("integrators/diffusion.py", DIFFUSION, DIPOLE)
vertices = of("integrators/vertices.py", DIPOLE)
spot = of("emitters/falloffspot.py", SPOT)
beam = of("emitters/parallelbeam.py", BEAM)
surface_rays = of(
    "emitters/common.py",
    f"{AREA}::test_power_of_the_particles",
    f"{DOME}::test_power_of_the_particles",
)
area = of("emitters/twosidedarea.py", f"{AREA}::test_shines_where_a_stock_area_light_is_black")
dome = of("emitters/ibldome.py", f"{DOME}::test_sampling_density")
dome_maps = of("emitters/domemaps.py", f"{DOME}::test_sampling_density")
dome_formulas = of("relume/dome_maps.py", "relume/test_dome_maps.py")
dispersive_path = of(
    "integrators/dispersivepath.py", f"{DISPERSIVE}::test_is_path_without_dispersion"
)
shared = of("integrators/common.py", f"{DISPERSIVE}::test_is_path_without_dispersion")
chains = of("integrators/markovchains.py", f"{METROPOLIS}::test_constant_radiance")
steps = of("integrators/primarysamples.py", f"{METROPOLIS}::test_mutations_are_symmetric")
frame = of("integrators/metropolis.py", f"{METROPOLIS}::test_constant_parts")
mlt = of("integrators/pssmlt.py", f"{METROPOLIS}::test_constant_radiance")
redistribution = of("integrators/erpt.py", f"{METROPOLIS}::test_constant_radiance")
response = of("integrators/samplescale.py", "integrators/test_samplescale.py")
camera = of("sensors/screencamera.py", "sensors/test_screencamera.py")
pixels = of("sensors/pixelsamples.py", "sensors/test_pixelsamples.py")
session = of("relume/session.py", f"{SESSION}::test_a_sky_alone_is_exact")
accumulator = of("relume/accumulator.py", f"{SESSION}::test_a_sky_alone_is_exact")
materials = of("translator/materials.py", GOLDENS)
lights = of("translator/lights.py", LIGHTS)
domes = of("translator/environment_maps.py", "translator/test_environment_maps.py")
bumps = of("translator/bumps.py", "translator/test_bumps.py")
view = of("translator/camera.py", "translator/test_camera.py")
estimates = of("relume/workbench/estimates.py", STATISTICS)
statistics = of("relume/workbench/statistics.py", STATISTICS)
measures = of("relume/workbench/measures.py", "relume/workbench/test_measures.py")

MUTATIONS = [
    # ---- materials
    ward(
        "Ward's lobe 2 % too bright, form of 1992",
        "return 0.25 * E * dr.sqrt(wo.z / wi.z), pdf",
        "return 0.255 * E * dr.sqrt(wo.z / wi.z), pdf",
    ),
    ward(
        "Ward's lobe 2 % too bright, Dür's form",
        "return 0.25 * E / wi.z, pdf",
        "return 0.255 * E / wi.z, pdf",
    ),
    ward(
        "Ward's lobe 2 % too bright, balanced form",
        "return E * H2 * inv_z * (wo.z * inv_z), pdf",
        "return 1.02 * E * H2 * inv_z * (wo.z * inv_z), pdf",
    ),
    ward("Ward's density 2 % too high", "pdf = 0.5 * E", "pdf = 0.51 * E", WARD + COARSE),
    ward(
        "Ward's roughness along u 2 % too large, in value and density",
        "u, v = x / alpha_u, y",
        "u, v = x / (1.02 * alpha_u), y",
    ),
    ward(
        "Ward's samples 2 % too far from the mirror direction",
        "x, y = alpha_u * x, alpha_v * y",
        "x, y = 1.02 * alpha_u * x, 1.02 * alpha_v * y",
        WARD + COARSE,
    ),
    phong(
        "Phong's lobe 2 % too bright",
        "return (n + 2) * power * wo.z",
        "return 1.02 * (n + 2) * power * wo.z",
    ),
    phong("Phong's lobe normalised by n + 2.02", "return (n + 2)", "return (n + 2.02)"),
    phong(
        "Phong's density 2 % too high",
        "(n + 1) * power\n",
        "1.02 * (n + 1) * power\n",
        PHONG + COARSE,
    ),
    phong(
        "Phong's samples of an exponent 2 % too low",
        "dr.rcp(n + 1))",
        "dr.rcp(0.98 * n + 1))",
        PHONG + COARSE,
    ),
    lobes(
        "Lambert's part 2 % too bright",
        "rho_d * lambert)",
        "1.02 * rho_d * lambert)",
        f"{PHONG}::test_eval_is_the_formula",
    ),
    lobes(
        "lobe chosen 2 % too rarely",
        "glossy = sample1 < p_lobe",
        "glossy = sample1 < 0.98 * p_lobe",
    ),
    lobes(
        "Lambert's directions 1 % too flat",
        "lambert = mi.Vector3f(x, y, dr.sqrt(1 - sample2.y))",
        "lambert = dr.normalize(mi.Vector3f(x, y, 0.98 * dr.sqrt(1 - sample2.y)))",
    ),
    glass("Schlick's exponent 5.1", "x2 * x2 * x, F_0)", "x2 * x2 * x * dr.power(x, 0.1), F_0)"),
    glass(
        "Schlick's F_0 2 % too high",
        "return dr.fma(1 - F_0,",
        "F_0 *= 1.02\n    return dr.fma(1 - F_0,",
    ),
    glass("Fresnel's F 2 % too high", "return 0.5 * dr.fma(r_s", "return 0.51 * dr.fma(r_s"),
    glass(
        "refraction by an index 2 % too high", "eta = dr.sqrt(1 + k)", "eta = 1.02 * dr.sqrt(1 + k)"
    ),
    glass("transmission 2 % too bright", "tint_t /= eta * eta", "tint_t /= eta * eta * 0.98"),
    glass(
        "reflection drawn 2 % too rarely",
        "reflected = sample1 < F",
        "reflected = sample1 < 0.98 * F",
        f"{GLASS}::test_lobes_are_drawn_with_their_probability",
    ),
    glass(
        "density of refraction 2 % too high",
        "(1 - F) * p_hero)",
        "1.02 * (1 - F) * p_hero)",
        f"{GLASS}::test_weight_is_lobe_over_probability",
    ),
    glass(
        "a wavelength chosen of its own 2 % too bright",
        "(share / p_hero)",
        "(share / p_hero) * (1 if p_hero == 1 else 1.02)",
        f"{DISPERSION}::test_any_integrator_sees_the_right_mean",
    ),
    dispersion(
        "Sellmeier's first coefficient 0.5 % too high",
        "return 1 + w2 * (a /",
        "return 1 + w2 * (1.005 * a /",
    ),
    dispersion("Cauchy's third coefficient 2 % too high", "v2 * (c + v2", "v2 * (1.02 * c + v2"),
    dispersion("formula99's numerator 2 % too high", "n = a + b / (", "n = a + 1.02 * b / ("),
    phase(
        "phase function 2 % too high",
        "(1 + a) * dr.inv_four_pi",
        "(1 + a) * 1.02 * dr.inv_four_pi",
    ),
    phase("scattering 2 % too wide", "return x / dr.square(", "return 1.02 * x / dr.square("),
    catcher(
        "catcher's reflectance 2 % too high in samples",
        "rho = self.reflectance.eval(si, active & ~passes)",
        "rho = 1.02 * self.reflectance.eval(si, active & ~passes)",
    ),
    catcher(
        "catcher's reflectance 2 % too high in values",
        "return self.reflectance.eval(si, active) * density, density",
        "return 1.02 * self.reflectance.eval(si, active) * density, density",
    ),
    catcher(
        "what is open 2 % too bright",
        "dr.select(passes, 1, rho), 0)",
        "dr.select(passes, 1.02, rho), 0)",
    ),
    translucent(
        "reduced scattering of (1 - 1.02 g)",
        "sigma_s = medium.sigma_s * (1 - medium.g)",
        "sigma_s = medium.sigma_s * (1 - 1.02 * medium.g)",
        f"{DIFFUSION}::test_profiles_are_the_formulas",
    ),
    translucent(
        "Egan and Hilgeman's F_dr 2 % too high",
        "return dr.clip(dr.select(eta >= 1, above, below), 0, 0.999)",
        "return dr.clip(1.02 * dr.select(eta >= 1, above, below), 0, 0.999)",
        f"{DIFFUSION}::test_profiles_are_the_formulas",
    ),
    translucent(
        "share of diffusion's samples 2 % too low",
        "diffused = ~mirrored & front & (u < share)",
        "diffused = ~mirrored & front & (u < 0.98 * share)",
        "bsdfs/test_subsurface.py::test_ways_are_drawn_with_their_probability",
    ),
    profiles(
        "standard dipole 2 % too bright",
        "0.5 * self.alpha * both",
        "0.51 * self.alpha * both",
        f"{DIFFUSION}::test_profiles_are_the_formulas",
    ),
    profiles(
        "density of radii 2 % too high",
        "p += share * self.spread(z, r) / within",
        "p += 1.02 * share * self.spread(z, r) / within",
        f"{DIFFUSION}::test_density_of_radii",
    ),
    profiles(
        "virtual source 2 % too deep",
        "self.z_v = self.z_r * (1 + 4 / 3 * A)",
        "self.z_v = 1.02 * self.z_r * (1 + 4 / 3 * A)",
        f"{DIFFUSION}::test_profiles_are_the_formulas",
    ),
    profiles(
        "normalized profile 2 % too wide",
        "self.d = self.z_r / s",
        "self.d = 1.02 * self.z_r / s",
        f"{DIFFUSION}::test_profiles_are_the_formulas",
    ),
    profiles(
        "normalized profile 2 % too bright",
        "self.exit * self.R_d * self.density(d)",
        "1.02 * self.exit * self.R_d * self.density(d)",
        f"{DIFFUSION}::test_profiles_are_the_formulas",
    ),
    profiles(
        "light that enters 2 % too bright",
        "return medium.tint * (fresnel_transmission(wi.z, medium.eta)[0] * dr.inv_pi)",
        "return 1.02 * medium.tint * (fresnel_transmission(wi.z, medium.eta)[0] * dr.inv_pi)",
        f"{DIPOLE}::test_reflectance_of_a_slab",
    ),
    vertices(
        "light that enters 2 % too bright where lamps are sampled",
        "profile.entering(medium, leaves, si, to_light) * to_light.z, 0)",
        "1.02 * profile.entering(medium, leaves, si, to_light) * to_light.z, 0)",
        f"{DIPOLE}::test_parallel_light_on_a_slab",
    ),
    vertices(
        "scattering inside 2 % too bright where lamps are sampled",
        "f=arrives,",
        "f=1.02 * arrives,",
        f"{DIPOLE}::test_single_scattering_of_a_slab",
    ),
    # ---- lights
    spot(
        "spot 2 % too bright, where it is sampled",
        "weight = self._ramp(0.5 * dr",
        "weight = 1.02 * self._ramp(0.5 * dr",
        f"{SPOT}::test_irradiance_at_five_angles_and_three_distances",
    ),
    spot(
        "falloff exponent 2 % too high",
        "dr.power(x, self.f",
        "dr.power(x, 1.02 * self.f",
        f"{SPOT}::test_irradiance_at_five_angles_and_three_distances",
    ),
    spot(
        "cone 2 % too wide",
        "w, f = dr.deg2rad(self.cutoff_angle)",
        "w, f = dr.deg2rad(1.02 * self.cutoff_angle)",
        f"{SPOT}::test_irradiance_at_five_angles_and_three_distances",
    ),
    spot(
        "linear attenuation 2 % too strong",
        "dist, b), dist, a)",
        "dist, 1.02 * b), dist, a)",
        f"{SPOT}::test_irradiance_at_five_angles_and_three_distances",
    ),
    spot(
        "particles of the spot 2 % too bright",
        "(dr.two_pi * self.versine_w / c)",
        "(1.02 * dr.two_pi * self.versine_w / c)",
        f"{SPOT}::test_particles_and_paths_make_the_same_picture",
    ),
    beam(
        "beam 2 % too bright",
        "dr.select(lit, self.irradiance.eval(si, lit), 0.0)",
        "dr.select(lit, 1.02 * self.irradiance.eval(si, lit), 0.0)",
        f"{BEAM}::test_footprint_and_distance",
    ),
    beam("beam 2 % too wide", "(s <= 1.0)", "(s <= 1.02)", f"{BEAM}::test_footprint_and_distance"),
    beam(
        "particles of the beam 2 % too bright",
        "mi.depolarizer(weight * self.area)",
        "mi.depolarizer(1.02 * weight * self.area)",
        f"{BEAM}::test_power_of_the_particles",
    ),
    area(
        "two-sided lamp 2 % too bright where it is sampled",
        "value = self.radiance.eval(si, usable) / ds.pdf",
        "value = 1.02 * self.radiance.eval(si, usable) / ds.pdf",
        f"{AREA}::test_sampling_density_of_textured_shapes",
    ),
    area(
        "two-sided lamp 2 % too bright where it is hit",
        "def eval(self, si, active=True):\n            return mi.depolarizer(self.radiance",
        "def eval(self, si, active=True):\n            return mi.depolarizer(1.02 * self.radiance",
    ),
    area(
        "back of the two-sided lamp 2 % too bright",
        "def eval(self, si, active=True):\n"
        "            return mi.depolarizer(self.radiance.eval(si, active))",
        "def eval(self, si, active=True):\n"
        "            back = dr.select(si.wi.z < 0, 1.02, 1)\n"
        "            return mi.depolarizer(back * self.radiance.eval(si, active))",
    ),
    area(
        "density of a textured lamp 2 % too high",
        "projected = dr.norm(dr.cross(si.dp_du, si.dp_dv)) *",
        "projected = 0.98 * dr.norm(dr.cross(si.dp_du, si.dp_dv)) *",
        f"{AREA}::test_sampling_density_of_textured_shapes",
    ),
    dome(
        "dome 2 % too bright",
        "return dr.select(active, value * self.scale, 0.0)",
        "return dr.select(active, 1.02 * value * self.scale, 0.0)",
        "emitters/test_domemaps.py::test_every_direction_meets_the_nearest_texel",
    ),
    dome(
        "density of the dome 2 % too high, in sampling and in asking",
        "self.map.density(n)\n",
        "self.map.density(n) * 1.02\n",
    ),
    dome(
        "density of the dome 2 % too high, in asking alone",
        "return dr.select(usable, pdf * dr.square(ds.dist) / projected, 0.0)",
        "return dr.select(usable, 1.02 * pdf * dr.square(ds.dist) / projected, 0.0)",
    ),
    dome(
        "dome's radius 2 % too large where it is sampled",
        "ds.p = dr.fma(radius, n, centre)",
        "ds.p = dr.fma(1.02 * radius, n, centre)",
    ),
    surface_rays(
        "particles of the two-sided lamp and the dome 2 % too bright",
        "weight *= dr.pi * area",
        "weight *= 1.02 * dr.pi * area",
    ),
    dome(
        "colour of the dome by wavelength 2 % too bright",
        "* c.w * self.d65",
        "* (1.02 * c.w) * self.d65",
        f"{DOME}::test_spectral_variant_gives_the_same_colours",
    ),
    dome_maps(
        "density of the light probe 2 % too high",
        "return r / (4.0 * dr.pi",
        "return 1.02 * r / (4.0 * dr.pi",
    ),
    dome_formulas(
        "light probe 2 % too wide",
        "rho = m.atan2(",
        "rho = 0.98 * m.atan2(",
        "emitters/test_domemaps.py::test_every_direction_meets_the_nearest_texel",
    ),
    # ---- integrators, camera, session
    shared(
        "lamps that rays hit 2 % too bright",
        "return ds.emitter.eval(si, active) * power",
        "return 1.02 * ds.emitter.eval(si, active) * power",
    ),
    dispersive_path(
        "sampled lamps 2 % too bright",
        "dr.fma(β, f * em_weight * mis, L)",
        "dr.fma(β, 1.02 * f * em_weight * mis, L)",
    ),
    shared(
        "roulette 2 % too bright",
        "throughput * dr.rcp(survival)",
        "throughput * 1.02 * dr.rcp(survival)",
    ),
    dispersive_path(
        "hero wavelength 2 % too bright",
        "mi.Float(wavelengths), 1)",
        "mi.Float(1.02 * wavelengths), 1)",
        f"{DISPERSIVE}::test_white_furnace",
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
        "self.direct, rng, count)[0]",
        "self.direct, rng, count)[0] * 1.02",
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
    camera("focus 2 % too far", "(self.focus_distance / dr", "(1.02 * self.focus_distance / dr"),
    camera("lens 2 % too large", "0) * self.aperture_radius", "0) * 1.02 * self.aperture_radius"),
    session(
        "sum of a pass 2 % too high",
        "samples = [*color, *(color * color)]",
        "samples = [*(1.02 * color), *(color * color)]",
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
    # ---- translation
    materials(
        "colour of glass 2 % too bright",
        '"specular_transmittance": entry(reflectances.color)',
        '"specular_transmittance": entry(times(reflectances.color, 1.02))',
    ),
    materials(
        "diffuse colour 2 % too bright",
        '"reflectance": entry(color)}',
        '"reflectance": entry(times(color, 1.02))}',
    ),
    materials(
        "Ward's specular colour 2 % too bright",
        "color, specular = times(reflectances.color, rho_d), times(reflectances.specular, rho_s)\n"
        "    varying",
        "color, specular = times(reflectances.color, rho_d), "
        "times(reflectances.specular, 1.02 * rho_s)\n"
        "    varying",
    ),
    materials(
        "Ward's roughness along v 2 % too large", '"alpha_v": alpha_v', '"alpha_v": 1.02 * alpha_v'
    ),
    materials(
        "Phong's exponent 2 % too high", '"exponent": exponent', '"exponent": 1.02 * exponent'
    ),
    materials("roughness weighs 2 % too much", '"weight": weight}', '"weight": 1.02 * weight}'),
    lights(
        "emission 2 % too bright",
        "radiance = np.array(block.emission)",
        "radiance = 1.02 * np.array(block.emission)",
        f"{LIGHTS}::test_shapes_that_shine",
    ),
    lights(
        "spot's angle 2 % too wide",
        '"cutoff_angle": w',
        '"cutoff_angle": 1.02 * w',
        f"{LIGHTS}::test_spot_ramp",
    ),
    lights(
        "spot's intensity 2 % too high",
        '"intensity": rgb(math.pi',
        '"intensity": rgb(1.02 * math.pi',
        f"{LIGHTS}::test_spot_attenuation",
    ),
    lights(
        "beam's irradiance 2 % too high",
        '"irradiance": rgb(math.pi * emission)',
        '"irradiance": rgb(1.02 * math.pi * emission)',
        f"{LIGHTS}::test_beam_irradiance",
    ),
    lights(
        "infinity light 2 % too bright",
        "rgb(math.pi * factor * emission)",
        "rgb(1.02 * math.pi * factor * emission)",
        f"{LIGHTS}::test_infinity_light",
    ),
    lights(
        "background 2 % too bright",
        "rgb(document.background)",
        "rgb(1.02 * np.array(document.background))",
        f"{LIGHTS}::test_background",
    ),
    domes(
        "image dome 2 % too bright",
        '"scale": block.ibl_texture_coef',
        '"scale": 1.02 * block.ibl_texture_coef',
    ),
    domes(
        "image dome as environment 2 % too bright",
        '"scale": float(scale)}',
        '"scale": 1.02 * float(scale)}',
    ),
    domes("shining picture 2 % too bright", "np.float32(scale)", "np.float32(1.02 * scale)"),
    bumps("bumps 2 % too steep", "SLOPE = 25.5", "SLOPE = 26.01"),
    view("field of view 2 % too wide", "size = 2 * math.tan(", "size = 2.04 * math.tan("),
    view("screen 2 % too wide", "width / distance * aspect,", "1.02 * width / distance * aspect,"),
    view(
        "focus of the lens 2 % too far",
        '"focus_distance": abs(focus)}',
        '"focus_distance": 1.02 * abs(focus)}',
    ),
    # ---- workbench
    estimates("variance of the runs divided by n", "/ ((n - 1) * n)", "/ (n * n)"),
    statistics(
        "standard errors 2 % too small",
        "t = np.divide(d.mean, np.sqrt(d.variance)",
        "t = np.divide(1.02 * d.mean, np.sqrt(d.variance)",
    ),
    statistics(
        "score 2 % too high",
        "return np.sign(t) * z",
        "return 1.02 * np.sign(t) * z",
    ),
    statistics(
        "threshold for twice as many tests",
        "np.expm1(np.log1p(-rate) / tests)",
        "np.expm1(np.log1p(-rate) / (2 * tests))",
    ),
    statistics(
        "intervals 2 % too narrow",
        "(1 - confidence) / 2) * np.sqrt(variance)",
        "(1 - confidence) / 2) * 0.98 * np.sqrt(variance)",
    ),
    statistics(
        "Welch's degrees of freedom 2 % too many",
        "dof = variance**2 / (",
        "dof = 1.02 * variance**2 / (",
    ),
    estimates(
        "noise of a lone picture 2 % too low",
        "noise = np.maximum(sums / count - explained, 0)",
        "noise = 0.96 * np.maximum(sums / count - explained, 0)",
        f"{STATISTICS}::test_noise_of_a_lone_picture",
    ),
    statistics(
        "ratio's interval without the reference's noise",
        "r**2 * b.variance",
        "0 * b.variance",
        f"{STATISTICS}::test_ratio_and_its_interval",
    ),
    measures(
        "relMSE 2 % too high",
        "return float((square * w).mean())",
        "return float((1.02 * square * w).mean())",
    ),
    measures(
        "debiasing takes off 2 % too much",
        "(square - reference.pixels.variance)",
        "(square - 1.02 * reference.pixels.variance)",
    ),
    measures(
        "efficiency 2 % too high", "return 1 / (mse * seconds)", "return 1.02 / (mse * seconds)"
    ),
]
