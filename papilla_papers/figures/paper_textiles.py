"""The textile paper: vibration over fabrics, summed in bands. Its recordings and scores are not published."""

from functools import cache
from typing import NamedTuple

import numpy as np

from papilla import fem
from papilla.core.units import INCH_MM, PER_CENT, UM_PER_MM
from papilla.model.finger import Finger
from papilla.model.textures import MeasuredProfile
from papilla_papers.claims.experiments import gratings
from papilla_papers.claims.experiments.textiles import TEXTILE_SCENE, YARNS_PER_INCH, RATE_Hz, fabric
from papilla_papers.claims.signals import listed
from papilla_papers.figures.picture import Curve, Panel, Picture, PrintedTable, Shade, printed
from papilla_papers.methods.texture import band_amplitudes, best_band, concordance, printed_bands

TEXTILE_FIGURES = TEXTILE_SCENE.figures
RMS_UNIT, FELT_SIGNAL, SYNTHETIC_SIGNAL = "rms", "finger by finite elements", "synthetic"
TEX_OF_COUNT, YARNS_OF_COUNT = 590.5, 28
"""Mass (g a km) of a yarn of the English count 1, and how many of them lie in an inch side by side: Peirce 1937,
doi:10.1080/19447023708658809. The mass falls as the count, the diameter as its root."""
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
"""Table 2: as printed, "lowest start-its widest end, highest start-its end", in Hz."""


class Fabric(NamedTuple):
    """Of table 1: yarns of warp and weft in "10 cm", English counts of both yarns, g/m2."""

    yarns: tuple[int, int]
    counts: tuple[float, float]
    weight: int

    def weight_if(self, length_mm: float) -> float:
        """The weight (g/m2) that follows if the yarns are those of this length: a yarn a mm of 1 g a km weighs 1."""
        both = zip(self.yarns, self.counts, strict=True)
        return sum(TEX_OF_COUNT / count * yarns / length_mm for yarns, count in both)


PRINTED_FABRICS = {
    name: Fabric(yarns, counts, weight)
    for (name, yarns), counts, weight in zip(
        YARNS_PER_INCH.items(), TEXTILE_FIGURES.counts, TEXTILE_FIGURES.weights_g_m2, strict=True
    )
}


def profile(fabric: Fabric, seed: int) -> MeasuredProfile:
    """A plain weave along a weft yarn: warp yarns of their diameter, over and under in turn, of uneven height."""
    # The density of the warp is taken as an inch's: only so do the weights agree
    pitch_mm, radius_mm = INCH_MM / fabric.yarns[0], INCH_MM / (YARNS_OF_COUNT * fabric.counts[0] ** 0.5) / 2
    begin_mm, end_mm = TEXTILE_FIGURES.profile_mm
    x = np.arange(begin_mm, end_mm, TEXTILE_FIGURES.point_mm)
    yarn = np.floor(x / pitch_mm).astype(int)
    uneven = 1 + TEXTILE_FIGURES.uneven * np.random.default_rng(seed).standard_normal(np.ptp(yarn) + 1)
    turn = 2 * np.pi * x / pitch_mm
    height = radius_mm * (np.cos(turn) + np.cos(turn / 2)) / 2 * uneven[yarn - yarn.min()]
    return MeasuredProfile(x, height)


@cache
def _records() -> dict[str, np.ndarray]:
    """(n, 4) over each fabric, over its standard deviation: sines of the weave in noise, and the middle gauge."""
    motion = fem.Motion.steady(TEXTILE_SCENE.stroke_mm_s, TEXTILE_FIGURES.seconds + TEXTILE_FIGURES.settling_s, RATE_Hz)
    section, outputs = fem.prepare_section(Finger.default()), []
    for number, weave in enumerate(PRINTED_FABRICS.values()):
        slid = gratings.default_slide(profile(weave, number), motion, force=TEXTILE_FIGURES.force_N, section=section)
        output = slid.amplified[-round(TEXTILE_FIGURES.seconds * RATE_Hz) :, gratings.MIDDLE_GAUGE]
        outputs.append(output - output.mean())
    sines = [fabric(name, np.random.default_rng(k)) for k, name in enumerate(PRINTED_FABRICS)]
    records = {SYNTHETIC_SIGNAL: np.column_stack(sines), FELT_SIGNAL: np.column_stack(outputs)}
    return {source: record / record.std() for source, record in records.items()}


