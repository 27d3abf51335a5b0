"""The page that says what a calibration is, how good it is, and what to doubt."""
