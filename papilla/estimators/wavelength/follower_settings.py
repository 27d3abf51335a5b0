"""Tuned numbers of the follower: how much path it remembers, how often it searches, and when it believes an answer."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WindowSettings:
    """How much path is remembered, and how finely.

    cell : length of a cell in shortest wavelengths; averaging in it lowers the line of that wavelength by 3 %.
    span : path that is remembered, in longest wavelengths; least_span : as much at least, although a very wide range of
    wavelengths needs more than most_cells for it. spare : cells that are kept beyond those of a running search.
    grid_span : path for which the grid of a spectrum is made, in longest wavelengths.
    """

    cell: float = 0.125
    span: float = 16.0
    least_span: float = 6.0
    grid_span: float = 10.0
    most_cells: int = 1024
    spare: int = 256


@dataclass(frozen=True)
class Pace:
    """How often a search or a glance is due, and how fast a search goes on.

    hop, glance : cells between two searches and between two glances; soon : the hop at low rates, in longest
    wavelengths. still_s : time without movement after which the finger counts as standing.
    steady : searches that must agree (or find nothing) before searches get fewer. spare_s : the least time between two
    of them then. Once every delay of the path was tried: spare : least new path before the next, as a part of the path
    that a search covers; grown : the same where no glance would see another surface, or no search found a line: a tenth
    of new path hardly changes what so many searches said. As long as glances see the line of so many searches, the next
    one waits for a whole window of new path.
    pieces_Hz : pieces of a search per second at low rates (a search has some forty). A search in fewer readings than
    `light` has shorter pieces; a sample does at most most_pieces of them.
    humming : searches during which a line over time is subtracted before it must be found again.
    """

    hop: int = 24
    glance: int = 8
    soon: float = 0.125
    still_s: float = 0.2
    steady: int = 4
    spare_s: float = 0.15
    spare: float = 0.25
    grown: float = 0.1
    pieces_Hz: float = 1200.0
    light: int = 1000
    most_pieces: int = 2
    humming: int = 30


@dataclass(frozen=True)
class TrustLimits:
    """When an answer may be used.

    agree, agree_humming : searches in a row that must find the same wavelength: one may be wrong, but two seldom make
    the same mistake; three while hum is subtracted, because the same subtraction may repeat a mistake. vague :
    relative sigma above which a wavelength is not "ok": two sigmas are 5 %.
    """

    agree: int = 2
    agree_humming: int = 3
    vague: float = 0.025


@dataclass(frozen=True)
class SearchReach:
    """How the path that a search may use shrinks and grows.

    A line that looks smeared (the surface or the force changed within the path) is searched in a path that is `shorter`
    by this factor, unless a path up to `longer` times as long was not tried: beside a long wave a line looks smeared in
    a path too short to separate the two. Each good search lets the path grow by the factor `grows`.
    """

    shorter: float = 0.6
    longer: float = 1.6
    grows: float = 1.15


@dataclass(frozen=True)
class Delay:
    """How an unknown delay of the path is found.

    trials_ms : delays that are tried. sigma_s, drift_s : standard deviation of the delay before anything is known, and
    of its drift from search to search. sharper : ratio by which lines must be sharper for another delay to be used, at
    most `sharpest` from one trial; plain : power over the background of a clear line, without which lines may be
    sharper by chance alone.
    """

    trials_ms: range = range(-4, 34, 2)
    sigma_s: float = 0.01
    drift_s: float = 1e-4
    sharper: float = 1.6
    sharpest: float = 4.0
    plain: float = 30.0


WINDOW_SETTINGS, PACE_SETTINGS, TRUST_LIMITS = WindowSettings(), Pace(), TrustLimits()
REACH_SETTINGS, DELAY_SETTINGS = SearchReach(), Delay()
