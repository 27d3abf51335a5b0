"""Of which fundamental a line and the others beside it are harmonics, and whether that is sure."""

import math

from papilla.estimators.spectrum import Line

SLACK, FAINT, SUBHARMONICS = 0.15, 0.05, 6
"""Resolutions that a harmonic may lie off its place, the least amplitude of one beside the strongest line's, and which
harmonic that line may be."""
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


def fundamental_of(chosen: Line, others: list[Line], reach: float, own: set[Line], ridged: bool) -> tuple[float, bool]:
    """The wavenumber (1/mm) of which the chosen line and the others are harmonics, the chosen's where there is no sign
    of one; and whether that is sure.

    others : lines that are no multiples of the chosen one; reach : how far (1/mm) a line may lie off its place; own :
    those that may be the surface's; ridged : the finger's ridges may feel a harmonic louder than the fundamental,
    so that a line near the place of one is a doubt. Faint ones alone are no proof: a contact that sticks and slips may
    repeat after several periods only.
    """
    k, sure, proven, best, fundamental = chosen.wavenumber, True, True, 1.0, chosen.wavenumber
    for divisor in range(2, SUBHARMONICS + 1):
        base = k / divisor
        slack = min(reach, 0.1 * base)
        off = [abs(line.wavenumber - max(round(line.wavenumber / base), 1) * base) / slack for line in others]
        near = [
            (by, line) for by, line in zip(off, others, strict=True) if by < (NEAR if ridged else 1) and line in own
        ]
        fits = [line for by, line in near if by < 1]
        sure = sure and not (ridged and near)
        if not fits:
            continue
        # How often lines of another texture would fit by chance.
        chance = (2 * slack / base * len(others)) ** len(fits)
        loud = max(line.amplitude for line in fits) > LOUD * chosen.amplitude
        if chance < min(COINCIDENCE if loud else FAINTLY, PLAINER * best):
            best, fundamental = chance, base
            least = HEARD_IN_STEP * max(line.amplitude for line in (chosen, *fits))
            orders = [round(line.wavenumber / base) for line in (chosen, *fits) if line.amplitude > least]
            proven = math.gcd(*orders) == 1
        sure = sure and not loud and chance > COINCIDENCE
    return fundamental, proven if fundamental < k else sure


def lone(line: Line, ridge_pitch_mm: float) -> bool:
    """Whether a finger with ridges of a pitch (0 for none) may feel this line as a harmonic of a fundamental that is
    lost in the background."""
    if not ridge_pitch_mm:
        return False
    orders = line.wavenumber * ridge_pitch_mm
    heard = HEARD_IN_STEP if abs(orders - max(round(orders), 1)) < IN_STEP else HEARD
    return line.ratio * heard**2 < SEEN
