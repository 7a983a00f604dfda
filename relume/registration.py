"""How a plugin file registers itself under every Mitsuba variant.

Mitsuba resolves ``mi.BSDF``, ``mi.Emitter`` and the like to the classes of the variant in use, so
a plugin class can only be defined while a variant is set, and once for each variant. A plugin file
therefore wraps its class in a function and ends with ``on_every_variant(that_function)``.
"""

import mitsuba as mi


def on_every_variant(define):
    """Call `define()` once under each variant: now, if one is set, and whenever a new one gets set.

    Args:
        define: function without arguments that defines and registers a plugin class.
    """
    defined = set()

    def visit(_old, new):
        if new not in defined:
            defined.add(new)
            define()

    mi.detail.add_variant_callback(visit)
    if mi.variant():
        visit(None, mi.variant())
