"""The notebooks as pages, with the outputs that they are stored with."""

import shutil
from pathlib import Path

from pages import write as write_page

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
INDEX = """# Notebooks

Each shows its pictures here as they were stored, asserts its numbers, and ends with what to try. To open them:

```text
pip install ".[notebooks]"
jupyter lab notebooks
```

```{{toctree}}
:maxdepth: 1

{names}
```
"""


def write(folder: Path) -> None:
    """Copy the notebooks into notebooks/ and list them in notebooks.md."""
    shutil.rmtree(folder / "notebooks", ignore_errors=True)
    found = sorted(NOTEBOOKS.glob("*.ipynb"))
    for path in found:
        write_page(folder / "notebooks" / path.name, path.read_text(encoding="utf-8"))
    write_page(folder / "notebooks.md", INDEX.format(names="\n".join(f"notebooks/{path.stem}" for path in found)))
