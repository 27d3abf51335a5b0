"""What commands refuse: one clear line, exit code 2, nothing on stdout and nothing written."""

import shlex

import numpy as np
import pytest

from papilla.core.tables import write_table
from papilla.model.finger import DEFAULT_FINGER

PRESSED, SLID = "press --modulus 0.5", "slide --groove 0.9 --ridge 0.9 --speed 40 --out log.csv"
PROFILE, MOTION = "slide --motion m.csv --out log.csv --profile", "slide --profile p.csv --out log.csv --motion"

FILES = {
    "log.csv": "t_s,g1\n0,1\n1,2\n2,3\n",
    "m.csv": "t_s,position_mm\n0,0\n1,1\n",
    "p.csv": "x_mm,height_mm\n0,0\n1,0\n2,0\n",
    "p1.csv": "x_mm,height_mm\n0,0\n",
    "p_nan.csv": "x_mm,height_mm\n0,0\n0.1,\n0.2,0\n",
    "p_gap.csv": "x_mm,height_mm\n0,0\n0.1,0\n0.2,0\n9,0\n",
    "p_falls.csv": "x_mm,height_mm\n0,0\n0.1,0\n0.1,0\n",
    "p_m.csv": "x_mm,height_mm\n0,0\n100,50\n200,0\n",
    "p_km.csv": "x_mm,height_mm\n0,0\n1e-4,0\n2e-4,0\n",
    "p_xy.csv": "x,y\n0,0\n",
    "m1.csv": "t_s,position_mm\n0,0\n",
    "m_falls.csv": "t_s,position_mm\n0,0\n1,1\n1,2\n",
    "m_gap.csv": "t_s,position_mm\n0,0\n0.001,1\n0.002,1\n5,1\n",
    "m_x.csv": "t_s,x\n0,0\n",
    "cut.toml": "name = [",
    "colour.toml": "colour = 'red'",
    "cube.toml": "[shape]\nkind = 'cube'",
    "three.csv": "force_N,modulus_MPa,g1,g2,g3\n0.5,0.1,1,2,3\n0.6,0.1,1,2,4\n",
    "falls.csv": "t_s,force_N,modulus_MPa,g1\n0,0.1,0.5,10\n2,0.2,0.5,20\n1,0.3,0.5,30\n",
    "tangential.csv": "t_s,position_mm,force_N,tangential_N\n0,1,1,1\n1,2,1,1\n2,3,1,1\n",
    "still.csv": "t_s,g1,position_mm\n0,1,5\n1,2,5\n2,3,5\n",
    "moving.csv": "t_s,g1,velocity_mm_s\n0,1,5\n1,2,5\n2,3,5\n",
    "file": "",
    "study.toml": "colour = 1\n",
}

