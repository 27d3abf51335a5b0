"""`papilla verify`: papilla against closed forms, exact solutions, second methods, and cases that break solvers.

>>> cases = papilla.verify.verify(only=["hertz"])
>>> all(case.passed for case in cases)
"""

from papilla.verify.case import Case
from papilla.verify.runner import CASE_FAMILIES, verify

__all__ = ["CASE_FAMILIES", "Case", "verify"]
