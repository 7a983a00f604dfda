"""Outcomes of the lines of objects: shapes, surfaces, lights, pictures, media."""

from relume.translator.outcome_rows import table

BOUNDARY = (
    "Light enters and leaves through smooth glass: an opaque surface would let none in."
)

SHAPES = (
    ("giant-sphere-flat", "translated", "6.1",
     "giant sphere made of a flat patch, at most {off:.2g} off the sphere",
     "What the scene can see of the sphere is flat within single precision. As a sphere it would "
     "hit its own rays and darken the picture by a tenth.", "Nothing to do."),
    ("giant-sphere-patch", "translated", "6.1",
     "giant sphere made of {count} triangles, at most {off:.2g} off the sphere where the scene can "
     "see it",
     "The part that the scene can see is made of triangles: as a sphere it would hit its own rays "
     "and darken the picture by a tenth.", "Nothing to do."),
    ("giant-sphere-whole", "translated", "6.1",
     "giant sphere made of {count} triangles, at most {off:.2g} off the sphere",
     "The sphere is made of triangles, finer near the camera: as a sphere it would hit its own "
     "rays and darken the picture by a tenth.", "Nothing to do."),
    ("ellipsoid", "approximated", "6.3", "an ellipsoid, tessellated",
     "A sphere scaled unevenly is made of triangles with the true normals: shading is smooth, the "
     "outline is a polygon.", "Scale all axes alike to keep the exact sphere."),
    ("hemisphere", "approximated", "6.1",
     "a dome of {segments} segments, at most {off:.1g} of the radius off the sphere",
     "Triangles with the true normals: shading is smooth, the outline is a polygon.",
     "Nothing to do; a `sphere` is exact where the other half does no harm."),
    ("tessellated-disk", "approximated", "6.1", "a disk of {segments} segments",
     "A textured or unevenly scaled disk is made of triangles; its edge is a polygon.",
     "Nothing to do: the edge is off by less than a pixel in most pictures."),
    ("tessellated-ring", "approximated", "6.1", "a ring of {segments} segments",
     "The ring is made of triangles; its edges are polygons.",
     "Nothing to do: the edges are off by less than a pixel in most pictures."),
    ("infinite-plane", "translated", "6.1", "infinite plane: a square of side {side:g}",
     "The plane ends far beyond everything else, within half a degree of the horizon.",
     "Nothing to do."),
    ("infinite-plane-edge", "translated", "6.1",
     "infinite plane: a square of side {side:g}, whose edge lies {edge:.1g} degrees below the "
     "horizon",
     "The camera is so high above the scene that it sees where the plane ends.",
     "Lower the camera, or put an object far away that makes the scene as wide as the view."),
    ("infinite-plane-coarse", "translated", "6.1",
     "single precision: points on it are off by up to {off:.1g}",
     "Shadows and reflections close to the plane may be patchy: the scene is wide and the camera "
     "close to the plane.", "Make the far objects nearer, or raise the camera."),
    ("thin-glass", "translated", "8.4",
     "single precision: glass {thickness:.2g} thick, rays miss what is nearer than {least:.2g}",
     "Rays may leave the glass without meeting its far side, and are then refracted only once.",
     "Make the glass thicker, or move the scene to the origin."),
    ("mesh-not-closed", "approximated", "10.2",
     "the mesh is not closed: {count} edges have no second face, light leaks there",
     "Light leaves the medium through the gaps, or is taken to be inside where it is not.",
     "Close the mesh."),
)  # fmt: skip

