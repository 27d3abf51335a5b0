"""A finger slides over a texture: gauge readings, forces and tractions over time.

Displacements are small: tractions act along z and x on the section, and the profile's flanks push along z only. The
texture is evaluated at the skin's place, which moves with the contact's mean tangential displacement. At rest on a
flat, depth and readings are those of the finger pressed in three dimensions (`tying`).
"""

import math
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from scipy.ndimage import convolve1d
from scipy.signal import firwin

from papilla.core import checks
from papilla.core.errors import ContactRangeError, InputError
from papilla.core.progress import Progress, silent
from papilla.core.units import TINY_DIVISOR
from papilla.fem.sliding.coulomb import OPEN_NODE, SLIPS_RIGHT, STICKING_NODE, Laws, Rubbed, rub
from papilla.fem.sliding.dynamics import AtRest, Inertia, Modal, loss_factors
from papilla.fem.sliding.felt_profile import FAR_MM, FeltProfile
from papilla.fem.sliding.motion import Motion
from papilla.fem.sliding.section import ReducedSection, prepare_section
from papilla.fem.sliding.tying import Tie, refuse_end, tie
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD as STUCK
from papilla.model.specimen import Friction
from papilla.model.textures import Texture

DYNAMICS_CHOICES = ("auto", "quasi-static", "modal")

SLOW_FREQUENCY_RATIO = 0.3
"""Ratio of a scene's highest frequency to the first mode's above which inertia is included: it changes the response by
a tenth."""

LONGEST_STEP_MM, LONGEST_INERTIAL_STEP_S = 0.05, 2.6e-4
"""Largest path of a step and, with inertia, its largest time; a sample takes as many steps as needed."""

AMPLIFIER_PASS_BAND, HALF_FILTER_TAPS = 0.4, 16
"""Pass band of an amplifier's anti-aliasing filter, relative to the rate; and half its length in samples. It causes no
delay."""

STEPS_A_PERIOD = 8
"""Number of steps per period of a fine grating, at least."""

MOST_SLIDE_STEPS = 2_000_000

LARGEST_FRICTION = 3.0
"""Largest coefficient of friction: above it a node jams by the coupling of its own displacements, and there is no
unique answer."""

DEEP_IN_GROOVE_MM = 0.2
"""Depth of skin in a groove above which the status mentions it: two elements of the skin, so that at most the edge of a
ridge is beside a flank."""

SMALL_STRAIN_SHARE = 0.1
"""Indentation over the tissue's thickness above which small strain is doubtful."""

UNRESOLVED_VIOLATION = 1e-6
"""Violation of the contact laws above which a step counts as unresolved."""


@dataclass(frozen=True, eq=False, repr=False)
class Slide:
    """Result of sliding over m samples; g gauges, n nodes of the skin that may touch.

    readings : (m, g) instantaneous readings in microstrain, without noise.
    amplified : (m, g) the same after an amplifier's filter, as in a log: signals above `AMPLIFIER_PASS_BAND` of the
        rate would otherwise be aliased.
    force_N, tangential_N : (m,) pressing force, and force of the finger along x (positive against a motion to the
        right).
    depth_mm : (m,) distance by which the finger's top is pressed beyond the texture's.
    pressing, rubbing : (m, n) nodal forces inward and along x on the skin, N/mm.
    state : (m, n) 0 open, 2 stick, 1 and -1 slip to the right and to the left.
    carried_mm : (m,) mean tangential displacement of the contact.
    length_mm : along y; converts N/mm to N.
    tied : the press that determines it, None if the length was stated or nothing is touched.
    friction : Coulomb's coefficient during sliding.
    dynamics, why : the choice, and its reason.
    ridge_pitch_mm : of the finger, 0 for smooth skin.
    loss_factor, loss_from : of the first mode (NaN without inertia), and its origin.
    first_mode_Hz, highest_Hz : of the section, of the scene.
    relaxed, unresolved : numbers of steps that were solved by relaxation, and of steps whose laws are violated.
    energy_error : imbalance of energy relative to the converted energy, NaN without inertia.
    in_groove_mm : largest depth of skin in grooves.
    flank_push : upper bound of the sideways force of flanks there, which is not modelled, relative to the pressing
        force: depth of the skin in a groove over the period (or over a shorter contact), as if only flanks of one side
        were pressed.
    seconds : computing time without the reduction.
    status : a sentence, "ok" if nothing is doubtful.
    """

    motion: Motion
    x_mm: np.ndarray
    gauge_names: tuple[str, ...]
    readings: np.ndarray
    amplified: np.ndarray
    force_N: np.ndarray
    tangential_N: np.ndarray
    depth_mm: np.ndarray
    pressing: np.ndarray
    rubbing: np.ndarray
    state: np.ndarray
    carried_mm: np.ndarray
    length_mm: float
    tied: Tie | None
    friction: float
    dynamics: str
    why: str
    ridge_pitch_mm: float
    loss_factor: float
    loss_from: str
    first_mode_Hz: float
    highest_Hz: float
    relaxed: int
    unresolved: int
    energy_error: float
    in_groove_mm: float
    flank_push: float
    seconds: float
    status: str

    def __repr__(self) -> str:
        return f"Slide({len(self.readings)} samples, {self.dynamics}, {np.mean(self.force_N):.3g} N: {self.status})"

    @property
    def sliding(self) -> np.ndarray:
        """(m,) whether at least one node touches and none sticks."""
        return (self.state != OPEN_NODE).any(axis=1) & ~(self.state == STICKING_NODE).any(axis=1)


