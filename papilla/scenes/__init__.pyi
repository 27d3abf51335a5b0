"""The names of `papilla.scenes` and the module that defines each."""

from .scenes import SCENES_BY_NAME as SCENES_BY_NAME
from .scenes import Scene as Scene
from .scenes import scene as scene
