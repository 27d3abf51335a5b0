"""The finger and its design file: what loads, what its hashes follow, and one clear line for everything else."""

import dataclasses
import json
import re

import pytest

from papilla.core.errors import FileAccessError, FileFormatError, InputError, PapillaError
from papilla.model.file import SHAPE_FORMS
from papilla.model.finger import DEFAULT_FINGER, SHIPPED_FINGERS, Bench, Dome, Finger, Gauge, Layer, Slab, Surfaces
from papilla.model.materials import NeoHookean, Ogden, Yeoh
from papilla.model.parts import Identified, Ridges
from papilla.model.specimen import Block

TEXT = DEFAULT_FINGER.read_text()
SLAB = """
name = "slab"
[shape]
kind = "slab"
outer_mm = [24, 20]
interface_mm = [21, 17]
bone_mm = [10, 6]
depth_mm = 12.5
[outer]
modulus_MPa = 0.2
[inner]
modulus_MPa = 0.05
nu = 0.5
[bone]
modulus_MPa = 3000
nu = 0.35
[[gauges]]
name = "left"
x_mm = -3
y_mm = 2
direction_deg = 90
length_mm = 1
backing_mm = [3, 1.5]
membrane_gain = 0.5
lever_mm = -0.04
"""
SURFACES = """
name = "scan"
[shape]
kind = "surfaces"
outer_file = "skin.stl"
interface_file = "sub/interface.ply"
bone_file = "bone.vtp"
[outer]
modulus_MPa = 0.2
[inner]
modulus_MPa = 0.05
[[gauges]]
name = "g1"
x_mm = 0
"""


@pytest.fixture
def load(tmp_path):
    def read(text: str) -> Finger:
        path = tmp_path / "finger.toml"
        path.write_text(text, encoding="utf-8")
        return Finger.load(path)

    return read


def edit(old: str, new: str, count: int = 1) -> str:
    assert old in TEXT
    return TEXT.replace(old, new, count)


DOME_TABLE = TEXT[TEXT.index("[shape]") : TEXT.index("[outer]")]


def test_the_default_finger_is_the_documented_one():
    finger = Finger.default()
    assert finger.shape == Dome((24, 30, 20), (21, 27, 17), (10, 16, 6))
    assert finger.outer == Layer(0.136, 0.4999) and finger.inner == Layer(0.034, 0.4999) and finger.bone is None
    assert [gauge.name for gauge in finger.gauges] == ["g1", "g2", "g3", "g4", "g5"]
    assert [gauge.angle_deg for gauge in finger.gauges] == [-40, -20, 0, 20, 40]
    assert all(gauge.length_mm == 2.4 and gauge.backing_mm == (4.8, 2.0) for gauge in finger.gauges)
    assert all((gauge.membrane_gain, gauge.lever_mm, gauge.y_mm) == (1, 0, 0) for gauge in finger.gauges)
    assert finger.patch_radius == 15 and finger.ridges == Ridges(1.2, 0.6, 0.3)


def test_slab_and_all_keys_of_a_gauge(load):
    finger = load(SLAB)
    assert finger.shape == Slab((24, 20), (21, 17), (10, 6), 12.5)
    assert finger.outer == Layer(0.2, 0.4999) and finger.inner == Layer(0.05, 0.5) and finger.bone == Layer(3000, 0.35)
    assert finger.gauges == (
        Gauge(
            "left", None, -3, 2, direction_deg=90, length_mm=1, backing_mm=(3, 1.5), membrane_gain=0.5, lever_mm=-0.04
        ),
    )
    assert finger.patch_radius is None and finger.ridges is None
    assert load(SLAB.replace("depth_mm = 12.5\n", "")).shape.depth == 10, "as published"


def test_surface_files_are_found_beside_the_design_file(load, tmp_path):
    shape = load(SURFACES).shape
    assert shape == Surfaces(*(str(tmp_path / name) for name in ("skin.stl", "sub/interface.ply", "bone.vtp")))


@pytest.mark.parametrize(
    "old, new, geometry",
    [
        ("modulus_MPa = 0.136", "modulus_MPa = 0.137", False),
        ("\nnu = 0.4999", "\nnu = 0.5", False),
        ('name = "g1"', 'name = "first"', False),
        ("patch_radius_mm = 15.0", "patch_radius_mm = 14.0", True),
        ("angle_deg = -40.0", "angle_deg = -41.0", True),
        ("angle_deg = -40.0", "angle_deg = -40.0\nlever_mm = 1", False),
        ("height_mm = 0.3", "height_mm = 0.4", False),
        ("interface_mm = [21.0", "interface_mm = [20.5", True),
        ("[ridges]", "[bone]\nmodulus_MPa = 3000\n[ridges]", True),
    ],
)
def test_hashes_follow_the_content(load, old, new, geometry):
    before, after = Finger.default(), load(edit(old, new))
    assert before.sha256 != after.sha256
    assert (before.geometry_sha256 != after.geometry_sha256) == geometry


