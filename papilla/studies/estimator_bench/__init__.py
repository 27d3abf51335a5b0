"""Comparison of the wavelength estimators: scenes, what each estimator answers, and the table of errors over bounds."""
