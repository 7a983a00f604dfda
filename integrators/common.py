"""What several integrators share."""

import drjit as dr
import mitsuba as mi


def nested_integrator(props):
    """The one sampling integrator nested in another one.

    Args:
        props: `mi.Properties` of the outer integrator.

    Raises:
        ValueError: there is none, several, or one that renders no samples of single pixels.
    """
    nested = [value for _, value in props.objects() if isinstance(value, mi.Integrator)]
    if len(nested) != 1 or not isinstance(nested[0], mi.SamplingIntegrator):
        raise ValueError(f"{props.plugin_name()} takes one nested sampling integrator")
    return nested[0]


def power_heuristic(pdf, other):
    """Return the weight of a sample of density `pdf` that `other` might have drawn, 0 for 0/0."""
    a, b = pdf * pdf, other * other
    w = a / (a + b)
    return dr.select(dr.isfinite(w), w, 0)
