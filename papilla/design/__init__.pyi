"""The names of `papilla.design` and the module that defines each."""

from .job import run_study as run_study
from .objectives import OBJECTIVES_BY_NAME as OBJECTIVES_BY_NAME
from .placement import place_gauges as place_gauges
from .scene import DesignScene as DesignScene
from .study import Study as Study
from .study import read_study as read_study