def test_hashes_do_not_follow_spelling(load):
    respelt = load("# a comment\n" + edit("0.136", "136e-3").replace("24.0, 30.0, 20.0", "24, 30, 20"))
    assert respelt.sha256 == load(TEXT).sha256 == Finger.default().sha256
    assert respelt.geometry_sha256 == Finger.default().geometry_sha256
    assert len(respelt.sha256) == 64


def test_hashes_of_surface_files_follow_their_bytes(load, tmp_path):
    (tmp_path / "sub").mkdir()
    for name in ("skin.stl", "sub/interface.ply", "bone.vtp", "copy.stl"):
        (tmp_path / name).write_bytes(name.encode() if name != "copy.stl" else b"skin.stl")
    first = load(SURFACES)
    geometry = first.geometry_sha256
    copied = load(SURFACES.replace("skin.stl", "copy.stl"))
    assert first.sha256 == copied.sha256, "the same bytes under another name"
    (tmp_path / "skin.stl").write_bytes(b"changed")
    assert load(SURFACES).sha256 != first.sha256 and load(SURFACES).geometry_sha256 != geometry
    (tmp_path / "skin.stl").unlink()
    with pytest.raises(FileAccessError, match="cannot read surface file .*skin.stl: No such file"):
        _ = load(SURFACES).sha256


CARDS = {
    'model = "neo-Hookean", mu_MPa = 0.0403': NeoHookean(0.0403),
    'model = "yeoh", c1_MPa = 0.02015, c3_MPa = 0.001': Yeoh(0.02015, 0.0, 0.001),
    'model = "ogden", mu_MPa = 0.0403, alpha = 3.25': Ogden(0.0403, 3.25),
}


def with_card(modulus: str, card: str) -> str:
    return edit("modulus_MPa = 0.136\n", f"{modulus}\nmaterial = {{ {card} }}\n")


def test_a_card_gives_its_layer_the_small_strain_modulus_and_changes_the_hash(load):
    default = Finger.default()
    hashes = {default.sha256}
    for text, card in CARDS.items():
        finger = load(with_card("", text))
        hashes.add(finger.sha256)
        assert finger.outer.modulus == pytest.approx(2 * 0.0403 * 1.4999, rel=1e-12)
        assert finger.outer.material == card and finger.outer == Layer.of(card, 0.4999)
        assert finger.geometry_sha256 == default.geometry_sha256
        both = load(with_card("modulus_MPa = 0.121", text)).outer
        assert both == Layer(0.121, 0.4999, card), "three digits of one modulus agree with three of the other"
    assert len(hashes) == 4
    assert "material" not in json.dumps(default.describe())
    assert finger.describe()["outer"]["material"] == {"kind": "ogden", "mu": 0.0403, "alpha": 3.25}


@pytest.mark.parametrize(
    "modulus, card, message",
    [
        ("modulus_MPa = 0.2", 'model = "yeoh", c1_MPa = 0.05', "modulus 0.2 MPa is not that of its yeoh material"),
        ("", 'model = "cube"', "outer.material: Input tag 'cube' found using 'model' does not match"),
        ("", 'model = "ogden", mu_MPa = 0.1, alpha = 0', "outer.material: Ogden alpha must not be 0"),
    ],
)
def test_unusable_cards(load, modulus, card, message):
    assert message in refusal(load, with_card(modulus, card))


