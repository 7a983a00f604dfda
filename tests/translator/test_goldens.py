"""Translated scenes against committed ones: a change of the translation shows as a difference here.

After a change that is meant, look at what it does and write the goldens anew::

    RELUME_WRITE_GOLDENS=1 .venv/bin/python -m pytest tests/translator/test_goldens.py
    git diff tests/translator/goldens

Each golden holds the scene's text, its dictionary of plain values (numbers to nine digits) and the
outcome of each line.
"""

import json
import os
from pathlib import Path

import pytest

from relume.translator import read_text, translate

GOLDENS = Path(__file__).parent / "goldens"

HEAD = "IMAGE\n64 48\nSAMPLING\n4\nCAMERA_POS\n0 1 10\nCAMERA_DIR\n0 0 -1\n"

SCENES = {
    "shapes": HEAD + """OBJECT
sphere 1 2 3 0.5
color 0.1 0.2 0.3
reflection diffuse

OBJECT
hemisphere 0 0 0 2
color 1 1 1
reflection diffuse
normal -1

OBJECT
uvplane -1 0 0
U 2 0 0
V 0 0 3
color 0.5 0.5 0.5
reflection diffuse

OBJECT
uvplane -1 0 0
U 2 0 0
V 1 0 3
color 0.5 0.5 0.5
reflection diffuse

OBJECT
plane 0 -1 0
normal 0 2 0
color 0.5 0.5 0.5
reflection diffuse

OBJECT
disk 0 1 0 2
nromal 0 0 1
color 0.5 0.5 0.5
reflection diffuse
""",
    "transforms": HEAD + """OBJECT
sphere 1 0 0 1
scale 2 2 2
rotation 0 90 0
translate 0 1 0
color 1 1 1
reflection diffuse

OBJECT
uvplane 0 0 0
U 1 0 0
V 0 1 0
scale -1 1 1
rotation 0 0 90
color 1 1 1
reflection diffuse
""",
    "materials": HEAD + """OBJECT
sphere 0 0 0 1
color 0.9 0.8 0.7
reflection specular

OBJECT
sphere 2 0 0 1
color 0.9 0.8 0.7
reflection diffuse
roughness 0.25

OBJECT
sphere 4 0 0 1
color 0.9 0.8 0.7
reflection reflection
refractive_index 1.33

OBJECT
sphere 6 0 0 1
color 0.4 0.4 0.4
specular 0.5 0.5 0.5
reflection ward_brdf
ward_brdf 0.5 0.8 0.1 0.3

OBJECT
sphere 8 0 0 1
color 0.4 0.4 0.4
specular 0.5 0.5 0.5
reflection phong_brdf
phong_brdf 0.5 0.8 40

OBJECT
sphere 10 0 0 1
color 2 0 0
""",
    "dispersion": HEAD + """OBJECT
sphere 0 0 0 1
color 1 1 1
reflection reflection1
3.5139564 -2.4812508E-2 4.6252559E-2 9.1313596E-3 1.0777108E-3 1.0819677E-4

OBJECT
sphere 2 0 0 1
color 1 1 1
reflection reflection99
""",
    "lights": HEAD + """BACKGROUND
0.1 0.2 0.3
OBJECT
sphere 0 5 0 1
emission 1 2 3
reflection diffuse

OBJECT
uvplane 0 0 0
U 1 0 0
V 0 0 1
emission 1 1 1
normal -1
reflection diffuse

OBJECT
infinity_light 0 -2 0
emission 1 1 1
reflection diffuse

OBJECT
uvplane 0 4 0
U 1 0 0
V 0 0 1
emission 1 1 1
parallel_light 1
parallel_light_dir 0 -1 1
reflection diffuse

OBJECT
sphere 0 4 0 0.1
emission 1 1 1
spot_light 1
spot_light_dir 0 -3 0
spot_light_angle 20 10
spot_light_falloff 0
spot_attenuation 0 1 0
reflection diffuse
""",
    "camera": """IMAGE
100 50
CAMERA_POS
1 2 3
TARGET_POS
4 5 -6
CAMERA_ANGLE
60
CAMERA_MATRIX
rotation 0 0 30
translate 0 1 0

LENS
0.5 10
tentfilter
1
DEPTH
3
sensor_response
2
luminance_cutoff
0.5
""",
    "room": HEAD + """OBJECT
sphere 0 -1e5 0 1e5
color 0.5 0.5 0.5
reflection diffuse

OBJECT
sphere 0 0 -1e9 1e9
color 0.5 0.5 0.5
reflection diffuse

OBJECT
sphere 0 1 0 1
emission 1 1 1
reflection diffuse
""",
    "media": HEAD + """BACKGROUND
1 1 1
participatingMedia
1
SCATTERING
0
0.1 0.1 0.1
PAHASE 0.5 0 -1

OBJECT
sphere 0 0 0 1
color 1 1 1
reflection reflection
reflection Subsurface_Scattering
BSSRDF
0
MATERIAL_SYMBOL
Ketchup
MATERIAL_SCALE
2

OBJECT
sphere 3 0 0 1
color 2 1 0.5
specular 0.5 0.5 0.5
reflection ward_brdf
ward_brdf 0.5 1 0.1 0.2
reflection Subsurface_Scattering
refractive_index 1.3
BSSRDF
0
level
0
ABSORBING
0
1 0 2
""",
    "dipole": HEAD + """OBJECT
sphere 0 0 0 1
color 1 1 1
reflection reflection
reflection Subsurface_Scattering
MATERIAL_SYMBOL
Coke

OBJECT
sphere 3 0 0 1
color 2 1 0.5
reflection diffuse
reflection Subsurface_Scattering
refractive_index 1.3
SCATTERING
0
1 2 3
level
-2
MATERIAL_R_MAX
2
""",
    "metropolis": HEAD + """metropolisTransport
1
mutation
5
mlt_sample
3
mlt_resampling
1
sensor_response
2
""",
    "redistribution": HEAD + """energyRedistributionPathTracing
1
mutation
20
""",
    "hole": HEAD + """velocity
0 0 0.5
special_relativity_effects
1
color_doppler_factor_effect
0.5
use_mollweide_projection
1

OBJECT
sphere 3 0 0 1
emission 1 2 3

BLACKHOLE
dist 30
angular_momentum 0.9
geodesics_max_length 500
""",
    "wormhole": HEAD + """BACKGROUND
0.1 0.2 0.3

OBJECT
sphere 0 0 0 1
emission 1 1 1

OBJECT
sphere 0 1e7 0 1
emission 2 2 2

WORMHOLE
in 0 3 0
out 0 1e7+3 0
Rho 0.7
a -0.25
""",
    "mouths": HEAD + """OBJECT
plane 0 -1 0
normal 0 1 0
color 0.5 0.5 0.5
reflection diffuse

OBJECT
sphere 0 3 0 1
emission 1 1 1
reflection diffuse

WORMHOLE
in 2 0 0
out -2 0 0
Rho 0.5
""",
    "unsupported": HEAD + """participatingMedia
1
SCATTERING
0
1 1 1

BLACKHOLE 0 0 0
dist 5
""",
}


