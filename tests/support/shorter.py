"""Commands as README and the pages print them, with options by which they take seconds."""

import shlex

SHORTER = {
    "calibrate": "--quick",
    "verify": "--only patch",
    "reproduce": "--only A14",
    "figures": "--paper 2007",
    "bench": "--short",
    "telepresence simulate": "--seconds 2",
    "texture train": "--window 20 --wavelengths 1 10 --bands 5",
    # The page on surface files: the mesher draws a coarse mesh in a fifth of the time
    "press --finger finger.toml": "--size-mm 2.8",
}
"""What a command gets besides, by how it begins."""


def shortened(line: str) -> list[str]:
    """Arguments of a printed command, in its shorter form. An option that is printed gets the shorter value."""
    said = shlex.split(line, comments=True)[1:]
    for name, more in SHORTER.items():
        if " ".join(said).startswith(name):
            options = shlex.split(more)
            printed = [said.index(one) for one in options if one in said and one.startswith("--")]
            given = {place + shift for place in printed for shift in (0, 1)}
            return [*(one for place, one in enumerate(said) if place not in given), *options]
    return said
