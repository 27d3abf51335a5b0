"""Telling fabrics apart, and their roughness from vibration: bands, concordance, outliers, nearest neighbours."""

from papilla.estimators.published.texture.agreement import Concordance, concordance
from papilla.estimators.published.texture.bands import (
    Band,
    BandMatch,
    band_amplitudes,
    best_band,
    log_band_features,
    matching_band,
    printed_bands,
    random_bands,
)
from papilla.estimators.published.texture.knn import Accuracy, leave_m_out
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
]
