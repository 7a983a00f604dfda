"""From a scene file to a loaded Mitsuba scene: the steps that all entry points share."""

from __future__ import annotations

import dataclasses
import os
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, overload

import mitsuba as mi
import numpy as np

from relume import llvm, mitsuba_files, translator
from relume.inputs import Inputs, file_names
from relume.mitsuba_files import MitsubaFile, is_mitsuba_file
from relume.options import RenderOptions, kind_of
from relume.sensors.pixelsamples import TENT_OF_A_PIXEL
from relume.session import (
    CannotRender,
    Integrator,
    Scene,
    Session,
    check_cameras,
    reason,
    set_variant,
    thread_count,
    variant_context,
)
from relume.translator import Document, Translation, files_read
from relume.translator.diagnostics import SceneError
from relume.translator.media import with_method
from relume.translator.plan import (
    METROPOLIS,
    RenderPlan,
    paths_of_chains,
    samples,
    with_samples,
)
from relume.turns import alone

FALLBACK = "scalar_rgb"
"""Variant for machines without a usable LLVM library."""

STAND_INS = {"surfacepath": "volpath", "randomwalk": "volpathmis"}
"""What scalar variants run in the place of our plugins; lamps with a mask shine in full there."""

SUBSURFACE = ("dipole", "randomwalk")
"""Integrators that subsurface scattering is translated for when they are asked for: by diffusion,
and simulated."""

MERGING = {"merge_radius": 0.5}
"""Parameters of `bdpt` that finds light which mirrors or glass hide from both ends."""

VARIATIONS = {"bdpt-merging": ("bdpt", MERGING)}
"""Names of integrators with parameters, which users can ask for: plugin ids and parameters."""

SceneSource = str | os.PathLike[str] | Document
"""What is rendered: the path of a scene file or Mitsuba scene (.xml), or what `relume.read`
returned."""

Source = Document | MitsubaFile
"""What a file says, before it is translated."""


def source_of(scene: SceneSource, options: RenderOptions | None = None) -> Source:
    """What the file of a scene says, or the document itself.

    Args:
        scene: a path, or a document.
        options: their folders hold files that a Mitsuba scene names.

    Raises:
        SceneError: errors of the file.
        CannotRender: a Mitsuba scene cannot be read.
        TypeError: it is neither a path nor a document.
    """
    if isinstance(scene, Document):
        return scene
    if isinstance(scene, str | os.PathLike):
        if is_mitsuba_file(scene):
            return mitsuba_files.read(scene, (options or RenderOptions()).asset_path)
        return translator.read(scene)
    found = kind_of(scene)
    foreign = isinstance(scene, dict) or found.startswith("mitsuba.")
    raise TypeError(
        f"expected the path of a scene file, or what relume.read returned, found {found}"
        + ("; a scene of Mitsuba's own is rendered by mi.render" if foreign else "")
    )


@overload
def resized(
    document: Document, size: tuple[int, int] | None = None, spp: int | None = None
) -> Document: ...


@overload
def resized(
    document: Source, size: tuple[int, int] | None = None, spp: int | None = None
) -> Source: ...


def resized(
    document: Source, size: tuple[int, int] | None = None, spp: int | None = None
) -> Source:
    """A scene with another size of picture and number of samples.

    Raises:
        ValueError: out of range.
        TypeError: no whole numbers.
        CannotRender: the film of a Mitsuba scene has a crop window.
    """
    options = RenderOptions(size=size, spp=spp)
    if isinstance(document, MitsubaFile):
        return document.resized(options.size, options.spp)
    if options.size is not None:
        document = dataclasses.replace(document, image=options.size)
    if options.spp is not None:
        document = with_samples(document, options.spp)
    return document


def translated(scene: SceneSource, options: RenderOptions) -> Translation:
    """The translation of a scene with the size, samples, dialect and folders of options.

    Raises:
        SceneError: errors of the file, and missing files.
        TypeError: the scene is neither a path nor a document.
    """
    source = resized(source_of(scene, options), options.size, options.spp)
    return translation_of(source, options)


def translation_of(source: Source, options: RenderOptions) -> Translation:
    """The translation of what a file says with the dialect and folders of options.

    Raises:
        SceneError: missing files.
        ValueError: a Mitsuba scene, and a dialect.
    """
    if isinstance(source, MitsubaFile):
        return source.translation(options)
    if options.integrator in SUBSURFACE:
        source = with_method(source, dipole=options.integrator == SUBSURFACE[0])
    return translator.translate(source, options.dialect, options.asset_path, options.stand_ins)


