"""The papers' telepresence experiments, simulated: loops for the machines, ideal observers for the people."""

from papilla.studies.telepresence.delays import BesideEachOther, beside_each_other
from papilla.studies.telepresence.observers import Observer, fit_pairwise_noise, pairwise_rates
from papilla.studies.telepresence.pairwise import Pairwise, pairwise_2007
from papilla.studies.telepresence.roughness import Condition, Experiments, experiments_2011

__all__ = [
    "BesideEachOther", "Condition", "Experiments", "Observer", "Pairwise", "beside_each_other",
    "experiments_2011", "fit_pairwise_noise", "pairwise_2007", "pairwise_rates",
]  # fmt: skip
