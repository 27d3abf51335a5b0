"""Self-contained pages of HTML: common style, formatting of numbers, pictures inline.

A page's own template is in the package that writes it, and extends `page.html` of this one; the style is
`papilla/data/page.css`.
"""

import base64
import math
from collections.abc import Iterable

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from papilla.core.units import PER_CENT
from papilla.view.style import narrow, svg


def environment(package: str) -> Environment:
    """Templates of a package and the page that they extend, with the filters that format numbers."""
    templates = Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader("papilla.view"), PackageLoader("papilla", "data")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    templates.filters |= {"number": number, "plain": plain, "percent": percent}
    return templates


def number(value: float | None, digits: int = 3, sign: bool = False) -> str:
    """A number with so many significant digits, a real minus sign and grouped thousands; "–" for no number."""
    if value is None or not math.isfinite(value):
        return "–" if value is None or math.isnan(value) else "∞"
    plus = "+" if sign else ""
    if value == 0:
        return "0"
    decimals = digits - 1 - int(f"{value:.{digits - 1}e}".split("e")[1])
    if -3 <= decimals <= digits + 4:
        text = f"{round(value, decimals):{plus},.{max(decimals, 0)}f}".replace(",", "\u202f")
        return text.replace("-", "−")
    mantissa, power = f"{value:{plus}.{digits - 1}e}".split("e")
    return Markup(f"{mantissa}·10<sup>{int(power)}</sup>".replace("-", "−"))


def percent(share: float | None, digits: int = 2, sign: bool = False) -> str:
    """A fraction in per cent."""
    return f"{number(None if share is None else PER_CENT * share, digits, sign)}\u00a0%"


def plain(value: float) -> str:
    """A given or counted number without trailing zeros (at most six digits), with a real minus sign."""
    text = f"{value:,}".replace(",", "\u202f") if isinstance(value, int) else f"{value:.6g}"
    return text.replace("-", "−")


def image(figure: Figure, alt: str) -> Markup:
    """A figure for a page in `both_widths`. The figure is changed."""
    return either(both_widths(figure), alt, "svg+xml")


def both_widths(figure: Figure) -> tuple[bytes, bytes]:
    """A figure as wide as it is, and `narrow`ed for a telephone, as SVG. The figure is changed."""
    wide = svg(figure)
    narrow(figure)
    return wide, svg(figure)


def either(pictures: Iterable[bytes], alt: str, image_type: str) -> Markup:
    """A wide and a narrow picture of the same, of a kind ("png", "svg+xml"): a page shows the one for its screen."""
    wide, small = (
        f"data:image/{image_type};base64,{base64.b64encode(picture).decode('ascii')}" for picture in pictures
    )
    markup = '<picture><source media="(max-width: 600px)" srcset="{}"><img alt="{}" src="{}"></picture>'
    return Markup(markup).format(small, alt, wide)
