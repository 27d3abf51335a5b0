"""`papilla bench`: cost and accuracy of a press, compared with the finest mesh.

>>> found = papilla.cli.speed.bench(finger, SHORT)
>>> found.rows[0].error_sd, found.rows[0].seconds_setup
"""

from papilla.cli.speed.measure import BenchRow
from papilla.cli.speed.runner import FULL_PLAN, SHORT_PLAN, Plan, SpeedBench, bench

__all__ = ["FULL_PLAN", "SHORT_PLAN", "SpeedBench", "BenchRow", "Plan", "bench"]
