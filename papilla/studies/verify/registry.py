"""The families of cases of `papilla verify`, by name, in the order of the table."""

from papilla.studies.verify.case import Family
from papilla.studies.verify.engines import engines
from papilla.studies.verify.hard import contrast, loads, places, slivers, thin_layer
from papilla.studies.verify.hertz import coat, hertz, layers
from papilla.studies.verify.incompressible import incompressible
from papilla.studies.verify.invariance import invariance
from papilla.studies.verify.manufactured import manufactured
from papilla.studies.verify.patch_test import patch_test
from papilla.studies.verify.scatter import scatter

FAMILIES: dict[str, Family] = {
    "patch": patch_test,
    "manufactured": manufactured,
    "hertz": hertz,
    "layer": layers,
    "coat": coat,
    "incompressible": incompressible,
    "contrast": contrast,
    "loads": loads,
    "places": places,
    "thin-layer": thin_layer,
    "slivers": slivers,
    "scatter": scatter,
    "invariance": invariance,
    "engines": engines,
}