def slide(
    finger: Finger,
    texture: Texture,
    motion: Motion,
    *,
    force: float | None = None,
    depth: float | None = None,
    friction: Friction | None = None,
    dynamics: str = DYNAMICS_CHOICES[0],
    loss_factor: float | None = None,
    section: ReducedSection | None = None,
    length_mm: float | None = None,
    progress: Progress = silent,
) -> Slide:
    """Press the finger on a rigid texture and slide it.

    Parameters
    ----------
    motion : of the finger; its x is the texture's under the finger's apex.
    force, depth : exactly one: pressing force in N, or distance in mm by which the finger's top is pressed beyond the
        texture's.
    friction : Coulomb's coefficient, 0 to `LARGEST_FRICTION`. None takes that of the finger's bench; if the bench
        states none, or "stick", sliding is without friction. The press to which the section is tied uses what is
        stated, or the default of presses.
    dynamics : "quasi-static", "modal" (inertia), or "auto" by the scene's frequency.
    loss_factor : of the modes; None takes the finger's identified relaxation, else `dynamics.LOSS_FACTOR`.
    section : from `prepare_section`, for other options. length_mm : along y; the section is then not tied to a press in
        three dimensions, and its readings are not corrected.

    Raises `InputError`, `ContactRangeError` (the contact leaves its patch or the texture), `SolverError`.
    """
    if (force is None) == (depth is None):
        raise InputError("a sliding scene takes exactly one of force and depth")
    pressed = {"force": checks.positive("force (N)", force)} if force is not None else {}
    if depth is not None:
        pressed = {"indentation": checks.within("press depth (mm)", depth, 0.0, 1e3)}
    stated = finger.bench.friction if friction is None else friction
    if friction == STUCK:
        raise InputError(f"a finger that slides does not stick: friction must be between 0 and {LARGEST_FRICTION:g}")
    rubbing = 0.0 if stated in (None, STUCK) else checks.within("friction", stated, 0.0, LARGEST_FRICTION)
    if loss_factor is not None:
        checks.within("loss factor", loss_factor, 0.0, 2.0)
    if dynamics not in DYNAMICS_CHOICES:
        raise InputError(f"dynamics must be one of {', '.join(DYNAMICS_CHOICES)}, got {dynamics!r}")
    body = section or prepare_section(finger, progress=progress)
    if (gauges := body.rows.shape[1]) != len(finger.gauges):
        raise InputError(f"the section is of another finger: it has {gauges} gauges, the finger {len(finger.gauges)}")
    tied, rows = None, body.reading_rows
    if length_mm is None and depth != 0:
        tied = tie(finger, body, **pressed, friction=stated, progress=progress)
        rows, length_mm = tied.rows(body), tied.length_mm
    length = checks.positive("length_mm", 1.0 if length_mm is None else length_mm)
    names = tuple(gauge.name for gauge in finger.gauges)
    loss = loss_factors(loss_factor, finger.identified, body.modes.omega)
    run = _Run(body, rows, texture, motion, force and force / length, depth, rubbing, dynamics, loss)
    return run.whole(names, length, tied, progress)