SURFACES = (
    ("attribute-unused", "ignored", "8", "a surface of kind {kind} has no use for it",
     "No effect on the picture: another `reflection` line decides on the surface.",
     "Delete the line, or change `reflection` to the surface that it belongs to."),
    ("roughness-without-reflection", "ignored", "8.1",
     "without a reflection line the surface is diffuse",
     "The surface is diffuse.", "Add `reflection diffuse` above the line."),
    ("roughness-of-phong", "ignored", "8.6",
     "phong-diffuse: rho_d colour / pi + lobe, as the manual; the program: diffuse weight "
     "`roughness`",
     "Both parts of Phong's reflection count in full: `roughness` does not weigh them.",
     "`--dialect prender` follows the program here, to match an old picture."),
    ("color-above-one", "translated", "8", "above 1: not energy conserving, kept as written",
     "The surface reflects more light than it gets; between two of them light may grow without "
     "end.", "Use values up to 1."),
    ("color-cut-off", "translated", "10.2",
     "above 1: cut off at 1, or light would grow at each crossing",
     "The colour is 1 where it is above 1.", "Use values up to 1."),
    ("color-near-one", "translated", "8",
     "nearly 1: in a room of such surfaces roulette leaves noise that hardly falls",
     "Single bright pixels in closed rooms, which more samples hardly take away.",
     "Use a reflectance of at most 0.97, as real surfaces have."),
    ("index-zero", "translated", "8.4", "0 read as 1.5",
     "The index of refraction is 1.5, as in the original program.", "Write the index."),
    ("index-from-dispersion", "ignored", "8.7", "the dispersion formula gives the index",
     "The index follows the wavelength.", "Delete the line."),
    ("texture-replaces-color", "ignored", "11.2", "texture takes its place",
     "The picture is shown without the colour.", "Delete one of the two lines."),
    ("no-texture", "ignored", "11.2", "there is no texture", "No effect on the picture.",
     "Give a `texture` to use it."),
    ("no-texture-on-plane", "ignored", "11.2", "an infinite plane has no texture",
     "The plane shows its colour, as in the original program.", "Use a `uvplane`."),
    ("map-without-sphere", "ignored", "11.5", "only pictures on spheres and hemispheres have maps",
     "The picture lies on the surface by the coordinates of its shape.",
     "Put the picture on a `sphere` or `hemisphere`."),
    ("map-without-picture", "ignored", "11.5", "there is neither texture nor ibl_texture",
     "No effect on the picture.", "Give a `texture` or an `ibl_texture` to use it."),
    ("disk-map-without-disk", "ignored", "11.3", "the object is no disk",
     "No effect on the picture.", "Use a `disk` or `disk2`."),
    ("disk-map-shines", "ignored", "11.3", "a disk with disk_map shines alone",
     "What is cut out of the disk reflects nothing.", "Set `emission` to the colour it shows."),
    ("background-not-plane", "ignored", "7", "only planes and disks can be backgrounds",
     "The object is shown lit.", "Use a `plane`, `uvplane` or `disk`."),
    ("backdrop-black", "approximated", "7",
     "black to other surfaces: there is a medium in the scene",
     "The object shows its unlit colour; the light that it would reflect to other surfaces is "
     "missing.", "Remove the media, if that light matters."),
    ("only-planes-catch-shadows", "ignored", "11.7", "only planes can catch shadows",
     "The object is shown as without the line.", "Use a `plane` or `uvplane`."),
    ("no-image-based-light", "ignored", "11.7", "there is no image-based light",
     "The plane is shown as without the line.", "Add an object with `ibl_texture`."),
    ("no-mesh", "ignored", "7", "the object is no mesh",
     "No effect on the picture: its normals are smooth already.", "Delete the line."),
)  # fmt: skip

LIGHTS = (
    ("lamp-not-shown", "approximated", "9.3", "the lamp itself is not shown",
     "A spot or a parallel light shines, but the sphere or parallelogram that carries it is "
     "neither seen nor hit by light.",
     "Add an object of the same shape with `emission` if the lamp is to be seen; it must not "
     "stand in the way of the light."),
    ("emits-inwards", "translated", "9.2", "the sphere emits inwards, towards the camera",
     "The camera is inside the sphere, whose inner side shines.", "Nothing to do."),
    ("emits-outwards", "translated", "9.2", "the sphere emits outwards",
     "The outer side shines though `normal` is below 0: the camera is outside.",
     "Nothing to do."),
    ("emits-and-reflects", "translated", "9.1", "emits and reflects",
     "The object shines and reflects, too.", "Set `color` to 0 if it is to shine alone."),
    ("only-uvplane-parallel-light", "ignored", "9.3", "only a uvplane can be a parallel light",
     "The object is an ordinary one, which shines to all sides if it has an `emission`.",
     "Use a `uvplane`."),
    ("no-parallel-light", "ignored", "9.3", "parallel_light is 0", "No effect on the picture.",
     "Set `parallel_light` to 1 to use it."),
    ("only-sphere-spot", "ignored", "9.5", "only a sphere can be a spot light",
     "The object is an ordinary one, which shines to all sides if it has an `emission`.",
     "Use a `sphere`; its centre is where the light comes from."),
    ("no-spot", "ignored", "9.5", "the object is no spot light", "No effect on the picture.",
     "Set `spot_light` to 1, on a sphere, to use it."),
    ("no-ibl-texture", "ignored", "11.5", "there is no ibl_texture", "No effect on the picture.",
     "Give an `ibl_texture` to use it."),
    ("bytes-are-linear", "translated", "11.5", "values of 0 to 255 are taken as linear",
     "The light of such a picture reaches from 0 to 1 and has no bright sun, as in the original "
     "program.", "Use a picture of high dynamic range (.hdr, .exr, .pfm)."),
    ("dome-by-direction", "approximated", "11.5",
     "an environment map, looked up by direction, so that infinity_light passes",
     "The dome seems infinitely far: what is reflected or seen of it does not shift with the "
     "place.", "Delete the `infinity_light`, or make the dome far larger than the scene."),
    ("dome-far", "translated", "11.5",
     "the dome is far: an environment map, looked up at most {degrees:.2g} degrees off",
     "The same picture but for that angle, with less noise.", "Nothing to do."),
)  # fmt: skip