def refusal(load, text: str) -> str:
    with pytest.raises(FileFormatError) as caught:
        load(text)
    message = str(caught.value)
    assert isinstance(caught.value, PapillaError) and isinstance(caught.value, ValueError)
    assert "\n" not in message and "finger.toml" in message, message
    return message


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("modulus_MPa = 0.136", "modulus_MPa = -0.136", "outer.*modulus.* must be greater than 0, got -0.136"),
        ("modulus_MPa = 0.136", "modulus_MPa = nan", "outer.modulus_MPa.*finite.*nan"),
        ("modulus_MPa = 0.136", 'modulus_MPa = "hard"', "outer.modulus_MPa.*number.*'hard'"),
        ("patch_radius_mm = 15.0", "patch_radius_mm = 0", r"patch_radius \(mm\) must be greater than 0"),
        ("angle_deg = -40.0", "angle_deg = -40.0\nlength_mm = 0", "gauge g1 length_mm must be greater than 0, got 0"),
        ("modulus_MPa = 0.136\n", "", "outer: key modulus_MPa is missing"),
        ("\nnu = 0.4999", "\nnu = 0.51", "outer.*nu must lie between 0 and 0.5, got 0.51"),
        ("\nnu = 0.4999", "\npoisson = 0.5", "unknown key outer.poisson"),
        ("bone_mm = [10.0, 16.0", "bone_mm = [10.0, 28.0", "bone semi-axis y 28 mm must be smaller than"),
        ('kind = "dome"', 'kind = "cube"', "shape.*'cube'"),
        ("width_mm = 0.6", "width_mm = 1.2", "ridge width 1.2 mm must be smaller than the pitch 1.2 mm"),
        ('name = "g2"', 'name = "g1"', "gauge names must differ, got g1 twice"),
        ("angle_deg = -40.0", "angle_deg = -90.0", "gauge g1 lies outside the interface: angle_deg -90"),
        ("angle_deg = -40.0", "x_mm = -20.0\ny_mm = 15", r"gauge g1 lies outside the interface: \|x_mm\| 20 >= 17.46"),
        ("angle_deg = -40.0", "angle_deg = 0\ny_mm = 27", r"gauge g1 lies outside the interface: \|y_mm\| 27 >= 27"),
        ("angle_deg = -40.0", "angle_deg = -40.0\nx_mm = 1", "gauge g1: give exactly one of angle_deg and x_mm"),
        ("angle_deg = -40.0", "angle_deg = -40.0\nbacking_mm = [4]", r"key gauges\[0\].backing_mm\[1\] is missing"),
        ("angle_deg = -40.0", "angle_deg = true", r"gauges\[0\].angle_deg.*(number|float).*True"),
        ("[[gauges]]", "[bench]\nthickness_mm = 0\n[[gauges]]", r"bench thickness \(mm\) must be greater than 0"),
        ("[[gauges]]", '[bench]\nfriction = "glue"\n[[gauges]]', "friction must be a number of at least 0 or .stick"),
        ("[[gauges]]", "[[gauges", "is not valid TOML: "),
    ],
)
def test_unusable_values(load, old, new, message):
    found = refusal(load, edit(old, new))
    assert re.search(message, found, re.IGNORECASE), found


def test_each_kind_of_shape_is_told_in_a_form_that_can_be_read(load):
    for kind, form in SHAPE_FORMS.items():
        told = refusal(load, edit(DOME_TABLE, f'shape = "{kind}"\n'))
        assert told.endswith(f'; it is written [shape] kind = "{kind}", {form}')
        lines = "\n".join(["[shape]", f'kind = "{kind}"', *re.split(r", (?=\w+ =)", form)])
        design = edit(DOME_TABLE, lines + "\n")
        design = re.sub(r"angle_deg = (\S+)", lambda site: f"x_mm = {float(site[1]) / 4}", design)
        assert type(load(design).shape).__name__.lower() == kind
    for old, new, message in (
        ("[shape]", "[surfaces]", "unknown key surfaces"),
        ('"surfaces"', '"stl"', "shape: kind must be dome, slab, surfaces, in small letters; got 'stl'"),
        ('bone_file = "bone.vtp"\n', "", "key shape.bone_file is missing"),
    ):
        told = refusal(load, SURFACES.replace(old, new))
        assert told.endswith(f'{message}; it is written [shape] kind = "surfaces", {SHAPE_FORMS["surfaces"]}')
    # A measure that is wrong is no matter of the form
    assert "is written" not in refusal(load, edit("bone_mm = [10.0, 16.0, 6.0]", "bone_mm = [10.0, 28.0, 6.0]"))


def test_files_that_are_no_text_or_not_there(tmp_path):
    path = tmp_path / "finger.toml"
    for place, message in (
        (path, "finger.toml: No such file"),
        (tmp_path, "Is a directory"),
        ("a\0b.toml", "null byte"),
    ):
        with pytest.raises(FileAccessError, match=message):
            Finger.load(place)
    path.write_bytes(b"\xff\xfe\x00name")
    with pytest.raises(FileFormatError, match="finger.toml is not a text file in UTF-8"):
        Finger.load(path)
    path.write_bytes(b"\xef\xbb\xbf" + TEXT.encode())
    assert Finger.load(path) == Finger.default(), "a byte order mark is no fault"


@pytest.mark.parametrize("name", [r"$\\bad{$", "<script>", "[red]", "שלום", "漢字 🙂", "x" * 200, "a\u00a0b"])
def test_a_name_has_any_letters_and_is_kept(load, tmp_path, name):
    finger = load(edit("human-finger-mimetic sensor", name))
    finger.save(tmp_path / "again.toml")
    assert Finger.load(tmp_path / "again.toml") == finger


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("x" * 100_000, "1 to 200 letters, got 100000 letters"),
        (r"a\nb", "which cannot be printed"),
        (r"a\u202eb", "which cannot be printed"),
    ],
)
def test_names_keys_and_files_that_are_too_long_or_not_printable_are_one_short_line(load, name, message):
    lines = [refusal(load, edit(old, name)) for old in ("human-finger-mimetic sensor", "g2")]
    assert all(message in line for line in lines)
    lines.append(refusal(load, f'"{name}" = 1\n{TEXT}'))
    assert "unknown key" in lines[-1]
    with pytest.raises(FileAccessError, match="cannot read surface file") as caught:
        _ = load(SURFACES.replace("skin.stl", name)).sha256
    assert all(len(line) < 1000 and line.isprintable() for line in (*lines, str(caught.value)))


