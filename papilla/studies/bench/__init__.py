"""`papilla bench`: cost and accuracy of a press, compared with the finest mesh and with other libraries.

>>> found = papilla.studies.bench.bench(finger, SHORT)
>>> found.rows[0].error_sd, found.rows[0].seconds_setup
"""

from papilla.studies.bench.measure import BenchRow
from papilla.studies.bench.runner import FULL, SHORT, Bench, Plan, bench

__all__ = ["FULL", "SHORT", "Bench", "BenchRow", "Plan", "bench"]
