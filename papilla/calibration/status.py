"""What became of an answer about softness, as small integers that loops can compare and as sentences for people."""

from enum import IntEnum

IDENTIFIABLE = 0.5
"""sigma_E / E above which a modulus is called not identifiable (the sensor cannot tell)."""


class SoftnessStatus(IntEnum):
    """What became of an answer; `sentence` says it in words."""

    OK = 0
    NOT_IDENTIFIABLE = 1
    SOFTER = 2
    HARDER = 3
    FORCE_BELOW = 4
    FORCE_ABOVE = 5
    NO_CONTACT = 6
    BAD_GAUGE = 7
    BAD_INPUT = 8
    LEFT_OUT = 9
    MISFIT = 10
    OFF_REACH = 11

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    SoftnessStatus.OK: "ok",
    SoftnessStatus.NOT_IDENTIFIABLE: "not identifiable: sigma is more than half of the modulus, or S_d fits two",
    SoftnessStatus.SOFTER: "softer than calibrated",
    SoftnessStatus.HARDER: "harder than the sensor can tell",
    SoftnessStatus.FORCE_BELOW: "force below the calibrated domain",
    SoftnessStatus.FORCE_ABOVE: "force above the calibrated domain",
    SoftnessStatus.NO_CONTACT: "no contact",
    SoftnessStatus.BAD_GAUGE: "bad gauge: a reading is missing, saturated or stuck, so there is no S_d",
    SoftnessStatus.BAD_INPUT: "force or S_d is not a positive finite number",
    SoftnessStatus.LEFT_OUT: "ok without some channels",
    SoftnessStatus.MISFIT: "the readings fit no modulus and force: a touch off the apex, or several bad channels",
    SoftnessStatus.OFF_REACH: "the contact lies beside the calibrated positions",
}
