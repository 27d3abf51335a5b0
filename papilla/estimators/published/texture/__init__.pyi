"""The names of `papilla.estimators.published.texture` and the module that defines each."""

from .agreement import Concordance as Concordance
from .agreement import concordance as concordance
from .bands import Band as Band
from .bands import BandMatch as BandMatch
from .bands import band_amplitudes as band_amplitudes
from .bands import best_band as best_band
from .bands import log_band_features as log_band_features
from .bands import matching_band as matching_band
from .bands import printed_bands as printed_bands
from .bands import random_bands as random_bands
from .knn import Accuracy as Accuracy
from .knn import leave_m_out as leave_m_out
from .scores import grubbs_critical as grubbs_critical
from .scores import grubbs_outliers as grubbs_outliers
from .scores import normalised_scores as normalised_scores
