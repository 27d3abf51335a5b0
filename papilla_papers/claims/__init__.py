"""`papilla reproduce`: claims of the papers and results of papilla, claim by claim, with a verdict from a tolerance.

>>> answers = papilla_papers.claims.reproduce("eq. (3)")
>>> print(answers[0].measured, answers[0].verdict)
"""

from papilla.verify.case import Verdict
from papilla_papers.claims.claim import Answer, Claim, Experiment
from papilla_papers.claims.runner import ALL_CLAIMS, ALL_EXPERIMENTS, reproduce

__all__ = ["ALL_CLAIMS", "ALL_EXPERIMENTS", "Answer", "Claim", "Experiment", "Verdict", "reproduce"]
