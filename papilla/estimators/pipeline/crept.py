"""A modulus whose status also says where a touch creeps unlike those that the finger was identified by."""

from papilla.calibration import Calibration
from papilla.estimators.pipeline.parts import Part, Row
from papilla.estimators.softness.creep import WORDS, Creep


def with_creep(part: Part, calibration: Calibration) -> Part:
    """The part itself where the calibration knows no relaxation; raises `InputError` for one that is none."""
    known = calibration.finger.get("relaxation")
    return part if known is None else CreptPart(part, Creep(known, calibration.domain["force_N"][0]))


class CreptPart(Part):
    """Another part of the modulus; a status is three times its own, plus the place of what is unlike in `WORDS`."""

    def __init__(self, part: Part, creep: Creep):
        self._part, self._creep = part, creep

    @property
    def doubted(self) -> str:  # type: ignore[override]
        """That of the part."""
        return self._part.doubted

    @property
    def state(self):
        """What part and creep remember."""
        return self._part.state, self._creep.state

    @state.setter
    def state(self, state) -> None:
        self._part.state, self._creep.state = state

    def reset(self) -> None:
        """Forget everything."""
        self._part.reset()
        self._creep.reset()

    def advance(self, rows: list[Row]) -> list[tuple]:
        """For each row its columns, and last the status as a number."""
        unlike = [self._creep.feel(row.time_s, row.force_N) for row in rows]
        return [
            (modulus, sigma, len(WORDS) * int(code) + one * (modulus == modulus))
            for (modulus, sigma, code), one in zip(self._part.advance(rows), unlike, strict=True)
        ]

    def sentence(self, status: int) -> str:
        """The status in words."""
        code, unlike = divmod(status, len(WORDS))
        text = self._part.sentence(code)
        return f"{text}, but {WORDS[unlike]}" if unlike else text
