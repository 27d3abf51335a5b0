"""The textile paper: vibration over fabrics, summed in bands. Its recordings and scores are not published."""

from functools import cache
from typing import NamedTuple

import numpy as np

from papilla import fem
from papilla.estimators.published.texture import band_amplitudes, best_band, concordance, printed_bands
from papilla.finger import Finger
from papilla.studies.figures.picture import Curve, Panel, Picture, Shade, Table
from papilla.studies.figures.registry import Figure
from papilla.studies.reproduce.experiments.textiles import STROKE_MM_S, RATE_Hz
from papilla.textures import MeasuredProfile


class Fabric(NamedTuple):
    """Of table 1: yarns of warp and weft in "10 cm", English count of the warp yarn and of the weft, g/m2."""

    warp: int
    weft: int
    count_warp: float
    count_weft: float
    weight: int

    @property
    def pitch_mm(self) -> float:
        """Of the warp, with its density taken as an inch's: only so do the weights agree."""
        return 25.4 / self.warp

    @property
    def yarn_mm(self) -> float:
        """Diameter of the warp yarn, 1 / (28 sqrt(count)) inch: Peirce 1937, doi:10.1080/19447023708658809."""
        return 25.4 / (28 * self.count_warp**0.5)


FABRICS = {
    "1": Fabric(95, 64, 16, 16, 244),
    "2": Fabric(65, 100, 40, 32, 208),
    "3": Fabric(175, 108, 40, 40, 175),
    "4": Fabric(78, 59, 12, 8, 341),
}
FORCE_N, SECONDS, STEP_MM = 0.8, 2.0, 0.01
"""Load as printed; of a record; spacing of a profile's points."""
UNEVEN = 0.15
"""Standard deviation of the yarns' heights over their mean: an assumption."""
BAND_HZ = (18.0, 118.0)
PRINTED_BANDS = (
    "0-10",
    "1-21, 10-30",
    "2-22, 30-50",
    "3-53, 50-100",
    "8-58, 100-150",
    "13-63, 150-200",
    "18-118, 200-300",
    "28-128, 300-400",
    "38-138, 400-500",
)
"""Table 2: the lowest start with its widest end, and the highest."""


def profile(fabric: Fabric, seed: int) -> MeasuredProfile:
    """A plain weave along a weft yarn: warp yarns of their diameter, over and under in turn, of uneven height."""
    x = np.arange(-30.0, 60.0, STEP_MM)
    yarn = np.floor(x / fabric.pitch_mm).astype(int)
    uneven = 1 + UNEVEN * np.random.default_rng(seed).standard_normal(np.ptp(yarn) + 1)
    turn = 2 * np.pi * x / fabric.pitch_mm
    height = 0.25 * fabric.yarn_mm * (np.cos(turn) + np.cos(turn / 2)) * uneven[yarn - yarn.min()]
    return MeasuredProfile(x, height)


@cache
def _records() -> np.ndarray:
    """(n, 4) of the middle gauge over each fabric, microstrain about its mean."""
    finger, motion = Finger.default(), fem.Motion.steady(STROKE_MM_S, SECONDS + 0.2, RATE_Hz)
    section, found = fem.prepare_section(finger), []
    for number, fabric in enumerate(FABRICS.values()):
        slid = fem.slide(
            finger, profile(fabric, number), motion, force=FORCE_N, friction=0.3, section=section, length_mm=7.0
        )
        output = slid.amplified[-round(SECONDS * RATE_Hz) :, 2]
        found.append(output - output.mean())
    return np.column_stack(found)


def vibration() -> Picture:
    """Vibration over fabric 1.

    Strain of the middle gauge of the default finger by finite elements at 0.8 N and 10 mm/s, friction 0.3, over a
    made-up plain weave with the printed density and yarn of fabric 1, across its warp; its recording, by an
    accelerometer on a nail, is not published. Right: the amplitude spectrum of all four.
    """
    records = _records()
    time = np.arange(len(records)) / RATE_Hz
    edges = np.arange(0.0, 201.0)
    curves = tuple(
        Curve(f"fabric {name}", edges[:-1] + 0.5, band_amplitudes(own, RATE_Hz, edges), color=k)
        for k, (name, own) in enumerate(zip(FABRICS, records.T, strict=True))
    )
    tops = ", ".join(f"{one.x[np.argmax(one.y)]:.0f}" for one in curves)
    panels = (
        Panel("fabric 1", "time, s", "strain about its mean, microstrain", (Curve("", time, records[:, 0]),)),
        Panel("spectra", "frequency, Hz", "amplitude, microstrain Hz", curves),
    )
    return Picture(panels, columns=2, found=f"Greatest lines of fabrics 1 to 4: {tops} Hz.")


def _roughness() -> np.ndarray:
    """(4,) standard deviation of each profile in micrometres."""
    heights = (profile(fabric, number).height_mm for number, fabric in enumerate(FABRICS.values()))
    return np.array([1000 * height.std() for height in heights])


def roughness() -> Picture:
    """Roughness of the four fabrics.

    In print, scores of thirty assessors, whose numbers are not printed; no person is simulated. Here in their place the
    standard deviation of the height of the made-up weaves.
    """
    rough = _roughness()
    bars = Curve("", np.arange(4), rough, "bars")
    panel = Panel("", "fabric", "standard deviation of the height, µm", (bars,), names=tuple(FABRICS))
    order = " < ".join(np.array(list(FABRICS))[np.argsort(rough)].tolist())
    return Picture((panel,), found=f"In rising order: {order}.")


