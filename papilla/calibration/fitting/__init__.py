"""From a finger to its calibration: the sweep of presses, the fit, its checks, the page and the C header."""
