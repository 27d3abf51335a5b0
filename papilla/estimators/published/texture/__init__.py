"""Telling fabrics apart, and their roughness from vibration: bands, concordance, outliers, nearest neighbours."""

from papilla.estimators.published.texture.agreement import Concordance as Concordance
from papilla.estimators.published.texture.agreement import concordance as concordance
from papilla.estimators.published.texture.bands import Band as Band
from papilla.estimators.published.texture.bands import BandMatch as BandMatch
from papilla.estimators.published.texture.bands import band_amplitudes as band_amplitudes
from papilla.estimators.published.texture.bands import best_band as best_band
from papilla.estimators.published.texture.bands import log_band_features as log_band_features
from papilla.estimators.published.texture.bands import matching_band as matching_band
from papilla.estimators.published.texture.bands import printed_bands as printed_bands
from papilla.estimators.published.texture.bands import random_bands as random_bands
from papilla.estimators.published.texture.knn import Accuracy as Accuracy
from papilla.estimators.published.texture.knn import leave_m_out as leave_m_out
from papilla.estimators.published.texture.scores import grubbs_critical as grubbs_critical
from papilla.estimators.published.texture.scores import grubbs_outliers as grubbs_outliers
from papilla.estimators.published.texture.scores import normalised_scores as normalised_scores
