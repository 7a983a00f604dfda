"""The table of methods that the workbench measures, and what each of them renders.

A method is an integrator in the place of the planned path tracer, inside what the plan wraps around
it (`samplescale`, `shadowcatching`). It may also change what is rendered: the document before it
is translated, such as another model of its subsurface objects, or the translated scene, such as a
stock BSDF instead of our own. A new method is a row of `METHODS`; any other integrator that Mitsuba
knows is a method by its plugin id.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import mitsuba as mi

from relume import translator
from relume.loading import Source, for_variant, integrator_entry, load_scene
from relume.options import RenderOptions
from relume.session import CannotRender, reason
from relume.translator import Document, Translation, media
from relume.translator.outcomes import OUTCOMES
from relume.translator.plan import paths_of_chains, plugin_types
from relume.translator.scene_values import to_mitsuba
from relume.workbench.renders import MitsubaIntegrator, MitsubaScene

FOREIGN = "only scene files tell what to render instead"
"""The obstacle of methods that change the document, at Mitsuba scenes."""

MEDIA = {"homogeneous", "heterogeneous"}

Entry: TypeAlias = dict[str, Any]
"""A dictionary of plain values, as a translation holds it."""


@dataclass(frozen=True)
class Method:
    """A way to render a scene.

    Attributes:
        name: as the command line takes it and charts show it.
        integrator: from the dictionary of the planned innermost integrator to that of this method;
            called with the variant set.
        unbiased: whether its expectation is the scene's picture, so that it may make references.
        obstacle: from a `Translation` to the reason why it cannot render that; empty if it can.
        document: from a `Document` to the one to be translated instead, or None.
        scene: from the translated scene's dictionary to another one, or None.
        chains: dictionary of a Metropolis integrator, which takes its paths from all of these; None
            for plain sampling, whatever the plan has.
        charted: whether charts show it without being asked: not where it differs from another row
            in the shape of small steps alone.
    """

    name: str
    integrator: Callable[[Entry], Entry]
    unbiased: bool = True
    obstacle: Callable[[Translation], str] = lambda translation: ""
    document: Callable[[Document], Document] | None = None
    scene: Callable[[Entry], Entry] | None = None
    chains: Entry | None = None
    charted: bool = True


def tracer(kind: str, **parameters: Any) -> Callable[[Entry], Entry]:
    """An integrator of type `kind` with the planned depths and parameters of its own."""

    def integrator(planned: Entry) -> Entry:
        depths = {key: planned[key] for key in ("max_depth", "rr_depth") if key in planned}
        return {"type": kind} | depths | parameters

    return integrator


def as_planned(planned: Entry) -> Entry:
    """The planned integrator: the method differs in what it renders, or in its chains."""
    return planned


def has_medium(translation: Translation) -> bool:
    """Whether a scene has a participating medium."""
    return bool(plugin_types(translation.scene) & MEDIA)


def without_medium(translation: Translation) -> str:
    """The obstacle of methods that know no media."""
    if has_medium(translation):
        return "it knows no participating media"
    return without_diffusion(translation)


def without_masks(translation: Translation) -> str:
    """The obstacle of the stock path tracer, for which light ends at all surfaces."""
    if {"mask", "null"} & plugin_types(translation.scene):
        return "its light does not cross surfaces that are not there in full"
    return without_medium(translation)


def without_diffusion(translation: Translation) -> str:
    """The obstacle of methods that do not know what the dipole renders."""
    dipole = "subsurface" in translation.plan.plugins
    return "it knows no subsurface scattering by diffusion" if dipole else ""


def with_medium(translation: Translation) -> str:
    """The obstacle of methods that only media need."""
    return "" if has_medium(translation) else "the scene has no participating medium"


def with_dispersion(translation: Translation) -> str:
    """The obstacle of methods that only dispersive glass needs."""
    spectral = "spectral" in translation.plan.variant
    return "" if spectral else "nothing in the scene is dispersive"


def simulated(document: Document) -> Document:
    """The document with its subsurface scattering simulated."""
    return media.with_method(document, dipole=False)


def diffused(document: Document) -> Document:
    """The document with its subsurface scattering left to the dipole."""
    return media.with_method(document, dipole=True)


def without_wrapping(translation: Translation) -> str:
    """The obstacle of methods that trace no single rays, which other integrators take them for."""
    if "integrator" in paths_of(translation.scene["integrator"]):
        return "it cannot be nested in another integrator"
    return without_medium(translation)


def with_diffusion(translation: Translation) -> str:
    """The obstacle of the simulation that stands in for the dipole."""
    if not translation.document.objects:
        return FOREIGN
    return "" if without_diffusion(translation) else "no object is rendered by the dipole"


def with_subsurface(translation: Translation) -> str:
    """The obstacle of the dipole."""
    if not any(block.reflection.subsurface for block in translation.document.objects):
        return "no object has subsurface scattering"
    dispersive = not with_dispersion(translation)
    code = media.obstacle_to_dipole(diffused(translation.document), dispersive)
    return OUTCOMES[code].note if code else ""


def with_ward(translation: Translation) -> str:
    """The obstacle of methods that replace Ward's reflection."""
    return "" if "ward" in translation.plan.plugins else "the scene has no Ward surface"