MEDIA = (
    ("medium-everywhere", "ignored", "10.1", "a medium fills all space outside objects",
     "The medium is the same on both sides of open surfaces.", "Nothing to do."),
    ("no-subsurface", "ignored", "10.2", "the object has no subsurface scattering",
     "No effect on the picture.",
     "Add `reflection Subsurface_Scattering` below the `reflection` line."),
    ("one-index", "ignored", "10.2", "refractive_index serves the dipole, too",
     "The dipole takes the index of `refractive_index`.", "Delete the line."),
    ("replaced-by-material", "ignored", "10.3", "MATERIAL_SYMBOL below sets it anew",
     "The measured material's values count.", "Put the line below `MATERIAL_SYMBOL`."),
    ("index-from-material", "ignored", "10.3", "MATERIAL_SYMBOL sets the index",
     "The measured material's index counts.", "Put the line below `MATERIAL_SYMBOL`."),
    ("all-orders", "approximated", "10.2", "scattering of every order is followed",
     "Brighter than a picture of so few orders, and as bright as the real material.",
     "Use `level -1`, which asks for just this."),
    ("simulated-in-medium", "approximated", "10.2",
     "simulated instead: there is a medium around all objects",
     "The light inside is followed from scattering to scattering instead of by the dipole: more "
     "noise, and the exact result.",
     "Set `participatingMedia` to 0 to have the dipole."),
    ("simulated-by-wavelength", "approximated", "10.2",
     "simulated instead: wavelengths matter in the scene",
     "The light inside is followed from scattering to scattering instead of by the dipole: more "
     "noise, and the exact result.",
     "Use glass without dispersion, or `--dialect prender`, to have the dipole."),
    ("simulated-with-another", "approximated", "10.2",
     "simulated instead: another object of the scene asks for the simulation",
     "The light inside is followed from scattering to scattering instead of by the dipole: more "
     "noise, and the exact result.",
     "Set `BSSRDF` to 1 in all objects to have the dipole."),
    ("smooth-glass-boundary", "approximated", "10.2",
     "sss-base: smooth glass, no light would enter through this surface", BOUNDARY,
     "Use `reflection reflection` above `reflection Subsurface_Scattering`, which asks for it."),
    ("rough-glass-boundary", "approximated", "10.2",
     "sss-base: rough glass of the same width of reflection",
     "The highlight is as wide as Ward's or Phong's; light enters and leaves through rough glass.",
     "Nothing to do; `reflection reflection` gives smooth glass."),
    ("dipole-boundary", "approximated", "10.2", "sss-base: a smooth boundary", BOUNDARY,
     "Use `reflection reflection` above `reflection Subsurface_Scattering`, which asks for it."),
    ("search-radius", "translated", "10.2",
     "light enters within {radius:.4g} of where it leaves",
     "Light that enters farther away is left out, which darkens: by a tenth to a half at the "
     "manual's radius.", "Delete `MATERIAL_R_MAX` for no limit."),
    ("dipole-alone", "ignored", "10.2", "of use to the dipole alone",
     "No effect on the picture: the light inside is simulated.",
     "Set `BSSRDF` to 1 to have the dipole."),
    ("walks-begin-deep", "approximated", "10.2",
     "single precision: rays start {depth:.2g} mean free paths below the surface: too dark",
     "Light that would leave close to where it enters is lost: about 1 % at 0.02 mean free paths, "
     "a tenth at 0.2.",
     "Lower `MATERIAL_SCALE`, make the object larger, or use the dipole (`BSSRDF` 1)."),
    ("long-walks", "approximated", "13.2",
     "walks of about {count:.2g} scatterings, roulette ends those well beyond DEPTH: too dark, or "
     "noisy",
     "What long walks carry is in so few samples that it is mostly missing from the picture.",
     "Raise DEPTH to about that number, lower the coefficients, or use the dipole."),
)  # fmt: skip

OUTCOMES = table((*SHAPES, *SURFACES, *LIGHTS, *MEDIA))
