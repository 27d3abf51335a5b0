"""The papers' telepresence experiments, simulated up to the finger: loops for the machines; no person is simulated."""

from papilla.studies.telepresence.delays import BesideEachOther, beside_each_other
from papilla.studies.telepresence.roughness import Condition, experiments_2011

__all__ = ["BesideEachOther", "Condition", "beside_each_other", "experiments_2011"]
