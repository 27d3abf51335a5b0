"""The names of `papilla.fem` and the module that defines each."""

from .fields import Field as Field
from .fields import ReceptiveFields as ReceptiveFields
from .fields import receptive_fields as receptive_fields
from .fields import recover as recover
from .finite import press_finite as press_finite
from .preparing import prepare as prepare
from .pressing.fidelity import press as press
from .pressing.press import Press as Press
from .reduction.finger_model import FingerModel as FingerModel
from .reduction.reduced import ReducedFinger as ReducedFinger
from .sliding.motion import Motion as Motion
from .sliding.section import ReducedSection as ReducedSection
from .sliding.section import prepare_section as prepare_section
from .sliding.slide import Slide as Slide
from .sliding.slide import slide as slide
