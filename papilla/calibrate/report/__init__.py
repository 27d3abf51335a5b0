"""The pages about a calibration, a comparison and an identification."""
