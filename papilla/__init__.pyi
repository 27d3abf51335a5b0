"""The curated names of papilla and the module that defines each."""

from . import calibrate as calibrate
from . import errors as errors
from . import estimators as estimators
from . import fem as fem
from . import mesh as mesh
from . import references as references
from . import units as units
from . import view as view
from .calibration import Calibration as Calibration
from .errors import PapillaError as PapillaError
from .finger import Dome as Dome
from .finger import Finger as Finger
from .finger import Gauge as Gauge
from .finger import Layer as Layer
from .finger import Slab as Slab
from .finger import Surfaces as Surfaces
from .logs import read_presses as read_presses
from .logs import read_time_log as read_time_log
from .materials import Ogden as Ogden
from .specimen import Block as Block
from .specimen import Grating as Grating
from .specimen import HalfSpace as HalfSpace
from .specimen import Sphere as Sphere

__version__: str
