"""A made-up geometry: smooth functions in the place of meshes, so that a design costs milliseconds."""

import math
from itertools import product

import numpy as np

from papilla.design.geometry import GeometryMap
from papilla.fem.pressing.response import RESPONSE_FORCES_MM2, RESPONSE_POLYNOMIAL, SPECIMEN_MODULUS_RATIOS, Response
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES


def made_up_map(design, places, base=None) -> GeometryMap:
    """Strains that fall with the angle and grow less and less with the modulus; stick lowers them by 3 %."""
    ratios = np.geomspace(1, 16, 7)
    x, e, r = np.array(list(product(RESPONSE_FORCES_MM2, SPECIMEN_MODULUS_RATIOS, ratios))).T
    sites = places.gauges(design.shape)
    terms = RESPONSE_POLYNOMIAL.terms((x, e, r))[0]
    hardness = 1.5 - 1 / (1 + e**0.6)
    bump = np.array([math.cos(math.radians(3 * site.angle_deg)) for site in sites])
    about = np.outer(hardness * x**-0.1 * r**-0.2, bump) + 0.1 * np.outer(x**-0.2, 1 - bump)
    values = np.concatenate([about, 0.1 * about], axis=1) * 0.01
    depth = (0.05 * (1 + 2 / (1 + e)) * np.ones_like(r))[:, None]

    def response(scale: float, friction: float) -> Response:
        table = np.linalg.lstsq(terms, np.hstack([depth, scale * values]))[0]
        deepest = np.array([(one, ratio, 200.0) for one in SPECIMEN_MODULUS_RATIOS for ratio in ratios]).T
        error = np.zeros(table.shape[1])
        return Response(table, deepest, math.inf, friction, False, error, len(sites), "made up")

    assert len(GAUGE_QUANTITIES) * len(sites) == values.shape[1]
    return GeometryMap(design, places, (response(1.03, 0.0), response(1.0, math.inf)))