REFUSED = f"""
dance | No such command 'dance'
press --modulos 1 | No such option: --modulos
press | Missing option '--modulus'
press --modulus soft | Invalid value for '--modulus'
press --modulus inf --force 1 | specimen modulus (MPa) must be finite
{PRESSED} | give exactly one of --force and --indentation
{PRESSED} --force 1 --indentation 1 | give exactly one of --force and --indentation
{PRESSED} --force 1 --friction glue | friction must be a number of at least 0 or "stick", got 'glue'
{PRESSED} --force 1 --friction -0.2 | friction must be a number of at least 0 or "stick", got -0.2
{PRESSED} --force 1 --friction stick --fidelity hertz | --fidelity hertz has no friction
{PRESSED} --force 0 | --force (N) must be greater than 0, got 0
{PRESSED} --indentation -1 | --indentation (mm) must be greater than 0, got -1
{PRESSED} --force 1 --at 0 inf | --at y (mm) must be finite, got inf
{PRESSED} --force 1 --radius 9 | --radius is for a sphere, not for a block
{PRESSED} --force 1 --specimen sphere | a sphere needs --radius
{PRESSED} --force 1 --specimen half-space --thickness 9 | --thickness is for a block, not for a half-space
{PRESSED} --force 1 --thickness 0 | specimen thickness (mm) must be greater than 0, got 0
{PRESSED} --force 1 --specimen cube | 'cube' is not one of 'half-space', 'block', 'sphere'
{PRESSED} --force 1 --fidelity best | 'best' is not one of 'auto', 'hertz', 'contact'
{PRESSED} --force 1 --fidelity finite --log touch.csv | --log makes hundreds of presses
{PRESSED} --force 1 --fidelity finite --export field.vtu | linear press
{PRESSED} --force 1 --export field.csv | fields are written as .vtu files
{PRESSED} --force 1 --finger nowhere.toml | cannot read finger file nowhere.toml: No such file
{PRESSED} --force 1 --finger cut.toml | cut.toml is not valid TOML
{PRESSED} --force 1 --finger colour.toml | colour.toml:
{PRESSED} --force 1 --finger cube.toml | cube.toml: key name is missing
{PRESSED} --force 1 --finger card.toml | outer: modulus 0.136 MPa is not that of its ogden material, 0.3 MPa
{PRESSED} --force 1 --finger {"x" * 900} | xxx
view contact --screenshot v.gif | v.gif: pictures are written as .png, .pdf, .svg, not as gif
view contact --screenshot v | v: pictures are written as .png, .pdf, .svg, not as a name without
view skin | 'skin' is not one of
view strain --gauge g1 | --gauge goes with a receptive field, not with strain
view receptive --force 1 | has no press: leave out --modulus, --beside, --force, --thickness, --radius
view receptive --radius 1 | has no press: leave out --modulus, --beside, --force, --thickness, --radius
view contact --html v.html | --html goes with strain, not with contact
view receptive --component zz | --component goes with strain, not with receptive
view strain --export v.vtk | v.vtk: fields are written as .vtu files
view receptive --gauge g9 | has no gauge 'g9'; its gauges are g1, g2, g3, g4, g5
{SLID} | --speed needs --seconds
{SLID} --seconds 1 --force -1 | force (N) must be greater than 0
{SLID} --seconds 1 --friction -0.5 | friction must lie between 0 and 3
{SLID} --seconds 1 --rate 0 | rate (Hz) must lie between
{SLID} --seconds 1 --noise-microstrain -1 | --noise-microstrain must lie between
{SLID} --seconds 1 --force 0.1 --press-depth 0.1 | give one of --force and --press-depth
{SLID} --seconds 1 --profile p.csv | describe a grating: not with --profile
{SLID} --seconds 1 --motion m.csv | give exactly one of --speed (mm/s) and --motion
{SLID} --seconds 1 --seed -1 | --seed must be at least 0
{SLID} --seconds 1 --speed 1e5 | speed (mm/s) must lie between -10000 and 10000
{SLID} --seconds 1e9 | more than 2,000,000 samples
{SLID} --seconds 1 --movie m.mp4 | --movie m.mp4: a moving picture is written as .gif
slide --out log.csv --groove 1 | give --groove and --ridge (mm), or --profile with a file
slide --out log.csv --groove 1 --ridge 1 --seconds 1 | give exactly one of --speed (mm/s) and --motion
slide --out log.csv --profile p.csv --form sine | not with --profile
slide --out m.csv --groove 1 --ridge 1 --motion m.csv | would overwrite the input
{PROFILE} p1.csv | p1.csv ... needs three points at least, got 1
{PROFILE} p_nan.csv | p_nan.csv ... point 2 of the profile is not finite
{PROFILE} p_gap.csv | p_gap.csv ... the profile has a gap from x_mm 0.2 to 9
{PROFILE} p_falls.csv | p_falls.csv ... x_mm of a profile must rise
{PROFILE} p_m.csv | p_m.csv ... are x_mm and height_mm in mm?
{PROFILE} p_km.csv | p_km.csv ... a profile of 0.0002 mm is shorter than a contact: are x_mm
{PROFILE} p_xy.csv | p_xy.csv ... column x_mm is missing
{MOTION} m1.csv | m1.csv ... needs two points at least
{MOTION} m_falls.csv | m_falls.csv ... times of a motion must rise: point 3
{MOTION} m_gap.csv | m_gap.csv ... the motion has a gap
{MOTION} m_x.csv | m_x.csv ... column position_mm is missing
calibrate --moduli 0.1 | --moduli needs the two ends of a range, or three or more moduli
calibrate --moduli a,b | --moduli must be numbers in MPa with commas, got 'a'
calibrate --moduli 0.1,0.1 | --moduli (MPa) must rise, got 0.1 and 0.1
calibrate --force-range 1 0.5 | --force-range (N) must rise, got 1 and 0.5
calibrate --force-range 0 0.5 | --force-range (N) must be greater than 0
calibrate --specimen half-space --thickness 5 | --thickness is for a block, not for a half-space
calibrate --bench p.csv --specimen half-space | leave out --specimen half-space
calibrate --check three.csv | 3 gauges
calibrate --bench three.csv --export-c three.csv | overwrite
calibrate --bench nowhere.csv | cannot read nowhere.csv
calibrate --size-mm nan | --size-mm must be finite, got nan
calibrate --bench nan.csv | nan.csv, line 5, column g2: expected a finite number, got nan
calibrate --bench one.csv | one.csv has one row
calibrate --bench beside.csv | beside.csv: press 2 is beside the apex, where S_d differs: papilla identify
calibrate --out file | cannot write to folder file: File exists
export-c none.json --out g.h | cannot read
identify | Missing argument 'LOG.csv'
identify --suggest 3 | needs --moduli
identify --suggest 0 --moduli 0.1 | must be at least 1, got 0
identify --suggest 3 --moduli 0.1,soft | --moduli must be numbers in MPa with commas, got 'soft'
identify --suggest 3 --moduli 0.1 --out f.toml | --out needs a log of presses
identify bench.csv --out f.toml --moduli 0.1 | --moduli goes with --suggest
identify bench.csv --out f.toml --places 0,0 | --places goes with --suggest
identify bench.csv --out f.toml --suggest 2 --places 3 | must be pairs x,y in mm with spaces between, got '3'
identify bench.csv | Missing option '--out'
identify bench.csv --out id.toml --report ./id.toml | id.toml is given for two outputs, of which one would be lost
identify bench.csv --compare f.toml --fix gain=1 | --fix does not go with --compare
identify --compare f.toml | --compare needs the log of the new presses
identify --relaxation 1 --suggest 1 --moduli 0.1 | --relaxation needs a log of presses
identify bench.csv --relaxation 1 --suggest 1 | --relaxation needs a column t_s
identify falls.csv --out f.toml | column t_s: must rise, got 1 after 2
texture train log.csv --out m.json | logs must be LABEL=LOG.csv
texture train =log.csv --out m.json | logs must be LABEL=LOG.csv
texture train fine= --out m.json | logs must be LABEL=LOG.csv
texture train fine=moving.csv --out m.json | samples are 5 mm apart
texture train fine=log.csv --out m.json | position_mm or velocity_mm_s
texture train fine=tangential.csv --out m.json | textures need gauges
texture train fine=still.csv --out m.json | the finger does not move
texture train fine=log.csv --out log.csv | would overwrite the input
texture classify log.csv --model none.json | cannot read texture model none.json
design study.toml --workers 0 | --workers must be from 1 to
design study.toml --workers 100000 | --workers must be from 1 to
design study.toml --workers 1 --scheduler tcp://host:1 | not both
design study.toml --place 9 | --place must be from 1 to 8, got 9
design study.toml --place 0 | --place must be from 1 to 8, got 0
design study.toml --insecure | are for --scheduler; other studies open no port
design study.toml --tls-ca file | are for --scheduler; other studies open no port
design study.toml --scheduler tcp://host:1 | tcp://host:1 is open
design study.toml | study.toml
design study.toml --place 8 --workers 1 | study.toml
bench --short --out file | cannot write to folder
bench --short --finger missing.toml | missing.toml
compare default | at least two
verify --only cube | cube
reproduce --only nothing | nothing
reproduce --out file | cannot write to folder file
figures --paper 1066 | 1066
figures --out file | cannot write to folder file
telepresence simulate --seed -1 | greater than or equal to 0
telepresence sensor --components 0 | greater than or equal to 1
"""
"""A command line and what it says; "..." stands for anything."""


