"""`papilla slide`: one sliding scene, written as the log of a finger, with the true values in a second file."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from papilla.cli.options import FingerOption, SceneOption, design_of, keep_inputs, option, scene_of, surface_files
from papilla.cli.output import CommandResult, finite, print_table, progress, tell
from papilla.core.errors import InputError

if TYPE_CHECKING:
    from papilla.fem import Motion, Slide
    from papilla.fem.sliding.tying import Tie
    from papilla.model.textures import Texture

SLIDE_SCHEMA = "papilla.slide/1"
DEPTH_MM, DEFAULT_SLIDE_FORCE_N = 0.5, 0.3


@dataclass(frozen=True)
class TextureOptions:
    """The surface under the finger."""

    groove: float | None = option(None, "Width of a groove, mm.")
    ridge: float | None = option(None, "Width of a ridge of the grating, mm.")
    depth: float | None = option(None, "Depth of a groove, mm.  [default: 0.5]")
    form: Literal["trapezoid", "sine"] = option("trapezoid", "Section of the grating.")
    flank: float = option(0.0, "Width of a trapezoid's flanks, part of the groove, mm.")
    profile: Path | None = option(None, "Measured profile (CSV: x_mm,height_mm) in place of it.")

    def texture(self) -> "Texture":
        """The texture that the options describe; raises `InputError` for options that contradict each other."""
        from papilla.model.specimen import Grating
        from papilla.model.textures import MeasuredProfile

        if self.profile is not None:
            if not self.groove is self.ridge is self.depth is None or self.form != "trapezoid" or self.flank:
                raise InputError(
                    "--groove, --ridge, --depth, --form and --flank describe a grating: not with --profile"
                )
            return MeasuredProfile.read(self.profile)
        if self.groove is None or self.ridge is None:
            raise InputError("give --groove and --ridge (mm), or --profile with a file")
        depth = DEPTH_MM if self.depth is None else self.depth
        return Grating(self.groove, self.ridge, depth, self.form, self.flank)


@dataclass(frozen=True)
class MotionOptions:
    """How the finger moves along x."""

    speed: float | None = option(None, "Speed along x, mm/s; negative to the left.")
    motion: Path | None = option(None, "Motion (CSV: t_s,position_mm) in place of a speed.")
    seconds: float | None = option(None, "Duration; of a motion all of it unless given.")
    rate: float = option(1000.0, "Samples a second.")

    def moved(self, texture: "Texture", inside: float) -> "Motion":
        """The motion; on a measured profile it begins `inside` mm from the end. Raises `InputError`."""
        from papilla.fem import Motion

        if (self.speed is None) == (self.motion is None):
            raise InputError("give exactly one of --speed (mm/s) and --motion (a file)")
        if self.motion is not None:
            return Motion.read(self.motion, self.rate, self.seconds)
        if self.speed is None or self.seconds is None:
            raise InputError("--speed needs --seconds")
        steady, (low, high) = Motion.steady(self.speed, self.seconds, self.rate), texture.span
        if low == -float("inf"):
            return steady
        # Distance from the profile's end at which the contact finds the profile on both sides of the apex
        return replace(steady, position_mm=steady.position_mm + (low + inside if self.speed >= 0 else high - inside))


def slide(
    ground: TextureOptions,
    moving: MotionOptions,
    out: Path = option(..., "Log to write (CSV); its truth is written beside it as NAME.truth.json."),
    force: float | None = option(None, "Pressing force, N.  [default: 0.3]"),
    press_depth: float | None = option(None, "Held depth of the finger's top, mm, for a force."),
    friction: float | None = option(
        None, "Coulomb's coefficient, 0 to 3.  [default: the bench's of the design, else 0]"
    ),
    dynamics: Literal["auto", "quasi-static", "modal"] = option("auto", "Inertia: in fast scenes, never, always."),
    loss_factor: float | None = option(None, "Of the section's modes; the finger's identified relaxation, or 0.1."),
    noise_microstrain: float = option(0.0, "White noise of a gauge, standard deviation."),
    seed: int = option(0, "Of the noise."),
    ridges: bool = option(True, "Whether the finger's ridges stand on its skin."),
    finger: FingerOption = None,
    scene: SceneOption = None,
    movie: Path | None = option(None, "Moving picture of the section to write as well (GIF)."),
) -> CommandResult:
    """Slide the finger over a grating or a measured profile: gauge signals as `papilla estimate` reads them.

    Give --groove and --ridge or --profile; --speed and --seconds or --motion; --force or --press-depth.
    """
    from papilla import fem
    from papilla.core import checks
    from papilla.core.files import check_writable, sidecar
    from papilla.mesh.section import patch_half_width

    truth = sidecar(out, "truth.json")
    design = design_of(finger)
    design = design if ridges else replace(design, ridges=None)
    keep_inputs(
        [scene, ground.profile, moving.motion, finger, *surface_files(design)],
        [out, truth, *([movie] if movie else [])],
    )
    if movie is not None and movie.suffix.lower() != ".gif":
        raise InputError(f"--movie {movie}: a moving picture is written as .gif")
    texture = ground.texture()
    noise = checks.within("--noise-microstrain", noise_microstrain, 0.0, 1e6)
    if seed < 0:
        raise InputError(f"--seed must be at least 0, got {seed}")
    if force is not None and press_depth is not None:
        raise InputError("give one of --force and --press-depth, not both")
    force = DEFAULT_SLIDE_FORCE_N if press_depth is None and force is None else force
    check_writable(out.parent)
    moved = moving.moved(texture, patch_half_width(design) / 2)
    with progress() as reporter:
        slid = fem.slide(
            design, texture, moved, force=force, depth=press_depth, friction=friction, dynamics=dynamics,
            loss_factor=loss_factor, progress=reporter,
        )  # fmt: skip
    facts = _facts(slid, texture) | {
        "noise_microstrain": noise,
        "seed": seed,
        "log": str(out),
        "truth": str(truth),
        "finger": design.name,
        "finger_sha256": design.sha256,
    }
    _write(out, truth, slid, noise, seed, facts)
    if movie is not None:
        from papilla.view.slide_movie import write_slide_movie

        write_slide_movie(movie, design, texture, slid)
    return CommandResult(facts, partial(_print, facts))


def _facts(slid: "Slide", texture: "Texture") -> dict:
    import numpy as np

    from papilla.model.textures import MeasuredProfile

    slides = slid.sliding
    measured = isinstance(texture, MeasuredProfile)
    same = ("status", "friction", "dynamics", "why", "loss_factor", "loss_from", "first_mode_Hz", "highest_Hz")
    return {name: getattr(slid, name) for name in (*same, "energy_error", "in_groove_mm", "seconds")} | {
        "schema": SLIDE_SCHEMA,
        "texture": {"kind": "profile", "span_mm": list(texture.span)}
        if measured
        else {"kind": "grating", **vars(texture)},
        "wavelength_mm": texture.wavelength,
        "ridge_pitch_mm": slid.ridge_pitch_mm or None,
        "gauges": list(slid.gauge_names),
        "samples": len(slid.readings),
        "rate_Hz": slid.motion.rate_Hz,
        "mean_force_N": float(slid.force_N.mean()),
        "mean_depth_mm": float(slid.depth_mm.mean()),
        "effective_length_mm": slid.length_mm,
        "at_rest": _at_rest(slid.tied),
        "fully_sliding_from_s": float(slid.motion.t_s[np.argmax(slides)]) if slides.any() else None,
        "share_fully_sliding": float(slides.mean()),
        "mean_microstrain": slid.amplified.mean(axis=0).tolist(),
        "sd_microstrain": slid.amplified.std(axis=0).tolist(),
        "relaxed_steps": slid.relaxed,
        "unresolved_steps": slid.unresolved,
        "flank_push_of_force": slid.flank_push,
    }


def _at_rest(tied: "Tie | None") -> dict | None:
    """The press in three dimensions to which the section is tied, and the section's own part of it."""
    if tied is None:
        return None
    from papilla.fem.sliding.tying import RIGID_FLAT

    return tied.press.to_json() | scene_of(RIGID_FLAT, tied.press) | {"added_microstrain": tied.lacking.tolist()}


