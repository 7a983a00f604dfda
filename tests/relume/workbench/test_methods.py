"""The table of methods: what can render what, and what a method puts in the place of the plan's."""

import dataclasses

import mitsuba as mi
import pytest

import relume
from relume import translator
from relume.loading import variant_and_threads
from relume.session import CannotRender
from relume.workbench import methods


@pytest.fixture
def staged(room):
    """A function that yields nothing but the stage of a room, its variant set."""
    before = mi.variant()

    def make(settings="", objects=""):
        document = relume.read(room(settings, objects=objects))
        return methods.Stage(document, translator.translate(document))

    yield make
    if before:
        mi.set_variant(before)


GLASS_BALL = "OBJECT\nsphere 0 1 3 1\ncolor 1 1 1\nreflection reflection\nrefractive_index 1.5\n"
MILK = (
    "OBJECT\nsphere 0 1 3 1\ncolor 1 1 1\nreflection reflection\n"
    "reflection Subsurface_Scattering\nMATERIAL_SYMBOL\nWholemilk\n"
)
PRISM = GLASS_BALL.replace("reflection reflection", "reflection reflection99")


CHAINS = ["pssmlt", "pssmlt-kelemen", "pssmlt-lux", "pssmlt-gaussian", "erpt"]
BOTH_ENDS = ["erpt-bdpt", "bdpt-merging"]
SURFACE_CHAINS = ["pssmlt", "pssmlt-direct", "pssmlt-bdpt", *CHAINS[1:], *BOTH_ENDS]
"""Also those that leave direct light out, which not every path tracer can, or trace from lamps."""


def names(stage):
    return [row.name for row in methods.methods_for(stage.translation)]


def test_each_scene_gets_the_methods_that_can_render_it(staged):
    assert names(staged()) == ["surfacepath", "bdpt", "path", "volpath", *SURFACE_CHAINS]
    assert names(staged(objects=GLASS_BALL)) == [
        "surfacepath",
        "bdpt",
        "path",
        "volpath",
        "dielectric",
        *SURFACE_CHAINS,
    ]
    assert names(staged(objects=PRISM)) == [
        "surfacepath",
        "bdpt",
        "path",
        "volpath",
        *SURFACE_CHAINS,
    ]
    assert names(staged("luminance_cutoff\n0.5")) == ["surfacepath", "path", "volpath", *CHAINS]
    fog = {"integrator": {"type": "volpath"}, "box": {"interior": {"type": "homogeneous"}}}
    stage = staged()
    foggy = dataclasses.replace(stage.translation, scene=stage.translation.scene | fog)
    walks = ["volpath", "volpathmis", "randomwalk"]
    assert [row.name for row in methods.methods_for(foggy)] == [*walks, *CHAINS]


def test_subsurface_scattering_is_diffused_or_simulated(staged):
    """What knows neither is no method; the others render what they need, whatever the plan."""
    dipoles = ["dipole", "dipole-directional", "dipole-normalized"]
    diffused, simulated = (staged(objects=MILK + f"BSSRDF\n{flag}\n") for flag in (1, 0))
    assert names(diffused) == ["simulation", *dipoles, *CHAINS]
    assert names(simulated)[:6] == ["volpath", "volpathmis", "randomwalk", *dipoles]
    for stage in (diffused, simulated):
        for name in dipoles:
            made = stage.translated(methods.find(name))
            assert "subsurface" in made.plan.plugins
            assert made.scene["integrator"]["profile"] == methods.DIPOLES[name]
    made = diffused.translated(methods.find("simulation"))
    assert made.scene["integrator"]["type"] == "randomwalk" and methods.has_medium(made)


def test_names_are_unique_and_found():
    rows = methods.METHODS
    assert len({row.name for row in rows}) == len(rows)
    assert all(methods.find(row.name) is row for row in rows)


def test_an_integrator_without_a_row_is_a_method_of_unknown_bias(staged):
    stage = staged()
    depth = methods.find("depth")
    with variant_and_threads(stage.translation):
        assert not depth.unbiased and "Depth" in stage.load(depth)[1].class_name()
        with pytest.raises(CannotRender, match="integrator 'nope'"):
            stage.load(methods.find("nope"))


def test_wrappers_stay_around_another_method(staged):
    """`luminance_cutoff` wraps the integrator: any method must stay inside."""
    stage = staged("luminance_cutoff\n0.5")
    planned = stage.translation.scene["integrator"]
    assert (
        planned["type"] == "samplescale"
        and methods.planned(stage.translation).name == "surfacepath"
    )
    with variant_and_threads(stage.translation):
        made = stage.translated(methods.find("volpath")).scene["integrator"]
    assert made["type"] == "samplescale"
    assert made["luminance_limit"] == planned["luminance_limit"]
    assert made["integrator"] == planned["integrator"] | {"type": "volpath"}


def test_chains_go_around_the_wrappers(staged):
    """Chains take their paths from all that the plan has; plain methods do without them."""
    stage = staged("sensor_response\n2")
    with variant_and_threads(stage.translation):
        made = stage.translated(methods.find("pssmlt-lux")).scene["integrator"]
    assert made["type"] == "pssmlt" and made["mutation"] == "lux"
    assert made["paths"]["type"] == "samplescale"
    assert made["paths"]["integrator"]["type"] == "surfacepath"
    with variant_and_threads(stage.translation):
        made = staged().translated(methods.find("pssmlt-bdpt")).scene["integrator"]
    assert made["type"] == "pssmlt" and made["paths"]["type"] == "bdpt"
    stage = staged("metropolisTransport\n1\nsensor_response\n2")
    planned = methods.planned(stage.translation)
    assert planned.name == "pssmlt"
    with variant_and_threads(stage.translation):
        assert stage.translated(planned).scene == stage.translation.scene
        plain = stage.translated(methods.find("path")).scene["integrator"]
    assert plain["type"] == "samplescale" and plain["integrator"]["type"] == "path"


def test_methods_that_do_not_change_the_scene_share_it(staged):
    stage = staged(objects=GLASS_BALL)
    with variant_and_threads(stage.translation):
        path, volpath, stock = (
            stage.load(methods.find(name))[0] for name in ("path", "volpath", "dielectric")
        )
    assert path is volpath and path is not stock
    ids = [str(scene) for scene in (path, stock)]
    assert "SmoothDielectric" not in ids[0] and "SmoothDielectric" in ids[1]


def test_a_method_may_render_another_document(staged):
    """Such as another model of its subsurface objects; here: without its last object."""

    def emptied(document):
        return dataclasses.replace(document, objects=document.objects[:2])

    stage = staged()
    row = dataclasses.replace(methods.find("path"), name="fewer", document=emptied)
    with variant_and_threads(stage.translation):
        scene, _ = stage.load(row)
        whole, _ = stage.load(methods.find("path"))
    assert len(scene.shapes()) == 2 and len(whole.shapes()) == 4
