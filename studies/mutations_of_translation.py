"""Errors of translation that tests have to find."""

from studies.mutations import of

LIGHTS, GOLDENS = "translator/test_lights.py", "translator/test_goldens.py"

materials = of("translator/materials.py", GOLDENS)
lights = of("translator/lights.py", LIGHTS)
domes = of("translator/environment_maps.py", "translator/test_environment_maps.py")
bumps = of("translator/bumps.py", "translator/test_bumps.py")
view = of("translator/camera.py", "translator/test_camera.py")

TRANSLATION = [
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
]