def _write(out: Path, truth: Path, slid: "Slide", noise: float, seed: int, facts: dict) -> None:
    import json

    import numpy as np

    from papilla.core.files import replacing_set
    from papilla.core.tables import write_table

    added = noise * np.random.default_rng(seed).standard_normal(slid.amplified.shape)
    columns = {
        "t_s": slid.motion.t_s,
        **{f"g{k}": channel for k, channel in enumerate((slid.amplified + added).T, 1)},
        "force_N": slid.force_N,
        "velocity_mm_s": slid.motion.velocity_mm_s,
        "position_mm": slid.motion.position_mm,
        "tangential_N": slid.tangential_N,
    }
    with replacing_set([out, truth]) as (log, truth_file):
        write_table(log, columns)
        truth_file.write_text(json.dumps(finite(facts), indent=1) + "\n", encoding="utf-8")


def _print(facts: dict) -> None:
    rows = [
        ("wavelength", "none known" if facts["wavelength_mm"] is None else f"{facts['wavelength_mm']:.4g}", "mm"),
        ("mean force", f"{facts['mean_force_N']:.4g}", "N"),
        ("mean depth", f"{facts['mean_depth_mm']:.4g}", "mm"),
        ("effective length along y", f"{facts['effective_length_mm']:.4g}", "mm"),
    ]
    if rest := facts["at_rest"]:
        rows += [
            ("at rest on a flat: depth", f"{rest['indentation_mm']:.4g}", "mm"),
            ("at rest on a flat: S_d", f"{rest['sd_microstrain']:.1f}", "µε"),
        ]
        for name, read, added in zip(
            facts["gauges"], rest["reading_microstrain"], rest["added_microstrain"], strict=True
        ):
            rows.append((f"at rest {name} (of it not the section's)", f"{read:.0f}, {added:.0f}", "µε"))
    for name, mean, sd in zip(facts["gauges"], facts["mean_microstrain"], facts["sd_microstrain"], strict=True):
        rows.append((f"signal {name} (mean, sd)", f"{mean:.0f}, {sd:.1f}", "µε"))
    rows += [("dynamics", facts["dynamics"], ""), ("computed in", f"{facts['seconds']:.2f}", "s")]
    tell(f"{facts['samples']} samples at {facts['rate_Hz']:g} Hz in {facts['log']}; truth in {facts['truth']}")
    print_table(rows)
    tell(f"{facts['dynamics']}: {facts['why']}")
    if facts["dynamics"] == "modal":
        tell(f"loss factor {facts['loss_factor']:.2g}, {facts['loss_from']}")
    if rest := facts["at_rest"]:
        tell(f"At rest as pressed on: {rest['physics']}; what the texture changes is the section's own")
    tell(facts["status"])
