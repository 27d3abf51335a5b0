"""Which kind of offscreen window VTK can open here, found out where a crash does no harm.

Without a GL library VTK does not raise, it ends the process: so each kind is tried in a process of its own, once.
"""

import os
import subprocess
import sys
from functools import lru_cache

ENVIRONMENT = "VTK_DEFAULT_OPENGL_WINDOW"
"""The variable by which VTK is told what window to open; what a user sets there is the only kind tried."""

HEADLESS = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")  # Kinds that need no display (Linux), in the order tried
PROBE_SECONDS = 60
_PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(8, 8)
window.AddRenderer(vtkRenderer())
window.Render()
raise SystemExit(not window.SupportsOpenGL())
"""


@lru_cache(maxsize=1)
def use_offscreen_window() -> bool:
    """Set the window kind for this process; False where VTK cannot render here at all."""
    for kind in _candidates():
        if _works(kind):
            if kind is not None:
                os.environ[ENVIRONMENT] = kind
            return True
    return False


def _candidates() -> tuple[str | None, ...]:
    if os.environ.get(ENVIRONMENT):
        return (os.environ[ENVIRONMENT],)
    return HEADLESS if sys.platform.startswith("linux") else (None,)


def _works(kind: str | None) -> bool:
    environment = os.environ if kind is None else {**os.environ, ENVIRONMENT: kind}
    try:
        done = subprocess.run(
            [sys.executable, "-c", _PROBE], env=environment, capture_output=True, timeout=PROBE_SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0
