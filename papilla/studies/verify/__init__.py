"""`papilla verify`: papilla against closed forms, exact solutions, second methods, and cases that break solvers.

>>> cases = papilla.studies.verify.verify(only=["hertz"])
>>> all(case.passed for case in cases)
"""

from papilla.studies.case import Case
from papilla.studies.verify.runner import FAMILIES, verify

__all__ = ["FAMILIES", "Case", "verify"]
