"""Errors of lights that tests have to find."""

from studies.mutations import of

SPOT, BEAM = "emitters/test_falloffspot.py", "emitters/test_parallelbeam.py"
AREA, DOME = "emitters/test_twosidedarea.py", "emitters/test_ibldome.py"

spot = of("emitters/falloffspot.py", SPOT)
beam = of("emitters/parallelbeam.py", BEAM)
surface_rays = of(
    "emitters/common.py",
    f"{AREA}::test_power_of_the_particles",
    f"{DOME}::test_power_of_the_particles",
)
area = of("emitters/twosidedarea.py", f"{AREA}::test_shines_where_a_stock_area_light_is_black")
dome = of("emitters/ibldome.py", f"{DOME}::test_sampling_density")
dome_maps = of("emitters/dome_sampling.py", f"{DOME}::test_sampling_density")
sun = of("emitters/domesun.py", "emitters/test_domesun.py")
dome_formulas = of("relume/dome_maps.py", "relume/test_dome_maps.py")

LIGHTS = [
    sun(
        "sun in a dome 2 % too bright",
        "dr.select(lit, self.irradiance.eval(si, lit), 0)",
        "dr.select(lit, 1.02 * self.irradiance.eval(si, lit), 0)",
    ),
    sun(
        "particles of the sun in a dome 2 % too bright",
        "mi.depolarizer(weight * dr.pi",
        "mi.depolarizer(1.02 * weight * dr.pi",
    ),
    sun(
        "sun 2 % beyond its dome",
        "- MARGIN * self.radius",
        "+ 0.02 * self.radius",
    ),
    spot(
        "spot 2 % too bright, where it is sampled",
        "weight = self._ramp(self._inside",
        "weight = 1.02 * self._ramp(self._inside",
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
        "angles = (self.cutoff_angle,",
        "angles = (1.02 * self.cutoff_angle,",
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
        "emitters/test_dome_sampling.py::test_every_direction_meets_the_nearest_texel",
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
        "emitters/test_dome_sampling.py::test_every_direction_meets_the_nearest_texel",
    ),
]