def vibration() -> Picture:
    """Vibration over the fabrics.

    Their recordings, by an accelerometer on a nail, are not published. Above: strain of the middle gauge of the default
    finger by finite elements at 0.8 N and 10 mm/s, friction 0.3, over made-up plain weaves with the printed densities
    and yarns, across their warp. Below: sines of both yarn densities in noise that falls, as the claims have them.
    Left: fabric 1 in time; right: amplitude spectra of all four.
    """
    edges, panels, words = np.arange(TEXTILE_FIGURES.spectra_Hz + 1.0), [], []
    for source in (FELT_SIGNAL, SYNTHETIC_SIGNAL):
        records = _records()[source]
        time = np.arange(len(records)) / RATE_Hz
        curves = tuple(
            Curve(f"fabric {name}", edges[:-1] + 0.5, band_amplitudes(record, RATE_Hz, edges), color=k)
            for k, (name, record) in enumerate(zip(PRINTED_FABRICS, records.T, strict=True))
        )
        panels += [
            Panel(
                f"fabric 1, {source}",
                "time, s",
                RMS_UNIT,
                (Curve("", time, records[:, 0]),),
                x_range=(0, TEXTILE_FIGURES.seconds),
            ),
            Panel(f"spectra, {source}", "frequency, Hz", f"amplitude, {RMS_UNIT} Hz", curves),
        ]
        words.append(f"{listed((curve.x[np.argmax(curve.y)] for curve in curves), '.0f')} Hz ({source})")
    return Picture(tuple(panels), columns=2, found=f"Greatest lines of fabrics 1 to 4: {'; '.join(words)}.")


def _roughness() -> np.ndarray:
    """(4,) standard deviation of each profile in micrometres."""
    heights = (profile(weave, number).height_mm for number, weave in enumerate(PRINTED_FABRICS.values()))
    return np.array([UM_PER_MM * height.std() for height in heights])


def roughness() -> Picture:
    """Roughness of the four fabrics.

    In print, scores of thirty assessors, whose numbers are not printed; no person is simulated. Here in their place the
    standard deviation of the height of the made-up weaves.
    """
    rough = _roughness()
    bars = Curve("", np.arange(len(PRINTED_FABRICS)), rough, "bars")
    panel = Panel("", "fabric", "standard deviation of the height, µm", (bars,), names=tuple(PRINTED_FABRICS))
    order = " < ".join(np.array(list(PRINTED_FABRICS))[np.argsort(rough)].tolist())
    return Picture((panel,), found=f"In rising order: {order}.")


def contour() -> Picture:
    """Amplitude in every band from a lower to a higher frequency.

    The mean of the four records of figure 2 (b), of both kinds. Print finds most of the amplitude within 0 to 100 Hz.
    """
    (first, main, last), panels, words = TEXTILE_SCENE.fabrics.edges_Hz, [], []
    edges = np.arange(first, last + 1.0, TEXTILE_FIGURES.step_Hz)
    for source, records in _records().items():
        total = np.append(0.0, np.cumsum(band_amplitudes(records, RATE_Hz, edges).mean(axis=1)))
        value = total[:, None] - total[None, :]
        shade = Shade(edges, edges, np.where(value > 0, value, np.nan), f"amplitude, {RMS_UNIT} Hz")
        point = printed("printed best band", *TEXTILE_SCENE.best_band_Hz)
        panels.append(Panel(source, "from, Hz", "to, Hz", (point,), shade))
        words.append(f"{PER_CENT * total[edges == main][0] / total[-1]:.0f} % ({source})")
    return Picture(tuple(panels), columns=2, found=f"Within 0 to 100 Hz lies {', '.join(words)} of the amplitude.")


