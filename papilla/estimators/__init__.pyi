"""The names of `papilla.estimators` and the module that defines each."""

from .friction import Friction as Friction
from .friction import FrictionEstimate as FrictionEstimate
from .pipeline import Pipeline as Pipeline
from .pipeline import PipelineEstimate as PipelineEstimate
from .softness import Doubts as Doubts
from .softness import GaugeEstimate as GaugeEstimate
from .softness import GaugeSoftness as GaugeSoftness
from .softness import Softness as Softness
from .softness import SoftnessEstimate as SoftnessEstimate
from .softness import TouchState as TouchState
from .texture import TextureModel as TextureModel
from .wavelength import FusedEstimate as FusedEstimate
from .wavelength import FusedTracker as FusedTracker
from .wavelength import LineTracker as LineTracker
from .wavelength import SpaceTracker as SpaceTracker
from .wavelength import WavelengthEstimate as WavelengthEstimate
from .wavelength.chirp import ChirpEstimate as ChirpEstimate
from .wavelength.chirp import ChirpTracker as ChirpTracker
from .wavelength.lines import find_lines as find_lines
from .wavelength.lines import travelled as travelled
