"""Finds the fundamental of which a line and the others beside it are harmonics, and whether that is certain.

Lines at wavenumbers k_1, k_2, ... belong to one period if they are whole multiples of k; the period is 1 / k. The
candidates are the chosen line's wavenumber over 1, 2, ... 6. A candidate is accepted if lines of another texture would
hardly lie so near to its multiples by chance. Example: lines at 0.424 and 0.637 per mm (2.36 and 1.57 mm) are the 2nd
and 3rd multiple of 0.2123 per mm, so the period is 4.71 mm.
"""

import math
from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

from papilla.estimators.wavelength.spectrum import Line, Spectrum

HARMONIC_SLACK_RESOLUTIONS, FAINTEST_HARMONIC, MOST_SUBHARMONICS = 0.15, 0.05, 6
"""Resolutions by which a harmonic may miss its place; smallest amplitude of a harmonic relative to the strongest line;
and largest order of that line."""
FITTED_HARMONICS = 5
"""Of a wave, that are fitted with it."""
CONFIRMED_CHANCE = 1e-2
"""Chance of noise at a single place that is tested for a reason: where many searches agreed, or where a fundamental
would be."""
HINTING_AMPLITUDE, HINTING_CHANCE = 0.25, 5e-4
"""Amplitude relative to the chosen line's, and chance, of a faint line that may yet turn out to be another harmonic of
a missing fundamental."""
COINCIDENCE_CHANCE, LOUD_AMPLITUDE_SHARE, FAINT_COINCIDENCE_CHANCE = 0.02, 0.3, 0.001
"""Chance with which lines of another texture may look like harmonics; and the smaller one that is required if none of
these lines has the given share of the strongest line's amplitude, because there are more faint lines of unknown
origin."""
PLAINER_CHANCE_RATIO = 0.1
"""Ratio of the chance of a lower fundamental to that of a higher one, below which the lower one is accepted."""
NEAR_HARMONIC_REACHES = 3.0
"""Factor of its reach within which a line may still be a harmonic: the skin shifts lines from stroke to stroke."""
IN_STEP = 0.25
"""Difference of a wavenumber from a whole multiple of the ridges' wavenumber, in ridge orders, up to which all ridges
feel it in phase."""
HEARD_IN_STEP, HIDDEN_HARMONIC_AMPLITUDES = 0.125, 0.25
"""Amplitude, relative to a line, that another of its harmonics may have without being visible: if the finger's ridges
feel the line in phase, and otherwise. Most gratings that a ridged finger feels show another harmonic that is louder
(docs/adr/0017)."""
SEEN_POWER_RATIO = 25.0
"""Power over the background above which hardly any line is missed."""


class FundamentalPeriod(NamedTuple):
    """wavenumber (1/mm) of which the lines are harmonics; other : another possible one, 0 for none; loud : whether a
    loud line supports the other one."""

    wavenumber: float
    other: float
    loud: bool = False


def no_multiples(lines: Sequence[Any], wavenumber: float, reach: float) -> list[Any]:
    """The lines that are farther than `reach` from every multiple of a wavenumber."""
    order = (max(round(line.wavenumber / wavenumber), 1) for line in lines)
    return [line for n, line in zip(order, lines, strict=True) if abs(line.wavenumber - n * wavenumber) > reach]


def fundamental_of(
    chosen: Line, others: Sequence[Line], reach: float, possible: Collection[Line], ridged: bool
) -> FundamentalPeriod:
    """The greatest common divisor, in wavenumber, of the chosen line and the others; the chosen line's wavenumber if
    there is no sign of a lower one.

    A divisor (the chosen wavenumber over 2 to 6) is accepted if lines of another texture would hardly lie so near to
    its multiples by chance. Otherwise the question stays open: a loud line that fits is a doubt as long as it fits.

    others : lines that are not multiples of the chosen one; reach : how far (1/mm) a line may miss its place;
    possible : lines that may be the surface's; ridged : whether the finger's ridges may amplify a harmonic above the
    fundamental, so that a line near the place of one is a doubt. Faint lines alone are no proof: a contact with
    stick-slip may repeat only after several periods.
    """
    k, best = chosen.wavenumber, 1.0
    accepted = open_ = FundamentalPeriod(k, 0.0)
    for divisor in range(2, MOST_SUBHARMONICS + 1):
        base = k / divisor
        slack = min(reach, 0.1 * base)
        off = [abs(line.wavenumber - max(round(line.wavenumber / base), 1) * base) / slack for line in others]
        widest = NEAR_HARMONIC_REACHES if ridged else 1
        near = [(by, line) for by, line in zip(off, others, strict=True) if by < widest and line in possible]
        fits = [line for by, line in near if by < 1]
        if ridged and near and not open_.other:
            open_ = FundamentalPeriod(k, base)
        if not fits:
            continue
        # How often lines of another texture would fit by chance.
        chance = (2 * slack / base * len(others)) ** len(fits)
        loud = max(line.amplitude for line in fits) > LOUD_AMPLITUDE_SHARE * chosen.amplitude
        if chance < min(COINCIDENCE_CHANCE if loud else FAINT_COINCIDENCE_CHANCE, PLAINER_CHANCE_RATIO * best):
            least = HEARD_IN_STEP * max(line.amplitude for line in (chosen, *fits))
            orders = [round(line.wavenumber / base) for line in (chosen, *fits) if line.amplitude > least]
            best, accepted = chance, FundamentalPeriod(base, 0.0 if math.gcd(*orders) == 1 else k)
        if (loud or chance <= COINCIDENCE_CHANCE) and not open_.loud and (loud or not open_.other):
            open_ = FundamentalPeriod(k, base, loud)
    return accepted if accepted.wavenumber < k else open_


def hints(spectrum: Spectrum, lines: list[Line], chosen: Line, divisor: int, near: float, lowest: float) -> bool:
    """Whether there is more than noise at the first multiples of the wavenumber whose `order`-th harmonic the chosen
    line would be: too little for a line of a search, but too much to call the harmonic a wavelength.

    near : distance (1/mm) from a line and from zero that is not tested; lowest : wavenumber of the range; below it only
    the fundamental itself is tested.
    """
    half = int(spectrum.resolution / 2)
    for order in range(1, 2 * divisor + 2 if chosen.wavenumber > divisor * lowest else 2):
        place = order * chosen.wavenumber / divisor
        excluded = place < near or any(abs(line.wavenumber - place) < near for line in lines)
        if excluded or math.gcd(order, divisor) > 1:
            continue
        at = round(place / spectrum.step)
        heard = spectrum.power[max(at - half, 0) : at + half + 1].max(initial=0.0) ** 0.5
        # A power that is faint compared with the line is not a sign, even if it is more than noise.
        least, rare = HINTING_AMPLITUDE, HINTING_CHANCE
        if order == 1:
            least, rare = FAINTEST_HARMONIC, CONFIRMED_CHANCE / (divisor - 1)
        if heard > least * chosen.amplitude and spectrum.chance(place) < rare:
            return True
    return False


def lone(line: Line, ridge_pitch_mm: float) -> bool:
    """Whether a finger with ridges of this pitch (0 for none) may feel this line as a harmonic of a fundamental that is
    hidden in the background."""
    if not ridge_pitch_mm:
        return False
    orders = line.wavenumber * ridge_pitch_mm
    heard = HEARD_IN_STEP if abs(orders - max(round(orders), 1)) < IN_STEP else HIDDEN_HARMONIC_AMPLITUDES
    return line.ratio * heard**2 < SEEN_POWER_RATIO
