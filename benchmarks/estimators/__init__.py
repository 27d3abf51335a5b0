"""Comparison of the wavelength estimators: scenes, answers of each estimator, and the table of errors over bounds."""
