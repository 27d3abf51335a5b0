"""Of which fundamental a line and the others beside it are harmonics, and whether that is sure."""

import math
from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

from papilla.estimators.spectrum import Line, Spectrum

SLACK, FAINT, SUBHARMONICS = 0.15, 0.05, 6
"""Resolutions that a harmonic may lie off its place, the least amplitude of one beside the strongest line's, and which
harmonic that line may be."""
CONFIRMED = 1e-2
"""Chance of noise at one place that is tested for a reason: where many searches agreed, or a fundamental would be."""
HINTING, SELDOM = 0.25, 5e-4
"""Amplitude beside the chosen line's, and chance, of what may yet become another harmonic of a missing fundamental."""
COINCIDENCE, LOUD, FAINTLY = 0.02, 0.3, 0.001
"""Chance with which lines of another texture may look like harmonics; and where none of these has so much of the
strongest line's amplitude, as there are more of the faint ones that nobody knows."""
PLAINER = 0.1
"""Chance of a lower fundamental beside that of a higher one, from which it is believed."""
NEAR = 3.0
"""Times its reach within which a line may still be a harmonic: the skin shifts lines from stroke to stroke."""
IN_STEP = 0.25
"""Ridge orders by which a wavenumber may differ from a whole number and be felt by all ridges in step."""
HEARD_IN_STEP, HEARD = 0.125, 0.25
"""Of a line, amplitude that another of its harmonics may have and not be seen: where the finger's ridges feel the line
in step, and elsewhere. Of gratings that a ridged finger feels most show another one that is louder (docs/adr/0017)."""
SEEN = 25.0
"""Power over the background from which hardly any line is missed."""


class Period(NamedTuple):
    """wavenumber (1/mm) of which the lines are harmonics; other : the one that may be it as well, 0 for none; loud :
    whether a loud line keeps that open."""

    wavenumber: float
    other: float
    loud: bool = False


def no_multiples(lines: Sequence[Any], wavenumber: float, reach: float) -> list[Any]:
    """Those of some lines that lie farther than `reach` from every multiple of a wavenumber."""
    order = (max(round(line.wavenumber / wavenumber), 1) for line in lines)
    return [line for n, line in zip(order, lines, strict=True) if abs(line.wavenumber - n * wavenumber) > reach]


def fundamental_of(chosen: Line, others: Sequence[Line], reach: float, own: Collection[Line], ridged: bool) -> Period:
    """The greatest common divisor, in wavenumber, of the chosen line and the others; the chosen's where there is no
    sign of another.

    A divisor (the chosen wavenumber over 2 to 6) is believed where lines of another texture would hardly lie so near to
    its multiples by chance. Where they might, it stays open: a loud line that fits is a doubt as long as it fits.

    others : lines that are no multiples of the chosen one; reach : how far (1/mm) a line may lie off its place; own :
    those that may be the surface's; ridged : the finger's ridges may feel a harmonic louder than the fundamental,
    so that a line near the place of one is a doubt. Faint ones alone are no proof: a contact that sticks and slips may
    repeat after several periods only.
    """
    k, best, found, open_ = chosen.wavenumber, 1.0, Period(chosen.wavenumber, 0.0), Period(chosen.wavenumber, 0.0)
    for divisor in range(2, SUBHARMONICS + 1):
        base = k / divisor
        slack = min(reach, 0.1 * base)
        off = [abs(line.wavenumber - max(round(line.wavenumber / base), 1) * base) / slack for line in others]
        near = [
            (by, line) for by, line in zip(off, others, strict=True) if by < (NEAR if ridged else 1) and line in own
        ]
        fits = [line for by, line in near if by < 1]
        if ridged and near and not open_.other:
            open_ = Period(k, base)
        if not fits:
            continue
        # How often lines of another texture would fit by chance.
        chance = (2 * slack / base * len(others)) ** len(fits)
        loud = max(line.amplitude for line in fits) > LOUD * chosen.amplitude
        if chance < min(COINCIDENCE if loud else FAINTLY, PLAINER * best):
            least = HEARD_IN_STEP * max(line.amplitude for line in (chosen, *fits))
            orders = [round(line.wavenumber / base) for line in (chosen, *fits) if line.amplitude > least]
            best, found = chance, Period(base, 0.0 if math.gcd(*orders) == 1 else k)
        if (loud or chance <= COINCIDENCE) and not open_.loud and (loud or not open_.other):
            open_ = Period(k, base, loud)
    return found if found.wavenumber < k else open_


def hints(spectrum: Spectrum, lines: list[Line], chosen: Line, divisor: int, near: float, lowest: float) -> bool:
    """Whether there is more than noise at the first multiples of the wavenumber of which the chosen line would be such
    a harmonic: too little for a line of a search, and too much to call the harmonic a wavelength.

    near : 1/mm, from a line and from zero, that is not tested; lowest : wavenumber of the range, below which only
    the fundamental itself is searched for.
    """
    half = int(spectrum.resolution / 2)
    for order in range(1, 2 * divisor + 2 if chosen.wavenumber > divisor * lowest else 2):
        place = order * chosen.wavenumber / divisor
        known = place < near or any(abs(line.wavenumber - place) < near for line in lines)
        if known or math.gcd(order, divisor) > 1:
            continue
        at = round(place / spectrum.step)
        heard = spectrum.power[max(at - half, 0) : at + half + 1].max(initial=0.0) ** 0.5
        # What is faint beside the line, if it is more than noise, is no sign.
        least, rare = (FAINT, CONFIRMED / (divisor - 1)) if order == 1 else (HINTING, SELDOM)
        if heard > least * chosen.amplitude and spectrum.chance(place) < rare:
            return True
    return False


def lone(line: Line, ridge_pitch_mm: float) -> bool:
    """Whether a finger with ridges of a pitch (0 for none) may feel this line as a harmonic of a fundamental that is
    lost in the background."""
    if not ridge_pitch_mm:
        return False
    orders = line.wavenumber * ridge_pitch_mm
    heard = HEARD_IN_STEP if abs(orders - max(round(orders), 1)) < IN_STEP else HEARD
    return line.ratio * heard**2 < SEEN
