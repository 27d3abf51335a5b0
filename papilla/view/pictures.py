"""Pictures as PNG, PDF or SVG files, by the ending of their names.

Results that need the finger's model are kept in the cache, so a second call does not compute them again.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from papilla.core import cache
from papilla.core.errors import InputError
from papilla.core.files import write_text
from papilla.core.progress import Progress, silent
from papilla.fem.pressing.fidelity import press as press_scene
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Specimen
from papilla.view.style import NARROW_IN, STRAIN_QUANTITY, STYLE_SHEET, content, kind_of, write_bytes

if TYPE_CHECKING:
    from papilla.fem import Field, ReceptiveFields

PICTURE_DPI = 120


def shown(reduced: ReducedFinger, specimen: Specimen, **scene: Any) -> Press:
    """The press of a scene, as `papilla.fem.press` makes it, for a picture. Pictures show nodal pressures, so the
    contact is solved even if `press` would use `hertz`."""
    pressed = press_scene(reduced, specimen, **scene)
    return press_scene(reduced, specimen, fidelity="contact", **scene) if pressed.fidelity == "hertz" else pressed


def strain(
    path: str | Path,
    finger: Finger,
    reduced: ReducedFinger,
    press: Press,
    specimen: Specimen,
    *,
    variant: int = 0,
    progress: Progress = silent,
    shown: str = STRAIN_QUANTITY,
    beside: tuple[Press, Specimen] | None = None,
) -> None:
    """Write the strain field of a press: the finger cut open, its gauges, the contact and the specimen.

    Parameters
    ----------
    reduced : `finger` reduced on its mesh number `variant`; press : of `specimen` on it.
    progress : called with a line of text before a long step.
    shown : "strain" along the layers, or a component of the stress: xx, yy, zz, xy, yz, xz or mises.
    beside : another press of `reduced` and its specimen, drawn beside it on the same scale.

    Raises `InputError` if the arguments do not belong together and for an unknown kind of file or component,
    `FileAccessError` if the file cannot be written, and what meshing and solving raise.
    """
    how: Any = {"kind": kind_of(path), "variant": variant, "progress": progress, "shown": shown, "beside": beside}
    write_bytes(path, strain_picture(finger, reduced, press, specimen, **how))


def strain_picture(
    finger: Finger,
    reduced: ReducedFinger,
    press: Press,
    specimen: Specimen,
    progress: Progress = silent,
    **options: Any,
) -> bytes:
    """The picture that `strain` writes, as the bytes of a png, pdf or svg file; raises the same errors except for the
    file. options : as of `strain_pictures`."""
    return strain_pictures(finger, reduced, press, specimen, progress, **options, widths=(None,))[0]


def strain_pictures(
    finger: Finger,
    reduced: ReducedFinger,
    press: Press,
    specimen: Specimen,
    progress: Progress = silent,
    *,
    kind: str = "png",
    variant: int = 0,
    shown: str = STRAIN_QUANTITY,
    beside: tuple[Press, Specimen] | None = None,
    widths: tuple[float | None, ...] = (None, NARROW_IN),
) -> list[bytes]:
    """The picture that `strain` writes, in each width in inches (None: as wide as it needs): by default also a narrow
    one for a telephone. Raises as `strain_picture`."""
    if reduced.finger_sha256 != finger.sha256:
        raise InputError(f"the reduced finger was not made from this design of {finger.name}")
    scenes = [(press, specimen), *([] if beside is None else [beside])]

    def draw() -> dict[str, np.ndarray]:
        from papilla.view.strain_field import PressScene, strain_figure

        first, *others = fields(finger, reduced, [item for item, _ in scenes], variant=variant, progress=progress)
        second = PressScene(others[0], *beside) if beside else None
        how: Any = {"shown": shown, "beside": second}
        figures = [strain_figure(first, reduced, press, specimen, finger, width=width, **how) for width in widths]
        return {
            str(k): np.frombuffer(content(item, kind, PICTURE_DPI), dtype=np.uint8) for k, item in enumerate(figures)
        }

    if not all(type(item).__module__.startswith("papilla.") for _, item in scenes):
        # A user's own specimen class is not cached, because its code is not part of the key.
        return [item.tobytes() for item in draw().values()]
    presses = [(touched, item.fidelity, item.force, item.pressure) for item, touched in scenes]
    key = cache.key(__name__, kind, shown, finger.sha256, reduced.to_arrays(), presses, widths, STYLE_SHEET)
    cached = cache.fetch("picture", key, draw)
    return [cached[str(k)].tobytes() for k in range(len(widths))]


def fields(
    finger: Finger, reduced: ReducedFinger, presses: Sequence[Press], *, variant: int = 0, progress: Progress = silent
) -> "list[Field]":
    """The fields of presses of `reduced`, which is `finger` on its mesh number `variant`."""
    from papilla.fem import recover
    from papilla.fem.reduction.finger_model import model_of

    progress("recovering the strain field")
    mesh = build(finger, size_mm=reduced.mesh_size_mm, variant=variant, progress=progress)
    model = model_of(finger, mesh)
    return [recover(model, reduced, press) for press in presses]


def strain_page(
    path: str | Path,
    finger: Finger,
    reduced: ReducedFinger,
    presses: Sequence[Press],
    specimen: Specimen,
    *,
    progress: Progress = silent,
    shown: str = STRAIN_QUANTITY,
) -> None:
    """Write a page that shows presses of a specimen as `strain` does, as a solid that can be turned, with a slider over
    the presses. The pointer over a gauge shows its reading. The page needs no network.

    Raises as `strain`, and `MissingExtraError` without plotly.
    """
    from papilla.view.strain_field import PressScene
    from papilla.view.turning import need_plotly, strain_html

    need_plotly()
    recovered = fields(finger, reduced, presses, progress=progress)
    scenes = [PressScene(field, press, specimen) for field, press in zip(recovered, presses, strict=True)]
    write_text(path, strain_html(scenes, reduced, finger, quantity=shown))


def receptive(
    path: str | Path,
    finger: Finger,
    gauge_name: str | None = None,
    *,
    size_mm: float | None = None,
    progress: Progress = silent,
) -> None:
    """Write the receptive field of a gauge, or maps of all of them: the skin, coloured by the strain of the gauge per
    small load at each place.

    Raises `InputError` for an unknown gauge or kind of file, `FileAccessError` if the file cannot be written, and what
    meshing and solving raise.
    """
    picture_format = kind_of(path)
    names = [gauge.name for gauge in finger.gauges]
    if gauge_name is not None and gauge_name not in names:
        raise InputError(f"{finger.name} has no gauge {gauge_name!r}; its gauges are {', '.join(names)}")
    from papilla.view.receptive_field import receptive_fields_figure, receptive_figure

    responses = receptive_of(finger, size_mm=size_mm, progress=progress)
    if gauge_name is None:
        figure = receptive_fields_figure(responses, finger)
    else:
        figure = receptive_figure(responses, finger, gauge_name)
    write_bytes(path, content(figure, picture_format, PICTURE_DPI))


def receptive_of(finger: Finger, *, size_mm: float | None = None, progress: Progress = silent) -> "ReceptiveFields":
    """The receptive fields of a finger's gauges, kept in the cache; raises what meshing and solving raise."""
    mesh = build(finger, size_mm=size_mm, progress=progress)

    def make() -> dict[str, np.ndarray]:
        from papilla.fem import receptive_fields
        from papilla.fem.reduction.finger_model import model_of

        progress("solving for the receptive fields")
        fields = receptive_fields(model_of(finger, mesh))
        return {"vertices": fields.vertices, "strain_per_newton": fields.strain_per_newton}

    cached = cache.fetch("receptive", cache.key("papilla.fem.fields", finger.sha256, mesh.sha256), make)

    from papilla.fem import ReceptiveFields

    return ReceptiveFields(mesh, cached["vertices"], cached["strain_per_newton"])


def contact(
    path: str | Path,
    reduced: ReducedFinger,
    press: Press,
    specimen: Specimen | None = None,
    beside: tuple[Press, Specimen] | None = None,
) -> None:
    """Write the contact pressure of a press of `reduced`; two presses are drawn beside each other on one scale.

    specimen : what was pressed, for the title. Raises `InputError` if the press is not one of `reduced` and for an
    unknown kind of file, `FileAccessError` if the file cannot be written.
    """
    from papilla.view.contact_map import contact_figure

    write_bytes(path, content(contact_figure(reduced, press, specimen, beside), kind_of(path), PICTURE_DPI))
