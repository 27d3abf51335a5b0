"""The names of `papilla.scenes` and the module that defines each."""

from .scenes import SCENES as SCENES
from .scenes import Scene as Scene
from .scenes import scene as scene
