"""No command overwrites what it reads, under whatever name it is given."""

import os

import pytest

from papilla.model.finger import DEFAULT_FINGER

LOG = "t_s,g1\n0,1\n0.001,2\n0.002,3\n"
PRESSES = "force_N,modulus_MPa,g1\n1,1,1\n2,1,2\n"


@pytest.fixture
def folder(tmp_path):
    """A folder with an input of each kind."""
    (tmp_path / "in.csv").write_text(LOG)
    (tmp_path / "sweep.csv").write_text(PRESSES)
    (tmp_path / "c.json").write_text("{}")
    text = DEFAULT_FINGER.read_text(encoding="utf-8")
    (tmp_path / "f.png").write_text(text, encoding="utf-8")
    scanned = 'kind = "surfaces"\nouter_file = "s.png"\ninterface_file = "b.stl"\nbone_file = "c.stl"\n\n'
    begin, end = text.index('kind = "dome"'), text.index("[outer]")
    scan = text[:begin] + scanned + text[end:]
    for site in ("-40.0", "-20.0", "0.0", "20.0", "40.0"):
        scan = scan.replace(f"angle_deg = {site}\n", f"x_mm = {float(site) / 4}\n")
    (tmp_path / "scan.toml").write_text(scan, encoding="utf-8")
    for name in ("s.png", "b.stl", "c.stl"):
        (tmp_path / name).write_text("")
    os.link(tmp_path / "in.csv", tmp_path / "hard.csv")
    (tmp_path / "soft.csv").symlink_to("in.csv")
    (tmp_path / "speed_against_error.png").write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.skipif(os.name != "posix", reason="links of a POSIX file system")
@pytest.mark.parametrize(
    "arguments",
    [
        ["estimate", "in.csv", "--out", "in.csv"],
        ["estimate", "in.csv", "--out", "sub/../in.csv"],
        ["estimate", "in.csv", "--out", "hard.csv"],
        ["estimate", "in.csv", "--out", "soft.csv"],
        ["estimate", "soft.csv", "--out", "in.csv"],
        ["estimate", "in.csv", "--calibration", "c.json", "--out", "c.json"],
        ["view", "--finger", "f.png", "--screenshot", "f.png"],
        ["view", "contact", "--finger", "scan.toml", "--screenshot", "s.png"],
        ["calibrate", "--bench", "sweep.csv", "--out", "."],
        ["calibrate", "--finger", "scan.toml", "--export-c", "s.png"],
        ["identify", "sweep.csv", "--finger", "scan.toml", "--out", "s.png"],
        ["slide", "--finger", "scan.toml", "--out", "s.png"],
        ["bench", "--short", "--finger", "speed_against_error.png", "--out", "."],
    ],
    ids=lambda arguments: " ".join(arguments),
)
def test_an_input_is_never_overwritten(folder, refused, arguments):
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    assert "would overwrite the input" in refused(*arguments)
    assert {path: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before


@pytest.mark.skipif(os.name != "posix", reason="links of a POSIX file system")
@pytest.mark.parametrize(
    "arguments",
    [
        ["calibrate", "--finger", "scan.toml", "--export-c"],
        ["identify", "sweep.csv", "--finger", "scan.toml", "--out"],
        ["slide", "--finger", "scan.toml", "--out"],
        ["view", "contact", "--finger", "scan.toml", "--screenshot"],
        ["compare", "scan.toml", "default", "--csv"],
        ["press", "--finger", "scan.toml", "--modulus", "0.1", "--force", "0.1", "--log"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_link_to_a_surface_of_the_finger_is_the_output_that_is_named(folder, papilla, arguments):
    (folder / "link.png").symlink_to("s.png")
    answer = papilla(*arguments, "link.png")
    assert answer.code == 2 and (folder / "s.png").read_bytes() == b""
    assert answer.err == "papilla: link.png would overwrite the input s.png: choose another name\n"


@pytest.mark.skipif(os.name != "posix", reason="links of a POSIX file system")
def test_a_loop_of_links_is_one_line(folder, refused):
    (folder / "loop.csv").symlink_to("loop.csv")
    assert "cannot write loop.csv" in refused("estimate", "in.csv", "--out", "loop.csv")
    (folder / "calibration").symlink_to("calibration")
    assert "cannot write calibration/calibration.json: Symlink loop" in refused("calibrate")


def test_a_link_is_followed_and_named_and_a_read_only_file_is_kept(papilla, refused, tmp_path):
    (tmp_path / "log.csv").write_text("time,ch1\n0,1\n0.001,2\n0.002,4\n")
    (tmp_path / "other.toml").write_text("old")
    (tmp_path / "map.toml").symlink_to(tmp_path / "other.toml")
    answer = papilla("log", "map", "log.csv", "--out", "map.toml")
    assert answer.code == 0 and f"map.toml is a link: {tmp_path / 'other.toml'} is written" in answer.err
    assert (tmp_path / "map.toml").is_symlink() and "[columns]" in (tmp_path / "other.toml").read_text()
    (tmp_path / "other.toml").chmod(0o444)
    for name in ("map.toml", "other.toml"):
        assert f"cannot write {name}: it is read-only" in refused("log", "map", "log.csv", "--out", name)
