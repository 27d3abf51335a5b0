"""The rooms and the curated names of papilla, and the module that defines each."""

from . import calibration as calibration
from . import core as core
from . import design as design
from . import estimators as estimators
from . import fem as fem
from . import identification as identification
from . import logs as logs
from . import mesh as mesh
from . import model as model
from . import references as references
from . import scenes as scenes
from . import telepresence as telepresence
from . import verify as verify
from . import view as view
from .calibration.record import Calibration as Calibration
from .core import errors as errors
from .core import units as units
from .core.errors import PapillaError as PapillaError
from .logs import read_presses as read_presses
from .logs import read_time_log as read_time_log
from .model import specimen as specimen
from .model.finger import Finger as Finger
from .model.materials import NeoHookean as NeoHookean
from .model.materials import Ogden as Ogden
from .model.materials import Yeoh as Yeoh
from .model.parts import Dome as Dome
from .model.parts import Gauge as Gauge
from .model.parts import Layer as Layer
from .model.parts import Slab as Slab
from .model.parts import Surfaces as Surfaces
from .model.specimen import Block as Block
from .model.specimen import Grating as Grating
from .model.specimen import HalfSpace as HalfSpace
from .model.specimen import Sphere as Sphere
from .verbs import calibrate as calibrate
from .verbs import identify as identify
from .verbs import press as press

__version__: str
