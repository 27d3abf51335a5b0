"""Pictures as PNG, PDF or SVG files, by the ending of their names.

What takes a model to compute is kept in the cache, so that a second call needs none.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from papilla import cache
from papilla.errors import InputError
from papilla.fem.pressing.fidelity import press as press_scene
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.finger import Finger
from papilla.mesh import DEFAULT_SIZE_MM, build
from papilla.specimen import Specimen
from papilla.view.style import content, kind_of, write_bytes

DPI = 120

Progress = Callable[[str], None]


def shown(reduced: ReducedFinger, specimen: Specimen, **scene: Any) -> Press:
    """The press of a scene, as `papilla.fem.press` makes it, for a picture: pressures are shown node by node, so its
    contact is solved where that would take it from Hertz."""
    found = press_scene(reduced, specimen, **scene)
    return press_scene(reduced, specimen, fidelity="contact", **scene) if found.fidelity == "hertz" else found


def strain(
    path: str | Path,
    finger: Finger,
    reduced: ReducedFinger,
    press: Press,
    specimen: Specimen,
    *,
    variant: int = 0,
    progress: Progress | None = None,
) -> None:
    """Write the strain field of a press: the finger cut open, its gauges, the contact and the specimen.

    Parameters
    ----------
    reduced : `finger` reduced on its mesh number `variant`; press : of `specimen` on it.
    progress : called with a line of text before something takes long.

    Raises `InputError` where they do not belong together and for an unknown kind of file, `FileAccessError` where the
    file cannot be written, and what meshing and solving raise.
    """
    kind = kind_of(path)
    write_bytes(path, strain_picture(finger, reduced, press, specimen, kind=kind, variant=variant, progress=progress))


def strain_picture(
    finger: Finger,
    reduced: ReducedFinger,
    press: Press,
    specimen: Specimen,
    *,
    kind: str = "png",
    variant: int = 0,
    progress: Progress | None = None,
) -> bytes:
    """The picture that `strain` writes, as the bytes of a png, pdf or svg file; raises the same except for the file."""
    if reduced.finger_sha256 != finger.sha256:
        raise InputError(f"the reduced finger was not made from this design of {finger.name}")

    def draw() -> dict[str, np.ndarray]:
        from papilla.fem import recover
        from papilla.fem.reduction.finger_model import model_of
        from papilla.view.strain_field import strain_figure

        if progress is not None:
            progress("recovering and drawing the strain field")
        mesh = build(finger, size_mm=reduced.mesh_size_mm, variant=variant, progress=progress)
        field = recover(model_of(finger, mesh), reduced, press)
        picture = content(strain_figure(field, reduced, press, specimen, finger), kind, DPI)
        return {kind: np.frombuffer(picture, dtype=np.uint8)}

    if not type(specimen).__module__.startswith("papilla."):
        # Nobody knows what the code of the user's own specimen depends on.
        return draw()[kind].tobytes()
    scene = (finger.sha256, reduced.to_arrays(), specimen, press.fidelity, press.force, press.pressure)
    key = cache.key(__name__, kind, *scene)
    return cache.fetch("picture", key, draw)[kind].tobytes()


def receptive(
    path: str | Path,
    finger: Finger,
    gauge_name: str,
    *,
    size_mm: float = DEFAULT_SIZE_MM,
    progress: Progress | None = None,
) -> None:
    """Write the receptive field of a gauge: the skin coloured by strain of the gauge per small load there.

    Raises `InputError` for an unknown gauge or kind of file, `FileAccessError` where the file cannot be written, and
    what meshing and solving raise.
    """
    kind = kind_of(path)
    names = [gauge.name for gauge in finger.gauges]
    if gauge_name not in names:
        raise InputError(f"{finger.name} has no gauge {gauge_name!r}; its gauges are {', '.join(names)}")
    mesh = build(finger, size_mm=size_mm, progress=progress)

    def make() -> dict[str, np.ndarray]:
        from papilla.fem import receptive_fields
        from papilla.fem.reduction.finger_model import model_of

        if progress is not None:
            progress("solving for the receptive fields")
        fields = receptive_fields(model_of(finger, mesh))
        return {"vertices": fields.vertices, "strain_per_newton": fields.strain_per_newton}

    kept = cache.fetch("receptive", cache.key("papilla.fem.fields", finger.sha256, mesh.sha256), make)

    from papilla.fem import ReceptiveFields
    from papilla.view.receptive_field import receptive_figure

    fields = ReceptiveFields(mesh, kept["vertices"], kept["strain_per_newton"])
    write_bytes(path, content(receptive_figure(fields, finger, gauge_name), kind, DPI))


def contact(path: str | Path, reduced: ReducedFinger, press: Press) -> None:
    """Write the contact pressure of a press of `reduced`.

    Raises `InputError` where the press is not one of `reduced` and for an unknown kind of file, `FileAccessError` where
    the file cannot be written.
    """
    from papilla.view.contact_map import contact_figure

    write_bytes(path, content(contact_figure(reduced, press), kind_of(path), DPI))