@pytest.fixture
def files(tmp_path):
    """The files that the commands name."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    card = 'modulus_MPa = 0.136\nmaterial = { model = "Ogden", mu_MPa = 0.1, alpha = 3.0 }'
    design = DEFAULT_FINGER.read_text(encoding="utf-8").replace("modulus_MPa = 0.136", card)
    (tmp_path / "card.toml").write_text(design, encoding="utf-8")
    force, modulus = (grid.ravel() for grid in np.meshgrid(np.geomspace(0.1, 1, 12), [0.089, 0.51, 0.72]))
    readings = (2000 * force**0.7 * modulus**0.15)[:, None] * np.array([-0.4, -0.8, 1.5, -0.8, -0.4])
    bench = {"force_N": force, "modulus_MPa": modulus} | {f"g{k + 1}": column for k, column in enumerate(readings.T)}
    write_table(tmp_path / "bench.csv", bench)
    write_table(tmp_path / "nan.csv", bench | {"g2": np.where(np.arange(36) == 3, np.nan, bench["g2"])})
    write_table(tmp_path / "one.csv", {name: values[:1] for name, values in bench.items()})
    write_table(tmp_path / "beside.csv", bench | {"x_mm": np.arange(36.0), "y_mm": np.zeros(36)})


@pytest.mark.parametrize("case", REFUSED.strip().splitlines(), ids=lambda case: case.partition(" | ")[0][:80])
def test_what_cannot_be_done_is_refused_in_one_line(refused, files, case):
    line, _, message = case.partition(" | ")
    if line.startswith("texture"):
        pytest.importorskip("sklearn", reason="scikit-learn (extra `texture`) is not installed")
    said = refused(*shlex.split(line))
    assert all(part in said for part in message.split(" ... ")) and len(said) < 600