class _Run:
    """A scene in progress: the state of the body, and the recorded results."""

    def __init__(self, body, rows, texture, motion, load, depth, friction, dynamics, loss):  # noqa: PLR0913
        self.body, self.rows, self.texture, self.motion, self.friction = body, rows, texture, motion, friction
        self.loss, self.loss_from = loss
        self.load, self.depth = load, depth
        self.n = len(body.x)
        margin = 2 * body.half_width  # The contact's range, and how far friction may carry it
        reach = (float(motion.position_mm.min()) - margin, float(motion.position_mm.max()) + margin)
        self.felt = FeltProfile.of(texture, body.hats, reach)
        self.rise = body.z.max() - body.z
        fastest = np.abs(np.diff(motion.position_mm)).max()
        self.highest_Hz = highest_frequency(texture, motion, body.ridge_pitch)
        self.first_Hz = float(body.modes.omega[0] / (2 * math.pi))
        self.dynamics, self.why = choose_dynamics(dynamics, self.highest_Hz, self.first_Hz)
        longest_s = LONGEST_INERTIAL_STEP_S if self.dynamics == "modal" else math.inf
        longest = min(LONGEST_STEP_MM, (texture.wavelength or math.inf) / STEPS_A_PERIOD)
        self.substeps = math.ceil(max(1.0, fastest / longest, 1 / (motion.rate_Hz * longest_s)) - 1e-6)
        if self.substeps * len(motion.t_s) > MOST_SLIDE_STEPS:
            raise InputError(f"the scene takes more than {MOST_SLIDE_STEPS:,} steps: slide less far, or for less time")
        self.carried, self.relaxed, self.unresolved, self.in_groove, self.flank_push = 0.0, 0, 0, 0.0, 0.0
        self.work, self.turnover = 0.0, 0.0

    def whole(self, names: tuple[str, ...], length: float, tied: Tie | None, progress: Progress) -> Slide:
        """The result over all samples."""
        began, motion, n = perf_counter(), self.motion, self.n
        size = (len(motion.t_s), n)
        pressing, rubbing, node_states = np.empty(size), np.empty(size), np.empty(size, dtype=np.int8)
        depth, carried = np.empty(size[0]), np.empty(size[0])
        fine: list[np.ndarray] = []
        x = float(motion.position_mm[0])
        rubbed = self._landed(x)
        inertia = self._inertia(rubbed.force)
        start = inertia.energy(rubbed.force) if isinstance(inertia, Modal) else 0.0
        for sample, target in enumerate(motion.position_mm):
            begun = x
            for share in range(1, self.substeps + 1) if sample else ():
                place = begun + (float(target) - begun) * share / self.substeps
                rubbed = self._step(inertia, rubbed, place, place - x)
                x = place
                if share < self.substeps:
                    fine.append(inertia.readings(rubbed.force))
            rubbing[sample], pressing[sample] = rubbed.force[:n], rubbed.force[n:]
            node_states[sample], depth[sample], carried[sample] = rubbed.state, rubbed.depth, self.carried
            fine.append(inertia.readings(rubbed.force))
            if sample % 500 == 0:
                progress(f"sliding, {motion.t_s[sample]:.1f} of {motion.t_s[-1]:.1f} s")
        energy, lost = math.nan, (math.nan, "no inertia")
        if isinstance(inertia, Modal):
            lost = float(self.loss[0]), self.loss_from
            missing = self.work - (inertia.energy(rubbed.force) - start) - inertia.lost
            energy = abs(missing) / max(self.turnover, TINY_DIVISOR)
        every = np.array(fine)
        readings, amplified = every[:: self.substeps], amplify(every, self.substeps)
        return Slide(
            motion, self.body.x, names, readings, amplified,
            pressing.sum(axis=1) * length, -rubbing.sum(axis=1) * length, depth,
            pressing, rubbing, node_states, carried, length, tied, self.friction,
            self.dynamics, self.why, self.body.ridge_pitch, *lost, self.first_Hz, self.highest_Hz,
            self.relaxed, self.unresolved, energy, self.in_groove, self.flank_push, perf_counter() - began,
            self._status(bool((pressing > 0).any()), float(depth.max())),
        )  # fmt: skip

    def _inertia(self, force: np.ndarray) -> Inertia:
        body = self.body
        if self.dynamics == "quasi-static":
            return AtRest(body.compliance, self.rows)
        step = 1 / (self.motion.rate_Hz * self.substeps)
        return Modal(body.modes, body.compliance, self.rows, body.reading_modes, step, self.loss, force)

    def _landed(self, x: float) -> Rubbed:
        """The finger pressed on the texture at its start: it lands without friction, which then holds it."""
        still = AtRest(self.body.compliance, self.rows)
        none = np.zeros(2 * self.n)
        nothing = Rubbed(none, none, 0.0, np.zeros(self.n, dtype=np.int64), 0, "newton", 0.0)
        friction, self.friction = self.friction, 0.0
        # Landing without friction leaves no tangential forces; those of a real landing are not known.
        landed = self._step(still, nothing, x, 0.0)
        self.friction = friction
        resting_state = STICKING_NODE if friction > 0 else SLIPS_RIGHT
        return replace(landed, state=np.where(landed.state == OPEN_NODE, OPEN_NODE, resting_state))

    def _step(self, inertia: Inertia, before: Rubbed, x: float, drift: float) -> Rubbed:
        """One step: the contact at the place x of the finger, which has moved by `drift` since the step `before`."""
        n, body = self.n, self.body
        # The skin does not stay where the finger is: friction carries the contact along.
        place = body.x + x + self.carried
        recess = self.felt.recess(place)
        free = inertia.free()
        laws = Laws(
            inertia.compliance, self.rise + recess, before.moved[:n], drift, self.friction, free, self.depth, self.load
        )
        rubbed = rub(laws, before.state)
        self.relaxed += rubbed.method != "newton"
        self.unresolved += rubbed.violation > UNRESOLVED_VIOLATION
        self._watch(rubbed, place, recess)
        inertia.accept(rubbed.force)
        if isinstance(inertia, Modal):
            # Work of the contact forces over the step by the trapezoidal rule; the balance with stored and lost energy
            # checks the time steps.
            mean, change = (before.force + rubbed.force) / 2, rubbed.moved - before.moved
            self.work += float(mean @ change)
            self.turnover += float(np.abs(mean * change).sum())
        pressed = rubbed.force[n:].sum()
        self.carried = float(rubbed.force[n:] @ rubbed.moved[:n] / pressed) if pressed > 0 else 0.0
        return rubbed

    def _watch(self, rubbed: Rubbed, place: np.ndarray, recess: np.ndarray) -> None:
        """Raise `ContactRangeError` for a contact beyond the known range; record the depth of skin in grooves."""
        touching = np.flatnonzero(rubbed.force[self.n :] > 0)
        if not len(touching):
            return
        refuse_end(rubbed.force[self.n :], self.body)
        low, high = self.felt.span
        # Near the end of the texture a hat function would average over nothing.
        margin = float(self.body.hats.max())
        if place[touching[0]] < low + margin or place[touching[-1]] > high - margin:
            raise ContactRangeError(
                f"the contact, {place[touching[0]]:.3g} to {place[touching[-1]]:.3g} mm, leaves the profile, {low:g} "
                f"to {high:g} mm: start further inside, or slide less far"
            )
        under = slice(touching[0], touching[-1] + 1)
        stands = rubbed.depth - self.rise[under] - rubbed.moved[self.n :][under]
        deep = np.minimum(stands, recess[under])[recess[under] < FAR_MM / 100]
        if (deepest := float(deep.max(initial=0.0))) > 0:
            width = float(place[under][-1] - place[under][0]) + margin
            self.in_groove = max(self.in_groove, deepest)
            self.flank_push = max(self.flank_push, deepest / min(self.texture.wavelength or width, width))

    def _status(self, touched: bool, deepest: float) -> str:
        """The status of the whole scene: the causes of doubt, or "ok"."""
        tissue = float(self.body.z.max()) - self.body.bone_top
        notes = []
        if not touched:
            return "no contact: the finger does not reach the texture"
        if self.unresolved:
            notes.append(f"{self.unresolved} steps do not fulfil the laws of contact")
        if deepest > SMALL_STRAIN_SHARE * tissue:
            notes.append(f"pressed by {deepest / tissue:.0%} of the tissue, where small strain is doubtful")
        if self.in_groove > DEEP_IN_GROOVE_MM:
            notes.append(
                f"skin stands up to {self.in_groove:.2g} mm deep in grooves: the flanks' sideways push is not modelled"
            )
        return "doubtful: " + "; ".join(notes) if notes else "ok"


