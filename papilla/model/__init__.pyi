"""The names of `papilla.model` and the module that defines each."""

from .finger import Finger as Finger
from .materials import MATERIALS_BY_KIND as MATERIALS_BY_KIND
from .materials import FirstInvariantMaterial as FirstInvariantMaterial
from .materials import NeoHookean as NeoHookean
from .materials import Ogden as Ogden
from .materials import Yeoh as Yeoh
from .parts import Bench as Bench
from .parts import Dome as Dome
from .parts import Gauge as Gauge
from .parts import Identified as Identified
from .parts import Layer as Layer
from .parts import Ridges as Ridges
from .parts import Slab as Slab
from .parts import Surfaces as Surfaces
from .specimen import Block as Block
from .specimen import Grating as Grating
from .specimen import HalfSpace as HalfSpace
from .specimen import Specimen as Specimen
from .specimen import Sphere as Sphere
from .textures import Flat as Flat
from .textures import MeasuredProfile as MeasuredProfile
