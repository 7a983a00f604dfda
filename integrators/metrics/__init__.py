"""Metrics of curved space: how light moves, one file each.

A new metric is a file with a subclass of `Metric` and an entry in `metric_of`.
"""

from __future__ import annotations

from collections.abc import Callable

import mitsuba as mi

from relume.integrators.metrics.kerr import Kerr
from relume.integrators.metrics.metric import Metric
from relume.integrators.metrics.schwarzschild import Schwarzschild
from relume.integrators.metrics.wormhole import Wormhole
from relume.parameters import choice


def metric_of(props: mi.Properties) -> Metric:
    """Return the metric that the parameter ``metric`` names, with its parameters.

    Args:
        props: `mi.Properties` of the integrator.

    Raises:
        ValueError: no metric has that name, or one of its parameters is out of range.
    """
    metrics: dict[str, Callable[[mi.Properties], Metric]] = {
        "schwarzschild": Schwarzschild,
        "kerr": Kerr,
        "wormhole": Wormhole,
    }
    return metrics[choice(props, "metric", tuple(metrics))](props)