def contour() -> Picture:
    """Amplitude in every band from a lower to a higher frequency.

    The mean of the four records of figure 2 (b). Print finds most of the amplitude within 0 to 100 Hz.
    """
    edges = np.arange(0.0, 501.0, 5.0)
    each = band_amplitudes(_records(), RATE_Hz, edges).mean(axis=1)
    total = np.append(0.0, np.cumsum(each))
    value = total[:, None] - total[None, :]
    shade = Shade(edges, edges, np.where(value > 0, value, np.nan), "amplitude, microstrain Hz")
    low, high = (np.array([edge]) for edge in BAND_HZ)
    point = Curve("printed best band", low, high, "points", origin="printed")
    found = f"{100 * total[20] / total[-1]:.0f} % of the amplitude lies within 0 to 100 Hz."
    return Picture((Panel("", "from, Hz", "to, Hz", (point,), shade),), found=found)


def bands() -> Picture:
    """The band of the greatest amplitude among all that the paper's cuts can have.

    Of each of nine sub-bands the one with the greatest amplitude in the records of figure 2 (b), out of all 11,770 that
    the printed steps allow, where the paper draws at random. Printed: 18 to 118 Hz, which is the lowest and widest
    seventh band of that grid.
    """
    best = [
        best_band(_records(), RATE_Hz, [one for one in printed_bands() if one[0] == number]) for number in range(1, 10)
    ]
    names = tuple(f"{one.low_Hz:g}-{one.high_Hz:g}" for one in best)
    bars = Curve("", np.arange(9), np.array([one.amplitude for one in best]), "bars")
    printed = Curve("printed: 18-118 Hz", np.array([6.0]), np.array([best[6].amplitude]), "points", origin="printed")
    overall = max(best, key=lambda one: one.amplitude)
    panel = Panel("", "band, Hz", "amplitude, microstrain Hz", (bars, printed), names=names)
    return Picture((panel,), found=f"Greatest of all: {overall.sentence}.")


def agreement() -> Picture:
    """Amplitude between 18 and 118 Hz beside the roughness of the four fabrics.

    Both over their greatest. In print the scores of figure 3 stand for roughness, with a concordance (Lin) of 0.985;
    here it is that of the made-up weaves. With four fabrics and thousands of bands to choose from, a high concordance
    proves little: see claim E15.
    """
    heard, rough = band_amplitudes(_records(), RATE_Hz, BAND_HZ)[0], _roughness()
    found = concordance(heard / heard.max(), rough / rough.max())
    curves = (
        Curve("amplitude, 18-118 Hz", np.arange(4), heard / heard.max(), "bars"),
        Curve("roughness of the profile", np.arange(4), rough / rough.max(), "bars"),
    )
    panel = Panel("", "fabric", "over the greatest", curves, names=tuple(FABRICS), y_range=(0, 1.3))
    return Picture((panel,), found=f"Concordance {found.coefficient:.3f} (printed 0.985).")


def fabrics() -> Picture:
    """The fabrics, and the frequencies of their weaves at 10 mm/s.

    Densities, counts and weights are printed, "in 10 cm"; a weight follows from them only if they are in an inch. The
    last columns are the fundamental frequencies of warp and weft for either unit.
    """
    rows: list[tuple[str | float, ...]] = []
    for name, one in FABRICS.items():
        weights = [
            sum(
                yarns / unit * 590.5 / count
                for yarns, count in ((one.warp, one.count_warp), (one.weft, one.count_weft))
            )
            for unit in (25.4, 100.0)
        ]  # tex = 590.5 / count, mg a metre; a yarn a mm of 1 mg a metre weighs 1 g a m2
        lines = [f"{STROKE_MM_S * one.warp / unit:.0f}, {STROKE_MM_S * one.weft / unit:.0f}" for unit in (25.4, 100.0)]
        rows.append((name, f"{one.warp} x {one.weft}", str(one.weight), *(f"{w:.0f}" for w in weights), *lines))
    heads = ("fabric", "warp x weft", "g/m2, printed", "if an inch", "if 10 cm", "Hz, if an inch", "Hz, if 10 cm")
    return Picture(table=Table(heads, tuple(rows)))


def grid() -> Picture:
    """The frequency bands that the random steps allow.

    The lowest start with its widest end, and the highest, from all bands that the printed steps can make.
    """
    rows: list[tuple[str | float, ...]] = []
    for number, printed in enumerate(PRINTED_BANDS, start=1):
        own = [(low, high) for n, low, high in printed_bands() if n == number]
        ends = [max(pair for pair in own if pair[0] == low) for low in (min(own)[0], max(own)[0])]
        text = ", ".join(dict.fromkeys(f"{low}-{high}" for low, high in ends))
        rows.append((f"f{number - 1} - f{number}", text, printed, len(own)))
    heads = ("band", "lowest, highest, Hz", "printed", "bands")
    return Picture(table=Table(heads, tuple(rows)), found=f"{len(printed_bands())} bands in all.")


FIGURES = (
    Figure("fig. 2 (b)", vibration, ("E6",), "fabrics"),
    Figure("fig. 3", roughness, ("E11", "E12"), "fabrics"),
    Figure("fig. 4", contour, ("E8",), "fabrics"),
    Figure("fig. 5", bands, ("E7", "E9", "X3"), "fabrics"),
    Figure("fig. 6", agreement, ("E14", "E15"), "fabrics"),
    Figure("table 1", fabrics, ("X4",)),
    Figure("table 2", grid, ("E4", "E5")),
)