def with_plain_glass(translation: Translation) -> str:
    """The obstacle of methods that replace `schlickglass` by stock glass of one index."""
    if "schlickglass" not in translation.plan.plugins:
        return "the scene has no glass"
    return "" if with_dispersion(translation) else "stock glass knows no dispersion"


def replaced(change: Callable[[Entry], Entry]) -> Callable[[Any], Any]:
    """A scene whose nested dictionaries are what `change` makes of them, innermost first."""

    def scene(value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        return change({key: scene(item) for key, item in value.items()})

    return scene


def stock_glass(entry: Entry) -> Entry:
    """`dielectric`, with Fresnel's own formulas, instead of `schlickglass`."""
    return entry | {"type": "dielectric"} if entry.get("type") == "schlickglass" else entry


def balanced_ward(entry: Entry) -> Entry:
    """The form of `ward` with a bounded albedo instead of that of 1992."""
    return entry | {"variant": "balanced"} if entry.get("type") == "ward" else entry


def bends(translation: Translation) -> bool:
    """Whether light follows curved space in a scene."""
    return "curvedspace" in translation.plan.plugins


def with_holes(translation: Translation) -> str:
    """The obstacle of what only curved space needs."""
    return "" if bends(translation) else "nothing in the scene bends space"


def with_separate_direct_light(translation: Translation) -> str:
    """The obstacle of chains that leave direct light to plain sampling."""
    integrator = paths_of(translation.scene["integrator"])
    while "integrator" in integrator:
        if integrator.get("luminance_limit", 0) > 0:
            return "luminance_cutoff cuts direct and indirect light together"
        integrator = integrator["integrator"]
    can = integrator["type"] in ("surfacepath", "bdpt")
    return "" if can else f"{integrator['type']} cannot leave out direct light"


def small_steps(kind: str) -> Method:
    """The row of `pssmlt` with small steps of another shape."""
    chains = {"type": "pssmlt", "mutation": kind}
    return Method(f"pssmlt-{kind}", as_planned, chains=chains, charted=False)


def two_sided(kind: str) -> Method:
    """The row of chains over paths that are found from both ends."""
    return Method(f"{kind}-bdpt", tracer("bdpt"), obstacle=without_wrapping, chains={"type": kind})


DIPOLES = {
    "dipole": "standard",
    "dipole-directional": "directional",
    "dipole-normalized": "normalized",
}
"""Methods that render subsurface scattering by diffusion, with their profiles."""

METHODS = (
    Method("curvedspace", as_planned, obstacle=with_holes),
    Method("surfacepath", tracer("surfacepath"), obstacle=without_medium),
    Method("bdpt", tracer("bdpt"), obstacle=without_wrapping),
    Method("path", tracer("path"), obstacle=without_masks),
    Method("volpath", tracer("volpath"), obstacle=without_diffusion),
    Method("volpathmis", tracer("volpathmis"), obstacle=with_medium),
    Method("randomwalk", tracer("randomwalk"), obstacle=with_medium),
    Method("simulation", as_planned, obstacle=with_diffusion, document=simulated),
    *(
        Method(
            name,
            tracer("dipole", profile=profile),
            unbiased=False,
            obstacle=with_subsurface,
            document=diffused,
        )
        for name, profile in DIPOLES.items()
    ),
    Method(
        "dielectric",
        as_planned,
        unbiased=False,
        obstacle=with_plain_glass,
        scene=replaced(stock_glass),
    ),
    Method(
        "ward-balanced",
        as_planned,
        unbiased=False,
        obstacle=with_ward,
        scene=replaced(balanced_ward),
    ),
    Method("pssmlt", as_planned, chains={"type": "pssmlt"}),
    Method(
        "pssmlt-direct",
        as_planned,
        obstacle=with_separate_direct_light,
        chains={"type": "pssmlt", "direct_samples": 0.2},
    ),
    two_sided("pssmlt"),
    small_steps("kelemen"),
    small_steps("lux"),
    small_steps("gaussian"),
    Method("erpt", as_planned, chains={"type": "erpt"}),
    two_sided("erpt"),
    Method(
        "bdpt-merging",
        tracer("bdpt", merge_radius=0.5),
        unbiased=False,
        obstacle=without_wrapping,
        charted=False,
    ),
)
"""All methods; the command line, charts and studies take them from here."""


def find(name: str) -> Method:
    """The method of a name: a row of `METHODS`, or the integrator of that plugin id.

    Of an integrator that has no row nothing is known: it counts as biased.
    """
    for row in METHODS:
        if row.name == name:
            return row
    return Method(name, lambda planned: integrator_entry(name, planned), unbiased=False)


def obstacle(method: Method, translation: Translation) -> str:
    """Why a method cannot render a scene; empty if it can, as far as is known."""
    follows = method.name == "curvedspace" or method.chains is not None
    if bends(translation) and not follows:
        return "its light goes straight on, where that of the scene does not"
    return method.obstacle(translation)


def methods_for(translation: Translation) -> list[Method]:
    """The rows of `METHODS` that can render a scene."""
    return [row for row in METHODS if not obstacle(row, translation)]


def chosen(translation: Translation, names: Iterable[str]) -> list[Method]:
    """The methods of these names; all that can render a scene if there are none."""
    if names:
        return [find(name) for name in dict.fromkeys(names)]
    plan, rows = planned(translation), methods_for(translation)
    return rows if plan.name in {row.name for row in rows} else [plan, *rows]


def planned(translation: Translation) -> Method:
    """The method that the plan chose, with all its parameters."""
    integrator = translation.scene["integrator"]
    if "paths" in integrator:
        chains = {key: value for key, value in integrator.items() if key != "paths"}
        return dataclasses.replace(find(integrator["type"]), integrator=as_planned, chains=chains)
    row = dataclasses.replace(find(innermost(integrator)["type"]), integrator=as_planned)
    return row if translation.document.objects else dataclasses.replace(row, document=None)


def paths_of(integrator: Entry) -> Entry:
    """The integrator that traces paths: of a Metropolis integrator the one that it takes."""
    return integrator.get("paths", integrator)


def innermost(integrator: Entry) -> Entry:
    """The dictionary of the integrator that all others are wrapped around."""
    while "integrator" in integrator:
        integrator = integrator["integrator"]
    return integrator


def with_innermost(integrator: Entry, other: Entry) -> Entry:
    """An integrator's dictionary with another innermost one."""
    if "integrator" not in integrator:
        return other
    return integrator | {"integrator": with_innermost(integrator["integrator"], other)}


class Stage:
    """A document, loaded for one method after the other; equal scenes are loaded once.

    The variant of the plan must be set.

    Args:
        document: the document, or Mitsuba scene.
        translation: its translation.
        options: with which it was translated.
    """

    def __init__(
        self, document: Source, translation: Translation, options: RenderOptions | None = None
    ) -> None:
        self.document = document
        self.translation = translation
        self.options = options or RenderOptions()
        self._loaded: dict[Any, MitsubaScene] = {}

    def translated(self, method: Method) -> Translation:
        """The translation as a method renders it.

        Raises:
            CannotRender: there is no such integrator, or the method needs another variant.
            SceneError: a changed document cannot be translated.
        """
        result = self.translation
        if method.document is not None:
            if not isinstance(self.document, Document):
                raise CannotRender(f"{method.name}: {FOREIGN}")
            changed = method.document(self.document)
            options = self.options
            result = translator.translate(
                changed, options.dialect, options.asset_path, options.stand_ins
            )
            if result.plan.variant != self.translation.plan.variant:
                raise CannotRender(f"{method.name} needs the variant {result.plan.variant}")
        scene = method.scene(result.scene) if method.scene else result.scene
        paths = paths_of(scene["integrator"])
        integrator = with_innermost(paths, method.integrator(innermost(paths)))
        if method.chains is not None:
            integrator = method.chains | {"paths": paths_of_chains(integrator)}
        return dataclasses.replace(result, scene=scene | {"integrator": integrator})

    def load(self, method: Method) -> tuple[MitsubaScene, MitsubaIntegrator]:
        """The scene and the integrator of a method, loaded.

        Returns:
            `mi.Scene` and `mi.Integrator`.

        Raises:
            CannotRender: the integrator does not exist or cannot be wrapped, or Mitsuba does not
                take the scene; and what `translated` raises.
        """
        translation = self.translated(method)
        try:
            integrator = mi.load_dict(to_mitsuba(for_variant(translation.scene["integrator"])))
        except RuntimeError as error:
            raise CannotRender(f"integrator '{method.name}': {reason(error)}") from None
        key = (method.document, method.scene)
        if key not in self._loaded:
            self._loaded[key] = load_scene(translation)
        return self._loaded[key], integrator