def bands() -> Picture:
    """The band of the greatest amplitude among all that the paper's cuts can have.

    Of each of nine sub-bands the one with the greatest amplitude in the records of figure 2 (b), out of all 11,770 that
    the printed steps allow, where the paper draws at random. Printed: 18 to 118 Hz, which is the lowest and widest
    seventh band of that grid.
    """
    panels, words = [], []
    for source, records in _records().items():
        best = [
            best_band(records, RATE_Hz, [one for one in printed_bands() if one[0] == number])
            for number in range(1, len(PRINTED_BANDS) + 1)
        ]
        amplitude = np.array([one.amplitude for one in best])
        bars = Curve("", np.arange(len(best)), amplitude, "bars")
        point = printed("printed: 18-118 Hz", TEXTILE_FIGURES.best_band, amplitude[TEXTILE_FIGURES.best_band])
        names = tuple(f"{one.low_Hz:g}-{one.high_Hz:g}" for one in best)
        panels.append(Panel(source, "band, Hz", f"amplitude, {RMS_UNIT} Hz", (bars, point), names=names))
        words.append(f"{max(best, key=lambda band: band.amplitude).sentence} ({source})")
    return Picture(tuple(panels), found=f"Greatest of all: {'; '.join(words)}.")


def agreement() -> Picture:
    """Amplitude between 18 and 118 Hz beside the roughness of the four fabrics.

    All over their greatest. In print the scores of figure 3 stand for roughness, with a concordance (Lin) of 0.985;
    here it is that of the made-up weaves. The synthetic fabrics are equally loud, so that nothing is followed there.
    With four fabrics and thousands of bands to choose from, a high concordance proves little: see claim E15.
    """
    rough, curves, words = _roughness(), [], []
    for source, records in _records().items():
        loudness = band_amplitudes(records, RATE_Hz, TEXTILE_SCENE.best_band_Hz)[0]
        curves.append(Curve(f"18-118 Hz, {source}", np.arange(len(PRINTED_FABRICS)), loudness / loudness.max(), "bars"))
        words.append(f"{concordance(loudness / loudness.max(), rough / rough.max()).coefficient:.3f} ({source})")
    curves.append(Curve("roughness of the profile", np.arange(len(PRINTED_FABRICS)), rough / rough.max(), "bars"))
    ends = TEXTILE_FIGURES.over_greatest
    panel = Panel("", "fabric", "over the greatest", tuple(curves), names=tuple(PRINTED_FABRICS), y_range=ends)
    return Picture((panel,), found=f"Concordance {', '.join(words)}; printed 0.985.")


def fabrics() -> Picture:
    """The fabrics, and the frequencies of their weaves at 10 mm/s.

    Densities, counts and weights are printed, "in 10 cm"; a weight follows from them only if they are in an inch. The
    last columns are the fundamental frequencies of warp and weft for either unit.
    """
    lengths_mm = (INCH_MM, TEXTILE_SCENE.stated_mm)
    rows = tuple(
        (
            name,
            " x ".join(map(str, weave.yarns)),
            str(weave.weight),
            *(f"{weave.weight_if(length):.0f}" for length in lengths_mm),
            *(
                listed((TEXTILE_SCENE.stroke_mm_s * yarns / length for yarns in weave.yarns), ".0f")
                for length in lengths_mm
            ),
        )
        for name, weave in PRINTED_FABRICS.items()
    )
    heads = ("fabric", "warp x weft", "g/m2, printed", "if an inch", "if 10 cm", "Hz, if an inch", "Hz, if 10 cm")
    return Picture(table=PrintedTable(heads, rows))


def grid() -> Picture:
    """The frequency bands that the random steps allow.

    The lowest start with its widest end, and the highest, from all bands that the printed steps can make.
    """
    rows: list[tuple[str | float, ...]] = []
    for number, text in enumerate(PRINTED_BANDS, start=1):
        allowed = [(low, high) for n, low, high in printed_bands() if n == number]
        ends = [max(pair for pair in allowed if pair[0] == low) for low in (min(allowed)[0], max(allowed)[0])]
        computed = ", ".join(dict.fromkeys(f"{low}-{high}" for low, high in ends))
        rows.append((f"f{number - 1} - f{number}", computed, text, len(allowed)))
    heads = ("band", "lowest, highest, Hz", "printed", "bands")
    return Picture(table=PrintedTable(heads, tuple(rows)), found=f"{len(printed_bands())} bands in all.")