def samples_of(source: Source) -> int:
    """Samples of a pixel that a file asks for."""
    return source.spp if isinstance(source, MitsubaFile) else samples(source)


def translated_with_inputs(
    scene: SceneSource, options: RenderOptions
) -> tuple[Translation, Inputs]:
    """The translation of a scene, as `translated`, and the files that it reads."""
    with files_read.recorded() as read:
        translation = translated(scene, options)
    named = file_names(translation.scene)
    return translation, Inputs([translation.document.path, *read, *named])


def inputs_of(document: Document) -> Inputs:
    """The files that a document reads, as far as they are told if others are missing."""
    named: Iterable[str] = ()
    with files_read.recorded() as read, suppress(SceneError):
        named = file_names(translated(document, RenderOptions()).scene)
    return Inputs([document.path, *read, *named])


# ---- variants


def usable_variant(plan: RenderPlan, wanted: str | None = None) -> str:
    """The variant to render a plan with on this machine.

    Args:
        plan: the scene's plan.
        wanted: the variant asked for, or None.

    Raises:
        CannotRender: the variant does not exist, or is scalar where the scene needs plugins that
            scalar variants do not run.
    """
    name = wanted or plan.variant
    if name not in mi.variants():
        raise CannotRender(f"unknown variant '{name}'; Mitsuba has {', '.join(mi.variants())}")
    library = llvm.install()
    needed = [plugin for plugin in plan.plugins if plugin not in STAND_INS]
    if name.startswith("llvm") and not library.usable:
        if wanted or needed or plan.variant != "llvm_ad_rgb":
            needs = f" and the scene needs {', '.join(needed)}" if needed else ""
            raise CannotRender(f"{name} does not work here{needs}: {library.reason}")
        warnings.warn(f"rendering slowly with {FALLBACK}: {library.reason}", stacklevel=2)
        return FALLBACK
    if name.startswith("scalar") and needed:
        raise CannotRender(f"{name} does not run the plugins of this scene: {', '.join(needed)}")
    return name


def settle_variant(plan: RenderPlan, wanted: str | None = None) -> None:
    """Set the variant for a scene that stays loaded, unless one is set that renders it as planned.

    Args:
        plan: the scene's plan.
        wanted: the variant asked for, which is set whatever was set before; or None.

    Raises:
        CannotRender: the variant that is set renders the scene wrongly, or not at all.
    """
    current = mi.variant()
    if wanted or not current:
        set_variant(usable_variant(plan, wanted))
        return
    remedy = f"call mi.set_variant('{plan.variant}') before"
    try:
        usable_variant(plan, current)
    except CannotRender as error:
        raise CannotRender(f"{error}; {remedy}") from None
    if "spectral" in plan.variant and "spectral" not in current:
        raise CannotRender(
            f"the scene needs wavelengths ({plan.reasons['variant']}), which {current} does not "
            f"have; {remedy}, or ask for variant='{current}' to do without"
        )


@contextmanager
def variant_and_threads(translation: Translation, wanted: str | None = None) -> Iterator[None]:
    """Context in which the variant of a translated scene and its number of threads are set.

    Both are the process's, so other threads wait.

    Args:
        translation: the translated scene.
        wanted: variant instead of the planned one.

    Raises:
        CannotRender: the variant does not work here.
    """
    with (
        alone(),
        variant_context(usable_variant(translation.plan, wanted)),
        thread_count(translation.document.thread),
    ):
        yield


# ---- loading


@contextmanager
def open_session(
    translation: Translation,
    options: RenderOptions | None = None,
    per_pass: int | None = None,
    scene: Scene | None = None,
) -> Iterator[Session]:
    """Context in which a translated scene is loaded under its variant and ready to render.

    Args:
        translation: the translated scene, see `translated`.
        options: their seed, integrator, variant and sampler are used.
        per_pass: as `Session`.
        scene: the scene, if it is loaded already under the variant of the options.

    Yields:
        The `Session`.

    Raises:
        CannotRender: the variant or integrator does not work here, or Mitsuba refuses the scene.
    """
    options = options or RenderOptions()
    with variant_and_threads(translation, options.variant):
        scene = scene or load_scene(translation)
        integrator = None
        if options.integrator:
            integrator = load_integrator(options.integrator, translation.scene["integrator"])
        spp, seed = translation.plan.spp, options.seed
        yield Session(scene, spp, seed, integrator, per_pass=per_pass, sampler=options.sampler)


