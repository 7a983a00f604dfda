"""Errors of 2 % that tests have to find: see `error_injection`."""

from studies.mutations_of_curved_space import CURVED_SPACE
from studies.mutations_of_lights import LIGHTS
from studies.mutations_of_materials import MATERIALS
from studies.mutations_of_rendering import RENDERING
from studies.mutations_of_translation import TRANSLATION
from studies.mutations_of_workbench import WORKBENCH

MUTATIONS = [*MATERIALS, *LIGHTS, *RENDERING, *TRANSLATION, *WORKBENCH, *CURVED_SPACE]
