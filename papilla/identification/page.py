"""One page on an identification: parameters with intervals, measured and identified values, residuals, doubts."""

from itertools import combinations
from os import PathLike
from typing import Any

import numpy as np
from markupsafe import Markup

from papilla import view
from papilla.core.files import write_text
from papilla.identification import PARAMETERS_BY_NAME, Diagnosis, Identification
from papilla.identification.parameters import kind, plain_value
from papilla.identification.presses import places
from papilla.view.page import environment, image, number, plain

IDENTIFIED_CURVE_POINTS = 60
PARAMETER_DIGITS = 4
"""Digits of a parameter."""
TOLD_CORRELATION = 0.9
MOST_LISTED_PRESSES = 8
"""Largest number of presses and correlations on the page; the largest are listed first."""


def write_identification(path: str | PathLike, found: Identification, diagnosis: Diagnosis) -> None:
    """Write the page of an identification as one HTML file: no script, no link; raises `FileAccessError`."""
    template = environment("papilla.identification").get_template("identification.html")
    text = template.render(name=found.problem.finger.name, **parts(found, diagnosis))
    write_text(path, text)


def section(found: Identification, diagnosis: Diagnosis) -> Markup:
    """The part of the page that the page of a calibration contains, too."""
    template = environment("papilla.identification").get_template("identified.html")
    return Markup(template.render(**parts(found, diagnosis)))


def parts(found: Identification, diagnosis: Diagnosis) -> dict[str, Any]:
    """The values of the page by their names in the template."""
    return {
        "diagnosis": diagnosis,
        "noise": found.problem.noise.words,
        "physics": " and ".join(shape.physics for shape in found.problem.shapes),
        "parameters": _parameters(found, diagnosis),
        "held": ", ".join(dict.fromkeys(map(kind, _held(found, diagnosis)))),
        "gauges": _gauges(found),
        "influential": _influential(found, diagnosis),
        "correlations": _correlations(found),
        "curves": image(_curves(found), "S_d of presses and of the identified finger"),
        "residuals": image(_residuals(found), "Weighted residuals of each gauge against force"),
    }


def weighted_residuals(found: Identification) -> np.ndarray:
    """(n, c) residuals divided by the standard deviations that the noise gives each reading, without the error of the
    force."""
    noise, modelled = found.problem.noise, found.problem.modelled(found.vector)
    own = np.full(modelled.unsure.shape, found.problem.reading_noise)
    own[:, len(found.problem.reading_names) :] = noise.indentation_mm
    slope = noise.force * modelled.by_ln_force
    return found.residuals / np.sqrt(own**2 + modelled.unsure**2 + slope**2)


def _parameters(found: Identification, diagnosis: Diagnosis) -> list[tuple[str, str, str, str]]:
    rows, held = [], _held(found, diagnosis)
    for name, value in found.values.items():
        if name not in held:
            shown, *ends = (number(one, PARAMETER_DIGITS) for one in (value, *diagnosis.intervals.get(name, ())))
            rows.append((name, shown, " to ".join(ends) or "held", PARAMETERS_BY_NAME[kind(name)].unit))
    return rows


def _held(found: Identification, diagnosis: Diagnosis) -> list[str]:
    """Parameters that were held at the value of a finger as it is drawn."""
    return [
        name for name, value in found.values.items() if name not in diagnosis.intervals and plain_value(name, value)
    ]


def _gauges(found: Identification) -> list[tuple[str, str, str, str]]:
    """For each gauge: rms residual, weighted rms residual, and number of changes of its sign with rising force."""
    problem, order = found.problem, np.lexsort((found.problem.log.force_N, found.problem.log.modulus_MPa))
    weighted, rows = weighted_residuals(found), []
    for k, name in enumerate(problem.reading_names):
        residual = found.residuals[:, k]
        changes = int((np.diff(np.sign(residual[order])) != 0).sum())
        size, relative = (float(np.sqrt(np.mean(values**2))) for values in (residual, weighted[:, k]))
        rows.append((name, f"{number(size)} µε", number(relative), f"{changes} of {len(residual) - 1}"))
    return rows


def _influential(found: Identification, diagnosis: Diagnosis) -> list[tuple[str, str, str, str]]:
    log = found.problem.log
    rows = np.argsort(-diagnosis.influence)[:MOST_LISTED_PRESSES]
    loads = ((plain(float(log.force_N[row])), plain(float(log.modulus_MPa[row]))) for row in rows)
    return [(str(row + 1), *load, number(diagnosis.influence[row], 2)) for row, load in zip(rows, loads, strict=True)]


def _correlations(found: Identification) -> list[str]:
    together = found.covariance / np.outer(found.sigma, found.sigma)
    pairs = [(abs(together[a, b]), a, b) for a, b in combinations(range(len(found.names)), 2)]
    large = sorted((pair for pair in pairs if pair[0] > TOLD_CORRELATION), reverse=True)[:MOST_LISTED_PRESSES]
    return [f"{found.names[a]} with {found.names[b]} {number(together[a, b], 3, True)}" for _, a, b in large]


def _curves(found: Identification):
    problem = found.problem
    log, g = problem.log, len(problem.gauges)
    forces = np.geomspace(log.force_N.min(), log.force_N.max(), IDENTIFIED_CURVE_POINTS)
    moduli = np.unique(log.modulus_MPa)
    shown = (
        moduli
        if len(moduli) <= MOST_LISTED_PRESSES
        else moduli[np.linspace(0, len(moduli) - 1, MOST_LISTED_PRESSES).astype(int)]
    )
    curves = np.array([found.at(forces, np.full(len(forces), modulus))[:, :g].std(axis=1) for modulus in shown]).T
    sd = found.measured_sd
    bars = problem.noise.readings_microstrain / np.sqrt(g) + problem.noise.force * sd
    # The curves are of the first shape of specimen, at the apex
    kept = problem.shapes[0].rows
    kept = apex if (apex := kept[~places(log)[kept].any(axis=1)]).size else kept
    points = tuple(one[kept] for one in (log.force_N, log.modulus_MPa, sd, bars))
    return view.plots.sd_of_presses(forces, shown.tolist(), curves, points)


def _residuals(found: Identification):
    names = found.problem.reading_names
    weighted = weighted_residuals(found)[:, : len(names)]
    return view.plots.residuals_against_force(found.problem.log.force_N, names, weighted)