def test_fingers_that_ship_have_names():
    assert Finger.load("default") == Finger.default() and set(SHIPPED_FINGERS) == {"default", "published", "one-gauge"}
    published = Finger.load("published")
    assert published == Finger.published() == Finger.load(SHIPPED_FINGERS["published"])
    assert published.geometry_sha256 == Finger.default().geometry_sha256, "the reference meshes answer for both"
    assert published.strain_sha256 != Finger.default().strain_sha256, "its grids are shorter"
    assert published.bench == Bench(10.0, "stick", 0.1632)
    assert {gauge.lever_mm for gauge in published.gauges} == {-1.172}


def test_the_bench_is_no_part_of_the_finger(load):
    found = load(TEXT + "[bench]\nthickness_mm = 12\nfriction = 0.3\ntouch_down_mm = -0.1\n")
    assert found.bench == Bench(12, 0.3, -0.1) and Finger.default().bench == Bench()
    assert found.sha256 == Finger.default().sha256
    assert found.bench.specimen(0.2) == Block(0.2, 12.0)


TOLD = {
    **{"status": 'ok: "quoted", µ and\ttab', "presses": 3, "specimen": "block", "friction": "stick"},
    **{"zeros_microstrain": (1.0, 2.0, 3.0, 4.0, -5e-3), "touch_down_mm": 0.1, "logarithmic": (True, False)},
    **{"parameters": ("outer_modulus_MPa", "gain.g1"), "values": (1.0, 2.0), "lower": (0.9, 1.5), "upper": (1.1, 2.5)},
    **{"covariance": ((1e-3, 0.0), (0.0, 1e-4)), "chi_square": 3.2, "freedom": 4.5, "force_error": 0.01},
    **{"noise_microstrain": 5.0, "notes": ("one \U0001f590", "two\x7f")},
}


def test_a_saved_design_is_the_same_finger(tmp_path):
    plain, told = Finger.default(), Identified(**TOLD)
    gauge = dataclasses.replace(plain.gauges[0], membrane_gain=-0.3, backing_mm=(3.0, 1.0))
    whole = dataclasses.replace(
        plain, inner=Layer.of(Ogden(0.012, 3.0)), bone=Layer(3000.0, 0.3), gauges=(gauge, *plain.gauges[1:]),
        bench=Bench(12.0, "stick", 0.1), identified=told,
    )  # fmt: skip
    for finger in (plain, whole):
        finger.save(tmp_path / "finger.toml")
        again = Finger.load(tmp_path / "finger.toml")
        assert again == finger and again.sha256 == finger.sha256
    assert dataclasses.replace(plain, identified=told).sha256 == plain.sha256
    assert told.sigma("gain.g1") == pytest.approx(0.01)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"values": (1.0,)}, "identified values must hold 2 entries"),
        ({"covariance": ((-1.0, 0.0), (0.0, 1.0))}, "negative variance"),
        ({"touch_down_mm": float("nan")}, "identified numbers must be finite"),
        ({"values": (-1.0, 1.0)}, "identified outer_modulus_MPa must be greater than 0"),
        ({"zeros_microstrain": (1.0,)}, "identified zeros_microstrain must hold 5 numbers"),
    ],
)
def test_an_identification_that_does_not_fit_together_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        dataclasses.replace(Finger.default(), identified=Identified(**TOLD | change))


def test_a_gauge_that_was_moved_is_another_finger_that_large_strain_changes_alike(tmp_path):
    finger = Finger.default()
    moved = dataclasses.replace(
        finger, gauges=(dataclasses.replace(finger.gauges[0], moved_mm=(0.5, -0.2)), *finger.gauges[1:])
    )
    for digest in ("sha256", "geometry_sha256"):
        assert getattr(moved, digest) != getattr(finger, digest)
    assert moved.strain_sha256 == finger.strain_sha256
    assert "moved_mm" not in str(finger.describe()) and "moved_mm" in str(moved.describe())
    moved.save(tmp_path / "moved.toml")
    assert Finger.load(tmp_path / "moved.toml") == moved
    with pytest.raises(InputError, match="gauge g1 moved_mm must be"):
        dataclasses.replace(finger.gauges[0], moved_mm=(float("nan"), 0.0))
