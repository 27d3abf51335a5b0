"""`BenchRow`: one line of the bench, what a rung on a mesh costs and how far it is from the finest."""

from dataclasses import asdict, dataclass

import numpy as np

from papilla.studies.bench.measure import ANSWERED, Measured


@dataclass(frozen=True)
class BenchRow:
    """What one rung with one element on one mesh costs, and its errors; errors are fractions, worst over `forces_gf`.

    fidelity, element, size_mm : what is measured.
    dofs : unknowns factorised; patch_nodes : of the reduced finger.
    seconds_setup : assembly, factorisation and reduction, the mesh being cached.
    seconds_per_scene : median; seconds_thousand : set-up and the 1000 scenes of a sweep together.
    error_sd, error_indentation, error_area : of S_d, indentation and contact area of a block of 0.51 MPa and 10 mm,
        against the same on a mesh of `reference_size_mm`. Linear rungs are compared with rung contact by Taylor-Hood,
        rung finite with rung finite: its errors are those of its mesh. 0 where `reference` is true, by definition.
    small_strain_sd, small_strain_indentation : rung finite against rung contact by Taylor-Hood on its own mesh, which
        is what small-strain theory costs; None for the other rungs.
    peak_memory_MiB : of the process that did nothing else; factor_nonzeros : entries of the factor.
    pareto : whether no other row is both cheaper (seconds_thousand) and better (error_sd); rung finite, whose errors
        mean something else, and the reference take no part.
    status : "answered", or why the rung refused; seconds of scenes and errors are then NaN.
    None stands where a rung has no such thing.
    """

    fidelity: str
    element: str
    size_mm: float
    dofs: int
    seconds_setup: float
    seconds_per_scene: float
    error_sd: float
    error_indentation: float
    error_area: float
    peak_memory_MiB: float
    factor_nonzeros: int | None
    patch_nodes: int | None
    seconds_thousand: float
    forces_gf: tuple[float, ...]
    reference_size_mm: float
    reference: bool = False
    small_strain_sd: float | None = None
    small_strain_indentation: float | None = None
    pareto: bool = False
    status: str = ANSWERED

    def to_json(self) -> dict:
        """The documented keys, as plain values."""
        return asdict(self)


def row_of(measured: Measured, against: Measured, linear: Measured | None = None) -> BenchRow:
    """The row of a measurement, its errors against another; `linear` is rung contact on the mesh of a finite row."""
    error_sd, error_indentation, error_area = (float(error) for error in worst(measured, against))
    set_up = sum(measured.stages.values())
    small = [None, None, None] if linear is None else [float(error) for error in worst(linear, measured)]
    return BenchRow(
        fidelity=measured.fidelity,
        element=measured.job.element or "Taylor-Hood",
        size_mm=measured.job.size_mm,
        dofs=measured.dofs,
        seconds_setup=set_up,
        seconds_per_scene=measured.seconds_per_scene,
        error_sd=error_sd,
        error_indentation=error_indentation,
        error_area=error_area,
        peak_memory_MiB=measured.peak_memory_MiB,
        factor_nonzeros=measured.factor_nonzeros,
        patch_nodes=measured.patch_nodes,
        seconds_thousand=set_up + measured.seconds_thousand,
        forces_gf=measured.job.forces_gf,
        reference_size_mm=against.job.size_mm,
        reference=measured is against,
        small_strain_sd=small[0],
        small_strain_indentation=small[1],
        status=measured.status,
    )


def worst(measured: Measured, against: Measured) -> np.ndarray:
    """Largest relative differences (3,) of the answers over the forces that both have."""
    mine, theirs = (dict(zip(one.job.forces_gf, one.answers.T, strict=True)) for one in (measured, against))
    return np.max([np.abs(mine[gf] / theirs[gf] - 1) for gf in mine.keys() & theirs.keys()], axis=0)


def pareto_front(seconds: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Mask (n,) of the entries that no other beats in one of seconds and error without losing in the other."""
    cheaper = (seconds[:, None] <= seconds) & (error[:, None] <= error)
    strictly = (seconds[:, None] < seconds) | (error[:, None] < error)
    return np.asarray(~(cheaper & strictly).any(axis=0))
