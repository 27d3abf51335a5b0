"""The comparison: costs first and alone, then every estimator in every scene, on as many processes as asked for."""

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import partial

from papilla.studies.estimator_bench.competitors import Competitor, chosen
from papilla.studies.estimator_bench.likelihood import Likelihood, likelihood
from papilla.studies.estimator_bench.plan import LONG, Plan
from papilla.studies.estimator_bench.prototypes import Prototype, against_prototypes
from papilla.studies.estimator_bench.rows import SceneRow, StepRow, VelocityRow, scene_row, step_row, velocity_row
from papilla.studies.estimator_bench.targets import TARGETS, Verdict, verdicts
from papilla.studies.estimator_bench.timing import Cost, costs_of

TIMED_WAVELENGTH_MM = 1.8
LIKELIHOOD_SCENES = ("const", "act1", "act2")
Job = tuple[Callable, tuple]


@dataclass(frozen=True)
class Comparison:
    """All tables of one comparison; errors are fractions."""

    scenes: tuple[SceneRow, ...]
    steps: tuple[StepRow, ...]
    velocity: tuple[VelocityRow, ...]
    costs: tuple[Cost, ...]
    likelihood: tuple[Likelihood, ...]

    @property
    def targets(self) -> tuple[Verdict, ...]:
        """What was to be reached and what was; targets of estimators that were not run are left out."""
        return verdicts(TARGETS, self.scenes, self.steps, self.costs)

    @property
    def prototypes(self) -> tuple[Prototype, ...]:
        """The published estimators as printed against an independent computation of the same scenes."""
        return against_prototypes(self.scenes)

    def to_json(self) -> dict:
        """As plain values, for `--json`."""
        names = ("scenes", "steps", "velocity", "costs", "likelihood", "prototypes", "targets")
        return {name: [asdict(row) for row in getattr(self, name)] for name in names}


def compare(
    plan: Plan = LONG,
    *,
    workers: int = 1,
    progress: Callable[[str, int, int], None] = lambda stage, done, total: None,
) -> Comparison:
    """Run the comparison of `plan` on `workers` processes; `progress` gets the stage, jobs done and total.

    Costs are timed in this process before any other is started. Raises `InputError` for unknown names.
    """
    entrants = chosen(plan.names)
    costs: list[Cost] = []
    for number, competitor in enumerate(entrants.values()):
        progress("timing", number, len(entrants))
        costs += costs_of(competitor, wavelength_mm=TIMED_WAVELENGTH_MM, seed=plan.seeds[0], seconds=plan.cost_seconds)
    jobs = _jobs(list(entrants.values()), plan)
    results = _run(jobs, workers, lambda done: progress("scenes", done, len(jobs)))

    def of(kind: type) -> tuple:
        return tuple(row for row in results if isinstance(row, kind))

    return Comparison(of(SceneRow), of(StepRow), of(VelocityRow), tuple(costs), of(Likelihood))


def _jobs(entrants: Sequence[Competitor], plan: Plan) -> list[Job]:
    """All jobs, a scene's together so that a process makes each scene once."""
    jobs: list[Job] = [
        (partial(likelihood, draws=plan.draws, seed=plan.seeds[0]), (kind, plan.wavelengths_mm))
        for kind in LIKELIHOOD_SCENES
    ]
    for kind, snr in plan.conditions:
        jobs += [
            (scene_row, (item.name, kind, snr, plan))
            for item in entrants
            if item.snrs_dB is None or snr in item.snrs_dB
        ]
    velocities = [(delay, 1.0) for delay in plan.delays_ms] + [(0, gain) for gain in plan.gains]
    for item in entrants:
        jobs += [(step_row, (item.name, before, after, plan)) for before, after in plan.steps_mm]
        jobs += [(velocity_row, (item.name, delay, gain, plan)) for delay, gain in velocities]
    return jobs


def _run(jobs: Sequence[Job], workers: int, done: Callable[[int], None]) -> list:
    """Results in the order of the jobs."""
    if workers <= 1:
        results = []
        for number, (function, arguments) in enumerate(jobs):
            results.append(function(*arguments))
            done(number + 1)
        return results
    # A fresh interpreter for each: to fork one whose threads draw a progress bar is not safe.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        futures = [pool.submit(function, *arguments) for function, arguments in jobs]
        try:
            for number, future in enumerate(as_completed(futures)):
                future.result()
                done(number + 1)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        return [future.result() for future in futures]
