"""Defects of the program that no dialect copies, and the scenes that show them."""

from __future__ import annotations

from typing import NamedTuple


class Defect(NamedTuple):
    """A defect: its row in the table of dialects, what the program does, scenes that show it."""

    row: str
    words: str
    scenes: tuple[str, ...]


DEFECTS = (
    Defect("alpha", "alpha of pictures is inverted on spheres and uvplanes",
           ("alpha_sphere", "alpha_uvplane_128")),
    Defect("bump", "bump maps have no effect on meshes", ("mtl_bump_case",)),
    Defect("bump-shapes", "a bump map scales the light, by up to 5", ("bump_uvplane",)),
    Defect("camera-matrix-order", "the direction of view is bent by a translation before others",
           ("cam_mat_tr_rot", "cam_mat_tr_tr")),
    Defect("emission-units-glossy",
           "parallel light on Ward lacks the factor pi; and `ward-nee`", ("ward_parallel_nee",)),
    Defect("fog-sky", "rays that meet nothing pass the medium freely; and `medium-phase`",
           ("med_g-0.6", "med_g0.6")),
    Defect("hemisphere-inside", "the near half of a dome hides its inside from below", ("l_hemi",)),
    Defect("hemisphere-map-integer",
           "half the size of a picture is rounded to whole texels: one texel off",
           ("i43_hemi_px_far", "ibl_hemi_nx", "ibl_hemi_ny", "ibl_hemi_nz", "ibl_hemi_px",
            "ibl_hemi_pz", "iblh_hemi_nz", "iblh_hemi_py", "iblh_hemi_pz")),
    Defect("ibl-hemisphere-u", "u of the picture of a hemisphere is doubled and cut off",
           ("iblh_ang_nz", "iblh_ang_px", "iblh_def_nz", "iblh_def_px", "iblh_def_py",
            "iblh_def_pz", "iblh_equi_nz", "iblh_equi_px", "iblh_pano_nz")),
    Defect("infinity-shadow", "shadows of `infinity_light` shift unless its length is 1",
           ("inf_len", "inf_len05", "l_infinity_len2")),
    Defect("no-reflection-line", "without a reflection line surfaces are mirrors",
           ("no_reflection",)),
    Defect("phong-cosine", "Phong's lobe gains energy", ("mat_phong", "mat_phong_r.5",
           "mtl_KdKs_phong", "mtl_R4", "mtl_R4_noNs")),
    Defect("polygon-corners", "of polygons only the first four corners count", ("obj_ngon",)),
    Defect("sphere-radius-scale", "a scale moves spheres and disks but leaves their size",
           ("disk_xf", "sphere_scale", "sphere_xf")),
    Defect("sphere-rotation", "the angles of a rotation become the centre of a sphere",
           ("sphere_rot",)),
    Defect("sss-energy", "a whole dielectric is rendered beside the dipole", ("sss_dip",)),
    Defect("sss-simulation",
           "light that has entered a simulated inside is 1/n² too dim, if nothing scatters",
           ("lv0_sig_s",)),
    Defect("texture-over-map", "a mesh of two triangles keeps `map_Kd` all the same",
           ("tex_mesh_both",)),
    Defect("ward-nee", "Ward's lobe is darker under next event estimation",
           ("w3_a.3_d_nee", "w3_a.3_nee", "ward_sphere_light_nee")),
)  # fmt: skip
"""All that these scenes show, in the order of the rows."""

ELSEWHERE = (
    ("several-lights", "several lamps are averaged under next event estimation, not added",
     "two equal lamps light a floor as one does: 0.5"),
    ("glass-nee", "under next event estimation lamps seen in glass count without Fresnel's weights",
     "[`area`](references.md), a ball under a lamp 400 x 400: blocks of 0.4 to 2.25"),
    ("roulette", "survivors of roulette are weighted wrongly after DEPTH bounces",
     "[a Cornell box](references.md) at DEPTH 8: 0.99"),
    ("ward-colour", "a colour below `ward_brdf` is not scaled by its weights",
     "`ward_brdf 0.5 1 ...` above `color`: the diffuse part is twice as bright"),
    ("sss-base", "subsurface scattering under a diffuse surface renders black", "0"),
    ("sss-gate", "coefficients are off where the dummy mean is below 1e-6", "a plain surface"),
    ("chicken", "red absorption of Chicken1 and Chicken2 is a tenth", "brighter red"),
    ("medium-phase", "cosines of the phase function are multiplied by g²", "mean cosine g³"),
    ("erpt", "energy redistribution renders noise", "0.02 of the mean"),
)  # fmt: skip
"""Defects that none of these scenes shows alone: row, words, size."""


def defect_of(scene: str) -> Defect | None:
    """The defect that a scene shows."""
    return next((defect for defect in DEFECTS if scene in defect.scenes), None)
