"""Configuration of the documentation site; `make docs` builds it into docs/_build/html."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "build_steps"))

import commands_page  # noqa: E402
import names_page  # noqa: E402
import notebook_pages  # noqa: E402
import tables_page  # noqa: E402
import theory_figures  # noqa: E402

from papilla import __version__ as release  # noqa: E402

GENERATED = HERE / "generated"
for step in (commands_page, names_page, tables_page, notebook_pages, theory_figures):
    step.write(GENERATED)

project, author = "papilla", "papilla developers"
project_copyright = "papilla developers, MIT licence"
version = release
extensions = ["myst_nb", "sphinx_design", "drawn_math"]
exclude_patterns = ["_build", "images/README.md"]
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "off"
html_math_renderer = "drawn"
html_theme = "pydata_sphinx_theme"
html_title = f"papilla {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_sidebars = {"index": []}