def amplify(signal: np.ndarray, substeps: int) -> np.ndarray:
    """Every `substeps`-th row of a signal (n, g) after a low pass at `AMPLIFIER_PASS_BAND` of the remaining rate."""
    if substeps == 1:
        return signal
    # Of odd length and symmetric, so that the filter delays nothing.
    taps = firwin(2 * HALF_FILTER_TAPS * substeps + 1, 2 * AMPLIFIER_PASS_BAND / substeps)
    return convolve1d(signal, taps, axis=0, mode="nearest")[::substeps]


def highest_frequency(texture: Texture, motion: Motion, ridge_pitch: float) -> float:
    """Highest fundamental (Hz) of a scene: of the texture and of the finger's ridges at the largest speed.

    A profile without a period counts with the shortest wavelength that can be felt: the pitch of the ridges or, without
    ridges, 0.4 mm.
    """
    shortest = min(filter(None, (texture.wavelength, ridge_pitch)), default=FINEST_MM)
    if texture.wavelength is None and math.isfinite(texture.span[0]):
        shortest = min(shortest, FINEST_MM)
    return motion.fastest_mm_s / shortest


FINEST_MM = 0.4


def choose_dynamics(asked: str, highest_Hz: float, first_Hz: float) -> tuple[str, str]:
    """Quasi-static or modal, and the reason."""
    if asked != "auto":
        return asked, "as asked"
    fast = highest_Hz > SLOW_FREQUENCY_RATIO * first_Hz
    share = f"{'more' if fast else 'less'} than {SLOW_FREQUENCY_RATIO:g} of the first mode"
    compared = f"the scene reaches {highest_Hz:.3g} Hz, {share}"
    return "modal" if fast else "quasi-static", f"{compared}, {first_Hz:.3g} Hz"