def load_scene(translation: Translation) -> Scene:
    """The Mitsuba scene of a translation; a variant must be set.

    Raises:
        CannotRender: Mitsuba does not take it, such as for numbers beyond single precision, or its
            camera has no rays.
    """
    shapes = [entry.get("type") for entry in translation.scene.values() if isinstance(entry, dict)]
    # Mitsuba 3.9 merges rectangles of one BSDF into a mesh without a bounding box. Lights at
    # infinity then are looked for within a sphere that is too small, and shine through walls.
    safe = shapes.count("rectangle") < 2
    integrator = for_variant(translation.scene["integrator"])
    translation = dataclasses.replace(
        translation, scene=translation.scene | {"integrator": integrator}
    )
    try:
        scene = mi.load_dict(translation.dictionary(), optimize=safe)
    except (RuntimeError, TypeError) as error:
        raise CannotRender(f"Mitsuba does not take the scene: {reason(error)}") from error
    check_cameras(scene, translation.document.path)
    return scene


def for_variant(integrator: dict[str, Any]) -> dict[str, Any]:
    """An integrator's dictionary with what the variant in use runs in the place of our plugins."""
    if not mi.variant().startswith("scalar") and not mi.is_polarized:
        return integrator
    nested = {key: for_variant(x) for key, x in integrator.items() if isinstance(x, dict)}
    kind = integrator.get("type", "")
    return integrator | nested | {"type": STAND_INS.get(kind, kind)}


def load_integrator(name: str, planned: dict[str, Any]) -> Integrator:
    """An integrator by its name; arguments and errors as `integrator_entry`."""
    return mi.load_dict(integrator_entry(name, planned))


def integrator_entry(name: str, planned: dict[str, Any]) -> dict[str, Any]:
    """The dictionary of an integrator by its name; a variant must be set.

    Args:
        name: plugin id, or one of `VARIATIONS`.
        planned: dictionary of the integrator that has the scene's path depths; a Metropolis
            integrator takes its paths from it.

    Returns:
        A dictionary with these depths, as far as the integrator takes them; `bdpt` keeps the
        scene's factor of the radiance.

    Raises:
        CannotRender: there is no such integrator.
    """
    paths = planned.get("paths", planned)
    if paths.get("type") == "samplescale" and name in ("bdpt", *VARIATIONS):
        nested = integrator_entry(name, paths["integrator"])
        return paths | {"luminance_limit": 0.0, "integrator": nested}
    if name in VARIATIONS:
        kind, own = VARIATIONS[name]
        return integrator_entry(kind, planned) | own
    if name == paths.get("type"):
        return paths
    if name in METROPOLIS:
        return {"type": name, "paths": paths_of_chains(paths)}
    depths = {"max_depth": -1} | {key: paths[key] for key in ("rr_depth",) if key in paths}
    errors = []
    for parameters in (depths, {"max_depth": -1}, {}):
        entry = {"type": name} | parameters
        try:
            made = mi.load_dict(entry)
        except RuntimeError as error:
            errors.append(reason(error))
            continue
        if isinstance(made, mi.Integrator):
            return entry
        errors.append("it is no integrator")
        break
    raise CannotRender(f"integrator '{name}': {errors[-1]}")


def for_mitsuba(translation: Translation, options: RenderOptions | None = None) -> Translation:
    """The translation, with what `mi.render` needs to give the picture that `relume.render` gives.

    That is the number of samples, as far as a sampler can count, and a tent that is a little wider:
    Mitsuba takes one of half-width 0.5 for a box.

    Args:
        translation: the translated scene.
        options: their seed and integrator are put into the scene; a variant must be set for the
            latter.

    Raises:
        CannotRender: there is no such integrator.
    """
    options = options or RenderOptions()
    scene, sensor = dict(translation.scene), dict(translation.scene["sensor"])
    sensor["sampler"] = sensor["sampler"] | {"sample_count": min(translation.plan.spp, 2**32 - 1)}
    if options.seed:
        # Samplers take 32 bits.
        sensor["sampler"]["seed"] = int(np.random.SeedSequence(options.seed).generate_state(1)[0])
    if translation.document.tent_filter:
        rfilter = sensor["film"]["rfilter"] | {"radius": TENT_OF_A_PIXEL}
        sensor["film"] = sensor["film"] | {"rfilter": rfilter}
    scene["sensor"] = sensor
    if options.integrator:
        scene["integrator"] = integrator_entry(options.integrator, scene["integrator"])
    if mi.variant():
        scene["integrator"] = for_variant(scene["integrator"])
    return dataclasses.replace(translation, scene=scene)
