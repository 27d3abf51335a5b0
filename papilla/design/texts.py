"""Texts of others, such as names and reasons, as a study prints them: bounded, and on one line."""

MOST_PRINTED_LETTERS = 60
"""Most letters of a name that are printed; files and JSON have the whole name."""


def short(text: str, letters: int = MOST_PRINTED_LETTERS) -> str:
    """A text of at most so many letters, with an ellipsis for the rest."""
    return text if len(text) <= letters else f"{text[: letters - 1]}…"


def line(text: object) -> str:
    """A text on one line, without letters that cannot be printed."""
    return "".join(letter if letter.isprintable() else "?" for letter in " ".join(str(text).split()))
