"""Telling fabrics apart, and their roughness from vibration: bands, concordance, outliers, nearest neighbours."""

from papilla.estimators.published.texture.agreement import Concordance, concordance
from papilla.estimators.published.texture.bands import Band, band_amplitudes, best_band, printed_bands, random_bands
from papilla.estimators.published.texture.features import log_band_features, windows
from papilla.estimators.published.texture.knn import Accuracy, leave_m_out, split_by_repetition
from papilla.estimators.published.texture.matching import BandMatch, matching_band
from papilla.estimators.published.texture.scores import grubbs_critical, grubbs_outliers, normalised_scores

__all__ = [
    "Accuracy",
    "Band",
    "BandMatch",
    "Concordance",
    "band_amplitudes",
    "best_band",
    "concordance",
    "grubbs_critical",
    "grubbs_outliers",
    "leave_m_out",
    "log_band_features",
    "matching_band",
    "normalised_scores",
    "printed_bands",
    "random_bands",
    "split_by_repetition",
    "windows",
]
