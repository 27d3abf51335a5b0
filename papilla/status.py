"""A status: a small integer whose name and sentence say what became of an answer."""

from enum import IntEnum

import numpy as np


class Status(IntEnum):
    """Base of all statuses; a member carries its sentence: `OK = 0, "ok"`."""

    sentence: str

    def __new__(cls, value: int, sentence: str = ""):
        """A member of this value with its sentence."""
        member = int.__new__(cls, value)
        member._value_, member.sentence = value, sentence
        return member

    @property
    def good(self) -> bool:
        """Whether the answer may be used: the sentence begins with "ok"."""
        return self.sentence.startswith("ok")

    @classmethod
    def in_words(cls, status):
        """The sentence of a status, or, of an array (n,) of them, a list of n."""
        if isinstance(status, np.ndarray):
            return [cls(code).sentence for code in status.tolist()]
        return cls(status).sentence
