"""Names that a formula, a page, a terminal or a script could take for its own signs."""

import random

PIECES = (
    "$", r"$\bad{$", r"\frac", "{", "}", "^", "_", "%", "#", "<script>alert(1)</script>", "</svg>", "<b>", "&amp;", "&",
    "]]>", "-->", "[red]", "[/]", "[bold", "'", '"', "`", "|", "~", "%s", "{0}", "{{ x }}", "{% x %}", "שלום", "مرحبا",
    "漢字", "é", "🙂", "g1", " ", "\u00a0", "=1+1", "@", "\\", "\\n",
)  # fmt: skip


def odd_names(rng: random.Random, count: int) -> list[str]:
    """`count` different names of 1 to 200 letters."""
    names: dict[str, None] = {}
    while len(names) < count:
        name = "".join(rng.choice(PIECES) for _ in range(rng.choice((1, 2, 3, 12))))[: rng.choice((3, 40, 200))]
        if name:
            names[name] = None
    return list(names)