def summary(value):
    """Meshes of more than a few faces shrink to their size, their box and a sum of positions."""
    if isinstance(value, dict) and "vertices" in value and len(value["faces"]) > 8:
        vertices = value["vertices"]
        columns = list(zip(*vertices, strict=True))
        return {
            "vertices": len(vertices),
            "faces": len(value["faces"]),
            "low": [float(f"{min(c):.6g}") for c in columns],
            "high": [float(f"{max(c):.6g}") for c in columns],
        }
    if isinstance(value, dict):
        return {key: summary(item) for key, item in value.items()}
    return value


def translated(text, plain):
    """What a golden holds for a scene."""
    translation = translate(read_text(text, environ={}))
    reports = translation.document.lines.all
    lines = [[r.line, r.keyword, r.outcome, r.note, list(r.codes)] for r in reports]
    return {
        "text": text.split("\n"),
        "scene": summary(plain(translation.scene)),
        "plan": translation.plan.as_dict(),
        "lines": [line for line in lines if line[2:4] != ["translated", ""]],
    }


@pytest.mark.parametrize("name", SCENES)
def test_goldens(name, plain):
    """The translation of a small scene is the committed one."""
    found = translated(SCENES[name], plain)
    path = GOLDENS / f"{name}.json"
    if os.environ.get("RELUME_WRITE_GOLDENS"):
        text = json.dumps(found, indent=1, ensure_ascii=False)
        path.write_text(text + "\n", encoding="utf-8")
    wanted = json.loads(path.read_text(encoding="utf-8"))
    assert set(found["scene"]) == set(wanted["scene"])
    for key, value in found["scene"].items():
        assert value == close(wanted["scene"][key]), key
    assert found == close(wanted)


def close(value):
    """A golden whose numbers compare to a relative 1e-6 and an absolute 1e-9."""
    if isinstance(value, dict):
        return {key: close(item) for key, item in value.items()}
    if isinstance(value, list):
        return [close(item) for item in value]
    return pytest.approx(value, rel=1e-6, abs=1e-9) if isinstance(value, float) else value


def test_no_golden_is_left_over():
    """Each file in the folder belongs to a scene."""
    assert {path.stem for path in GOLDENS.glob("*.json")} == set(SCENES)
