"""The names of `papilla.telepresence` and the module that defines each."""

from .actuator import Actuator as Actuator
from .actuator import icpf as icpf
from .amplitude import FromWavelength as FromWavelength
from .amplitude import Measured as Measured
from .amplitude import read_curve as read_curve
from .answer import DisplayStatus as DisplayStatus
from .answer import Shown as Shown
from .answer import Trust as Trust
from .components import Component as Component
from .direct import DirectFeedback as DirectFeedback
from .hand import Hand as Hand
from .hand import RemoteHand as RemoteHand
from .link import Link as Link
from .link import LinkModel as LinkModel
from .local_model import LocalModel as LocalModel
from .loop import Motion as Motion
from .loop import Record as Record
from .loop import Set as Set
from .loop import run as run
from .safety import Safety as Safety
from .sensing import Sensing as Sensing
from .texture import GratingTexture as GratingTexture
from .texture import RecordedTexture as RecordedTexture
from .texture import SideBySide as SideBySide
