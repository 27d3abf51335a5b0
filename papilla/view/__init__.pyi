"""The names of `papilla.view` and the module that defines each."""

from . import plots as plots
from .contact_map import contact_figure as contact_figure
from .pictures import contact as contact
from .pictures import fields as fields
from .pictures import receptive as receptive
from .pictures import shown as shown
from .pictures import strain as strain
from .pictures import strain_page as strain_page
from .pictures import strain_picture as strain_picture
from .pictures import strain_pictures as strain_pictures
from .receptive_field import receptive_fields_figure as receptive_fields_figure
from .receptive_field import receptive_figure as receptive_figure
from .strain_field import PressScene as PressScene
from .strain_field import strain_figure as strain_figure
from .style import png as png
from .style import svg as svg
