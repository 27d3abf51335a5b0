"""A status: a small integer with a name and a sentence that say whether and how an estimator answered."""

from enum import IntEnum

import numpy as np


class Named(IntEnum):
    """A number that is printed by its name."""

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return format(self.name if spec == "" else int(self), spec)


class Status(Named):
    """Base of all statuses; each member has a sentence, `OK = "ok"`, and counts from 0 in the order in which it stands.
    Logs and states hold these numbers, so a new status comes last.

    good : whether the answer may be used, which is so if the sentence begins with "ok".
    """

    sentence: str
    good: bool

    def __new__(cls, sentence):
        """The next member, with this sentence."""
        member = int.__new__(cls, len(cls.__members__))
        member._value_, member.sentence, member.good = int(member), sentence, sentence.startswith("ok")
        return member

    @property
    def code(self) -> str:
        """The status in one to three words, for tables: its name, after "ok" where the answer may be used."""
        name = self.name.lower().replace("_", " ")
        return f"ok, {name}" if self.good and name != "ok" else name

    @classmethod
    def in_words(cls, status):
        """The sentence of a status; for an array (n,) of statuses a list of n sentences."""
        if isinstance(status, np.ndarray):
            return [cls(code).sentence for code in status.tolist()]
        return cls(status).sentence
