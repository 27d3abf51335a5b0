"""Pictures of pages as a browser shows them, on a desktop and on a telephone.

`python docs/page_pictures.py PAGE.html ... OUT` makes them.
Needs Chromium on the machine. Without pages it takes those of the built site (`make docs`).
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

SITE = Path(__file__).parent / "_build" / "html"
WIDTHS = {"desktop": 1280, "phone": 390}
HEIGHT = 2600
"""Pixels of a page that are shown."""
LEAST = 500
"""Chromium's windows are no narrower; a frame of the telephone's width stands in a wider window."""


def main() -> int:
    """Write <page>_<width>.png for each page; 0 if all were written."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="*", type=Path, help="HTML files; without any, all pages of the site")
    parser.add_argument("--out", type=Path, default=Path("looks"), help="folder for the pictures")
    parser.add_argument("--height", type=int, default=HEIGHT)
    parser.add_argument("--dark", action="store_true", help="as a browser that prefers dark colours")
    given = parser.parse_args()
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        print("no Chromium on this machine", file=sys.stderr)
        return 1
    given.out.mkdir(parents=True, exist_ok=True)
    pages = given.pages or sorted(path for path in SITE.rglob("*.html") if not path.name.startswith("_"))
    for page in pages:
        for name, width in WIDTHS.items():
            shoot(
                browser,
                page.resolve(),
                given.out.resolve() / f"{page.stem}_{name}.png",
                width,
                given.height,
                given.dark,
            )
    return 0


def shoot(browser: str, page: Path, picture: Path, width: int, height: int, dark: bool) -> None:
    """Write the picture of a page in a window of width x height pixels."""
    shown = page
    if width < LEAST:
        shown = picture.with_suffix(".html")
        frame = f"<body style='margin:0'><iframe src='{page.as_uri()}' width={width} height={height} frameborder=0>"
        shown.write_text(frame, encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--hide-scrollbars", "--allow-file-access-from-files", "--disable-gpu"]
    options += ["--force-dark-mode", "--blink-settings=preferredColorScheme=0"] if dark else []
    size = f"--window-size={max(width, LEAST)},{height}"
    subprocess.run(
        [browser, *options, size, "--virtual-time-budget=3000", f"--screenshot={picture}", shown.as_uri()],
        check=True,
        capture_output=True,
    )
    if shown != page:
        shown.unlink()


if __name__ == "__main__":
    sys.exit(main())
