"""What relume does, from Python: read, translate, render."""

import dataclasses
import warnings
from contextlib import contextmanager

import mitsuba as mi
from relume.translator.document import MAX_PIXELS, MAX_SAMPLES, MAX_SIDE
from relume.translator.plan import METROPOLIS, with_samples

from relume import llvm, translator
from relume.session import CannotRender, Session, reason, use_threads, variant

FALLBACK = "scalar_rgb"
"""Variant for machines without a usable LLVM library."""


def read(path, environ=None):
    """Read a scene file.

    Args:
        path: the file.
        environ: environment variables that override the file; by default those of the process.

    Returns:
        The typed `relume.translator.document.Document`.

    Raises:
        SceneError: every error in the file, with line and column.
    """
    return translator.read(path, environ)


def translate(document, *, dialect="manual", asset_path=()):
    """Translate a document into a dictionary for `mi.load_dict`.

    Sets the variant that the scene needs if none is set.

    Args:
        document: what `read` returned, or the path of a scene file.
        dialect: `manual`, or `prender` to match an old picture.
        asset_path: folders in which files that the scene names are looked for.

    Raises:
        SceneError: errors of the file, and missing files.
    """
    translation = translator.translate(_document(document), dialect, asset_path)
    if not mi.variant():
        mi.set_variant(usable_variant(translation.plan))
    return for_mitsuba(translation).dictionary()


def for_mitsuba(translation):
    """The translation, with what `mi.render` needs to give the picture that `render` gives.

    That is the number of samples, as far as a sampler can count, and a tent that is a little wider:
    Mitsuba takes one of half-width 0.5 for a box.
    """
    sensor = translation.scene["sensor"]
    sensor["sampler"]["sample_count"] = min(translation.plan.spp, 2**32 - 1)
    if translation.document.tent_filter:
        sensor["film"]["rfilter"]["radius"] = 0.501
    return translation


def render(
    path_or_document,
    *,
    size=None,
    spp=None,
    seed=0,
    integrator=None,
    variant=None,
    dialect="manual",
    asset_path=(),
):
    """Render a scene.

    Args:
        path_or_document: a scene file, or what `read` returned.
        size: (width, height) in pixels instead of the scene's.
        spp: samples of a pixel instead of the scene's.
        seed: non-negative integer; the same seed gives the same picture, bit for bit.
        integrator: plugin id of an integrator instead of the planned one.
        variant: Mitsuba variant instead of the planned one.
        dialect: `manual`, or `prender` to match an old picture.
        asset_path: folders in which files that the scene names are looked for.

    Returns:
        Linear RGB, array of shape (height, width, 3), float32, top row first.

    Raises:
        SceneError: errors of the file, and missing files.
        CannotRender: the variant or integrator does not work here.
        ValueError: a size, number of samples or seed out of range.
    """
    document = resized(_document(path_or_document), size, spp)
    translation = translator.translate(document, dialect, asset_path)
    with prepared(translation, seed, integrator, variant) as session:
        for _ in session.run():
            pass
        return session.image()


def resized(document, size=None, spp=None):
    """A document with another size of picture and number of samples.

    Raises:
        ValueError: out of range.
    """
    if size is not None:
        width, height = (int(x) for x in size)
        if not (min(width, height) >= 1 and max(width, height) <= MAX_SIDE) or (
            width * height > MAX_PIXELS
        ):
            limit = f"expected sides of 1 to {MAX_SIDE} and at most {MAX_PIXELS} pixels"
            raise ValueError(f"size {width}x{height}: {limit}")
        document = dataclasses.replace(document, image=(width, height))
    if spp is not None:
        if not 1 <= spp <= MAX_SAMPLES:
            raise ValueError(f"spp {spp}: expected 1 to {MAX_SAMPLES}")
        document = with_samples(document, spp)
    return document


def usable_variant(plan, wanted=None):
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
    if name.startswith("llvm") and not library.usable:
        if wanted or plan.plugins or plan.variant != "llvm_ad_rgb":
            needs = f" and the scene needs {', '.join(plan.plugins)}" if plan.plugins else ""
            raise CannotRender(f"{name} does not work here{needs}: {library.reason}")
        warnings.warn(f"rendering slowly with {FALLBACK}: {library.reason}", stacklevel=2)
        return FALLBACK
    if name.startswith("scalar") and plan.plugins:
        raise CannotRender(
            f"{name} does not run the plugins of this scene: {', '.join(plan.plugins)}"
        )
    return name


@contextmanager
def prepared(translation, seed=0, integrator=None, wanted=None):
    """Context in which a translated scene is loaded under its variant and ready to render.

    Args:
        translation: the translated scene.
        seed: seed of the session, 0 or more.
        integrator: plugin id instead of the planned one.
        wanted: variant instead of the planned one.

    Yields:
        The `Session`.

    Raises:
        CannotRender: the variant or integrator does not work here, or Mitsuba refuses the scene.
        ValueError: the seed is negative.
    """
    if seed < 0:
        raise ValueError(f"seed {seed}: expected 0 or more")
    with ready(translation, wanted):
        scene = loaded(translation)
        chosen = integrator and other_integrator(integrator, translation)
        yield Session(scene, translation.plan.spp, seed, chosen)


@contextmanager
def ready(translation, wanted=None):
    """Context in which the variant and the threads of a translated scene are set.

    Args:
        translation: the translated scene.
        wanted: variant instead of the planned one.

    Raises:
        CannotRender: the variant does not work here.
    """
    with variant(usable_variant(translation.plan, wanted)):
        use_threads(translation.document.thread)
        yield


def loaded(translation):
    """The Mitsuba scene of a translation.

    Raises:
        CannotRender: Mitsuba does not take it, such as for numbers beyond single precision.
    """
    shapes = [entry.get("type") for entry in translation.scene.values() if isinstance(entry, dict)]
    # Mitsuba 3.9 merges rectangles of one BSDF into a mesh without a bounding box. Lights at
    # infinity then are looked for within a sphere that is too small, and shine through walls.
    safe = shapes.count("rectangle") < 2
    try:
        return mi.load_dict(translation.dictionary(), optimize=safe)
    except (RuntimeError, TypeError) as error:
        raise CannotRender(f"Mitsuba does not take the scene: {reason(error)}") from error


def other_integrator(name, translation):
    """An integrator by its plugin id, with the scene's path depths where it takes them.

    Raises:
        CannotRender: there is no such integrator.
    """
    return mi.load_dict(integrator_entry(name, translation.scene["integrator"]))


def integrator_entry(name, planned):
    """The dictionary of an integrator by its plugin id; a variant must be set.

    Args:
        name: plugin id.
        planned: dictionary of the integrator that has the scene's path depths; a Metropolis
            integrator takes its paths from it.

    Returns:
        A dictionary with these depths, as far as the integrator takes them.

    Raises:
        CannotRender: there is no such integrator.
    """
    paths = planned.get("paths", planned)
    if name in METROPOLIS:
        return {"type": name, "paths": paths}
    depths = {"max_depth": -1, "rr_depth": paths.get("rr_depth", 5)}
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


def _document(path_or_document):
    if isinstance(path_or_document, translator.Document):
        return path_or_document
    return read(path_or_document)
