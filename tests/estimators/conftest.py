"""Calibrations and touches of the tests of estimators."""

from estimator_fixtures import calibration as calibration
from estimator_fixtures import five as five
from estimator_fixtures import five_gauges as five_gauges
from estimator_fixtures import make as make
from estimator_fixtures import touch as touch
