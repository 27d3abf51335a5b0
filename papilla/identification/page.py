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


def section(fit: Identification, diagnosis: Diagnosis) -> Markup:
    """The part of the page that the page of a calibration contains, too."""
    template = environment("papilla.identification").get_template("identified.html")
    return Markup(template.render(**parts(fit, diagnosis)))


def parts(fit: Identification, diagnosis: Diagnosis) -> dict[str, Any]:
    """The values of the page by their names in the template."""
    return {
        "diagnosis": diagnosis,
        "noise": fit.problem.noise.words,
        "physics": " and ".join(shape.physics for shape in fit.problem.shapes),
        "parameters": _parameters(fit, diagnosis),
        "held": ", ".join(dict.fromkeys(map(kind, _held(fit, diagnosis)))),
        "gauges": _gauges(fit),
        "influential": _influential(fit, diagnosis),
        "correlations": _correlations(fit),
        "curves": image(_curves(fit), "S_d of presses and of the identified finger"),
        "residuals": image(_residuals(fit), "Weighted residuals of each gauge against force"),
    }


def weighted_residuals(fit: Identification) -> np.ndarray:
    """(n, c) residuals divided by the standard deviations that the noise gives each reading, without the error of the
    force."""
    noise, modelled = fit.problem.noise, fit.problem.modelled(fit.vector)
    sigma = np.full(modelled.unsure.shape, fit.problem.reading_noise)
    sigma[:, len(fit.problem.reading_names) :] = noise.indentation_mm
    slope = noise.force * modelled.by_ln_force
    return fit.residuals / np.sqrt(sigma**2 + modelled.unsure**2 + slope**2)


def _parameters(fit: Identification, diagnosis: Diagnosis) -> list[tuple[str, str, str, str]]:
    rows, undetermined = [], _held(fit, diagnosis)
    for name, value in fit.values.items():
        if name not in undetermined:
            text, *ends = (
                number(quantity, PARAMETER_DIGITS) for quantity in (value, *diagnosis.intervals.get(name, ()))
            )
            rows.append((name, text, " to ".join(ends) or "held", PARAMETERS_BY_NAME[kind(name)].unit))
    return rows


def _held(fit: Identification, diagnosis: Diagnosis) -> list[str]:
    """Parameters that were held at the value of a finger as it is drawn."""
    return [name for name, value in fit.values.items() if name not in diagnosis.intervals and plain_value(name, value)]


def _gauges(fit: Identification) -> list[tuple[str, str, str, str]]:
    """For each gauge: rms residual, weighted rms residual, and number of changes of its sign with rising force."""
    problem, order = fit.problem, np.lexsort((fit.problem.log.force_N, fit.problem.log.modulus_MPa))
    weighted, rows = weighted_residuals(fit), []
    for k, name in enumerate(problem.reading_names):
        residual = fit.residuals[:, k]
        changes = int((np.diff(np.sign(residual[order])) != 0).sum())
        size, relative = (float(np.sqrt(np.mean(values**2))) for values in (residual, weighted[:, k]))
        rows.append((name, f"{number(size)} µε", number(relative), f"{changes} of {len(residual) - 1}"))
    return rows


def _influential(fit: Identification, diagnosis: Diagnosis) -> list[tuple[str, str, str, str]]:
    log = fit.problem.log
    rows = np.argsort(-diagnosis.influence)[:MOST_LISTED_PRESSES]
    loads = ((plain(float(log.force_N[press])), plain(float(log.modulus_MPa[press]))) for press in rows)
    return [
        (str(press + 1), *load, number(diagnosis.influence[press], 2)) for press, load in zip(rows, loads, strict=True)
    ]


def _correlations(fit: Identification) -> list[str]:
    together = fit.covariance / np.outer(fit.sigma, fit.sigma)
    pairs = [(abs(together[a, b]), a, b) for a, b in combinations(range(len(fit.names)), 2)]
    large = sorted((pair for pair in pairs if pair[0] > TOLD_CORRELATION), reverse=True)[:MOST_LISTED_PRESSES]
    return [f"{fit.names[a]} with {fit.names[b]} {number(together[a, b], 3, True)}" for _, a, b in large]


def _curves(fit: Identification):
    problem = fit.problem
    log, g = problem.log, len(problem.gauges)
    forces = np.geomspace(log.force_N.min(), log.force_N.max(), IDENTIFIED_CURVE_POINTS)
    moduli = np.unique(log.modulus_MPa)
    drawn = (
        moduli
        if len(moduli) <= MOST_LISTED_PRESSES
        else moduli[np.linspace(0, len(moduli) - 1, MOST_LISTED_PRESSES).astype(int)]
    )
    curves = np.array([fit.at(forces, np.full(len(forces), modulus))[:, :g].std(axis=1) for modulus in drawn]).T
    sd = fit.measured_sd
    bars = problem.noise.readings_microstrain / np.sqrt(g) + problem.noise.force * sd
    # The curves are of the first shape of specimen, at the apex
    presses = problem.shapes[0].rows
    presses = apex if (apex := presses[~places(log)[presses].any(axis=1)]).size else presses
    points = tuple(column[presses] for column in (log.force_N, log.modulus_MPa, sd, bars))
    return view.plots.sd_of_presses(forces, drawn.tolist(), curves, points)


def _residuals(fit: Identification):
    names = fit.problem.reading_names
    weighted = weighted_residuals(fit)[:, : len(names)]
    return view.plots.residuals_against_force(fit.problem.log.force_N, names, weighted)
