"""`papilla reproduce`: claims of the papers and results of papilla, claim by claim, with a verdict from a tolerance.

>>> answers = papilla.studies.reproduce.reproduce("eq. (3)")
>>> print(answers[0].measured, answers[0].verdict)
"""

from papilla.studies.case import Verdict
from papilla.studies.reproduce.claim import Answer, Claim, Experiment
from papilla.studies.reproduce.runner import CLAIMS, EXPERIMENTS, reproduce

__all__ = ["CLAIMS", "EXPERIMENTS", "Answer", "Claim", "Experiment", "Verdict", "reproduce"]
