"""The parts that the report's page is made of: text is escaped, pictures are data URIs, nothing is fetched."""

import base64
import math
from collections.abc import Iterable, Sequence
from html import escape

CSS = """
:root { --ink: #1d2330; --muted: #5b6472; --line: #e3e7ec; --paper: #ffffff; --tint: #f5f7fa; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.6 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 60rem; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
h1 { font-size: clamp(1.6rem, 4.5vw, 2.3rem); line-height: 1.15; letter-spacing: -0.02em; margin: 0 0 .4rem; }
h2 { font-size: 1.3rem; letter-spacing: -0.01em; margin: 3.2rem 0 .5rem; padding-top: 1.2rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.8rem 0 .3rem; }
p { margin: .5rem 0; max-width: 44rem; }
.lead { color: var(--muted); font-size: 1.05rem; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(9.5rem, 1fr)); gap: .8rem; margin: 1.8rem 0 0; }
.card { background: var(--tint); border-radius: .6rem; padding: .9rem 1rem; }
.card b { display: block; font-size: 1.55rem; line-height: 1.2; letter-spacing: -0.02em; white-space: nowrap;
  font-variant-numeric: tabular-nums; }
.card span { color: var(--muted); font-size: .84rem; line-height: 1.35; display: block; margin-top: .2rem; }
figure { margin: 1.4rem 0 0; }
figure img { display: block; width: 100%; height: auto; max-width: 46rem; }
figure.wide img { max-width: 52rem; }
figcaption { color: var(--muted); font-size: .9rem; margin-top: .4rem; max-width: 44rem; }
.scroll { overflow-x: auto; margin: .8rem 0; }
table { border-collapse: collapse; font-size: .92rem; font-variant-numeric: tabular-nums; }
th { text-align: right; font-weight: 600; color: var(--muted); font-size: .82rem; vertical-align: bottom; }
th, td { padding: .38rem .9rem .38rem 0; border-bottom: 1px solid var(--line); white-space: nowrap; }
td { text-align: right; }
th:first-child, td:first-child { text-align: left; }
td.text { text-align: left; white-space: normal; min-width: 12rem; overflow-wrap: anywhere; }
.formula { background: var(--tint); border-radius: .5rem; padding: .7rem 1rem; overflow-x: auto; margin: .8rem 0;
  font: .92rem/1.55 ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; }
ul { padding-left: 1.15rem; max-width: 44rem; }
li { margin: .55rem 0; }
li b { font-weight: 650; }
sub, sup { line-height: 0; }
@media print { main { max-width: none; padding: 0; } h2 { break-after: avoid; } figure, tr { break-inside: avoid; } }
"""


class Markup(str):
    """Text that is HTML already; everything else is escaped."""


def markup(value: object) -> Markup:
    """The value as HTML; S_d gets its subscript."""
    return (
        value if isinstance(value, Markup) else Markup(escape(str(value), quote=True).replace("S_d", "S<sub>d</sub>"))
    )


def join(parts: Iterable[object]) -> Markup:
    """Parts one after another."""
    return Markup("\n".join(markup(part) for part in parts))


def tag(name: str, *content: object, **attributes: str) -> Markup:
    """An element; `class_` stands for the attribute class."""
    given = "".join(f' {key.rstrip("_")}="{escape(value, quote=True)}"' for key, value in attributes.items())
    return Markup(f"<{name}{given}>{''.join(markup(part) for part in content)}</{name}>")


def number(value: float | None, digits: int = 3, sign: bool = False) -> str:
    """A number with so many significant digits, a real minus sign and grouped thousands; "–" where there is none."""
    if value is None or not math.isfinite(value):
        return "–" if value is None or math.isnan(value) else "∞"
    plus = "+" if sign else ""
    if value == 0:
        return "0"
    decimals = digits - 1 - int(f"{value:.{digits - 1}e}".split("e")[1])
    if -3 <= decimals <= digits + 4:
        rounded = round(value, decimals)
        text = f"{rounded:{plus},.{max(decimals, 0)}f}".replace(",", "\u202f")
    else:
        mantissa, power = f"{value:{plus}.{digits - 1}e}".split("e")
        return Markup(f"{mantissa}·10<sup>{int(power)}</sup>".replace("-", "−"))
    return text.replace("-", "−")


def plain(value: float) -> str:
    """A given or counted number without trailing zeros (at most six digits), with a real minus sign."""
    text = f"{value:,}".replace(",", "\u202f") if isinstance(value, int) else f"{value:.6g}"
    return text.replace("-", "−")


def cards(items: Sequence[tuple[str, str]]) -> Markup:
    """Headline figures: (value, what it is)."""
    return tag(
        "div", *(tag("div", tag("b", value), tag("span", text), class_="card") for value, text in items), class_="cards"
    )


def table(head: Sequence[object], rows: Iterable[Sequence[object]], text_columns: Sequence[int] = ()) -> Markup:
    """A table; the columns in `text_columns` wrap and are set from the left."""

    def cell(place: int, value: object) -> Markup:
        return tag("td", value, class_="text") if place in text_columns else tag("td", value)

    body = (tag("tr", *(cell(place, value) for place, value in enumerate(row))) for row in rows)
    top = tag("thead", tag("tr", *(tag("th", title) for title in head)))
    return tag("div", tag("table", top, tag("tbody", *body)), class_="scroll")


def picture(content: bytes, kind: str, alt: str, caption: object, wide: bool = False) -> Markup:
    """A figure from image bytes of MIME type `image/kind`."""
    source = f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"
    image = Markup(f'<img alt="{escape(alt, quote=True)}" src="{source}">')
    return tag("figure", image, tag("figcaption", caption), class_="wide" if wide else "plain")


def page(title: str, parts: Iterable[object]) -> str:
    """The whole document."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{CSS}</style>\n</head>\n<body>\n<main>\n{join(parts)}\n</main>\n</body>\n</html>\n"
    )
