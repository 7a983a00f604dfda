"""Errors of materials that tests have to find."""

from studies.mutations import of

WARD, PHONG = "bsdfs/test_ward.py", "bsdfs/test_phong.py"
GLASS, DISPERSION = "bsdfs/test_schlickglass.py", "bsdfs/test_dispersion.py"
DIPOLE = "integrators/test_dipole.py"
DIFFUSION = "integrators/test_diffusion.py"
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

MATERIALS = [
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
    glass("refraction by an index 2 % too high", "eta = dr.sqrt(far2", "eta = 1.02 * dr.sqrt(far2"),
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
]
