"""Output: JSON, long lines, and the bar of a terminal."""

import json
import math

import pytest

from papilla.cli import main, options, output
from papilla.core.errors import InputError


def test_json_has_no_numbers_that_are_none_and_no_control_characters():
    text = output.json_text({"a": [1.5, math.nan, (math.inf, 2)], "b": {"c": -math.inf, "d": "µ\x7f"}, "e": True})
    assert json.loads(text) == {"a": [1.5, None, [None, 2]], "b": {"c": None, "d": "µ\x7f"}, "e": True}
    assert text.isascii() and "\\u007f" in text
    assert '"µ\\u007f"' in output.json_text({"d": "µ\x7f"}, ascii_only=False)


@pytest.mark.parametrize("encoding, printed", [("utf-8", "µ"), ("UTF8", "µ"), ("cp1252", "\\u00b5"), (None, "\\u00b5")])
def test_json_has_escapes_where_the_output_is_not_utf_8(monkeypatch, encoding, printed):
    said = []
    stream = type("Stream", (), {"encoding": encoding, "write": lambda self, text: said.append(text)})()
    monkeypatch.setattr("sys.stdout", stream)
    output.print_json({"a": "µ"})
    assert "".join(said) == f'{{"a": "{printed}"}}\n'


@pytest.mark.parametrize("length", [1999, 2000, 2001, 5000])
def test_the_middle_of_a_long_line_is_left_out(length):
    text = "a" * 1000 + "b" * (length - 1000)
    found = output.plain(text)
    if length <= 2000:
        assert found == text
    else:
        assert found == f"{'a' * 1000} ... ({length - 2000} characters) ... {'b' * 1000}"


class Bar:
    """In place of a bar on the terminal."""

    def __init__(self):
        self.tasks, self.updates = [], []

    def add_task(self, text, total):
        self.tasks.append((text, total))
        return 7

    def update(self, task, **how):
        self.updates.append((task, how))


def test_a_bar_shows_stage_and_steps_and_says_nothing(capsys):
    bar = Bar()
    shown = output.Progress(bar)
    shown.line("meshing,\x1b 3 s")
    shown.steps(2, 5)
    shown.stage("fitting", 3, 5)
    assert bar.tasks == [("", None)] and bar.updates == [
        (7, {"description": "meshing,\\x1b 3 s", "total": None}), (7, {"completed": 2, "total": 5}),
        (7, {"description": "fitting", "total": None}), (7, {"completed": 3, "total": 5}),
    ]  # fmt: skip
    assert capsys.readouterr().err == ""
    output.Progress(None).steps(2, 5)


def test_a_terminal_has_a_bar_that_it_leaves_clean(monkeypatch, capsys):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("FORCE_COLOR", "1")
    with output.progress() as shown:
        assert shown._bar is not None and shown._bar.live.transient
        shown.stage("meshing [bold]", 2, 5)
        (task,) = shown._bar.tasks
        assert (task.description, task.completed, task.total) == ("meshing [bold]", 2, 5)
    captured = capsys.readouterr()
    assert captured.out == "" and "meshing [bold]" in captured.err and "2/5" in captured.err


def test_a_table_of_rows_has_names_left_and_numbers_right(capsys):
    output.show_rows(["name", "long head"], [["a", "1"], ["bbbbbb", "22"]], "title [x]")
    title, _, heads, _, first, second, _ = capsys.readouterr().out.splitlines()
    assert title.strip() == "title [x]"
    assert heads.replace("┃", "│") == "│ name   │ long head │"
    assert first == "│ a      │         1 │" and second == "│ bbbbbb │        22 │"
    output.show_rows(["name"], [])
    assert "name" in capsys.readouterr().out


def test_quantities_are_left_values_right_and_units_left(capsys):
    output.print_table([("a", "1", "N"), ("bbb", "22", "µε/gf")])
    assert capsys.readouterr().out.splitlines()[1:3] == ["│ a   │  1 │ N     │", "│ bbb │ 22 │ µε/gf │"]


# ---- Ends of a command


@pytest.mark.parametrize(
    "error, code, line",
    [
        (SystemExit(0), 0, ""),
        (SystemExit(None), 0, ""),
        (SystemExit(1), 141, ""),
        (BrokenPipeError(), 141, ""),
        (KeyboardInterrupt(), 130, "papilla: interrupted\n"),
        (main.typer.Abort(), 130, "papilla: interrupted\n"),
        (main._Terminated(), 143, "papilla: terminated\n"),
        (MemoryError(), 2, "papilla: not enough memory for this job (no detail)\n"),
        (OSError("odd"), 2, "papilla: input or output: odd\n"),
        (OSError(2, "No such file", "a.csv"), 2, "papilla: a.csv: No such file\n"),
    ],
)
def test_every_end_has_its_code_and_line(papilla, monkeypatch, error, code, line):
    def fail(*_, **__):
        raise error

    dropped = []
    monkeypatch.setattr(main, "app", fail)
    monkeypatch.setattr(main, "_drop_output", lambda: dropped.append(1))
    answer = papilla()
    assert (answer.code, answer.out, answer.err) == (code, "", line)
    assert bool(dropped) == (code == 141 or isinstance(error, OSError))


@pytest.mark.parametrize("returned, code", [(None, 0), (0, 0), (1, 1), ("text", 0), (130, 130)])
def test_what_the_application_returns_is_the_code(papilla, monkeypatch, returned, code):
    monkeypatch.setattr(main, "app", lambda *given, **how: returned)
    answer = papilla()
    assert answer.code == code and (answer.err == "papilla: interrupted\n") == (code == 130)


def test_the_application_is_called_with_the_arguments_and_one_thread(papilla, monkeypatch):
    from papilla.core.workers import THREADS

    asked = []
    for name in THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(THREADS[0], "3")
    monkeypatch.setattr(
        main, "app", lambda *given, **how: asked.append((given, how, [main.os.environ[t] for t in THREADS]))
    )
    papilla("press", "--modulus", 1)
    threads = ["3", *["1"] * (len(THREADS) - 1)]
    assert asked == [((["press", "--modulus", "1"],), {"prog_name": "papilla", "standalone_mode": False}, threads)]
    for name in THREADS[1:]:
        monkeypatch.delenv(name)


def test_a_warning_is_one_line(papilla, monkeypatch):
    import warnings

    def warned(*_, **__):
        warnings.warn("first\nsecond", stacklevel=1)

    monkeypatch.setattr(main, "app", warned)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert papilla().err == "papilla: warning: first second\n"


def test_open_streams_escape_what_their_encoding_lacks(papilla, monkeypatch):
    asked = []
    for name in ("stdout", "stderr"):
        stream = getattr(main.sys, name)
        monkeypatch.setattr(stream, "reconfigure", lambda own=name, **how: asked.append((own, how)), raising=False)
    papilla("--version")
    assert asked == [("stdout", {"errors": "backslashreplace"}), ("stderr", {"errors": "backslashreplace"})]


# ---- Options


def test_options_that_are_given_are_those_of_the_line_and_of_a_scene():
    sources = {"a_b": "ParameterSource.COMMANDLINE", "c": "DEFAULT_MAP", "d": "ParameterSource.DEFAULT", "e": None}
    context = type("Context", (), {"get_parameter_source": lambda self, name: sources[name]})()
    assert options.given(context, sources) == ["--a-b", "--c"]


@pytest.mark.parametrize("text, found", [(None, None), ("stick", "stick"), ("0", 0.0), ("0.5", 0.5)])
def test_friction_of_a_text(text, found):
    assert options.read_friction(text) == found


def test_element_sizes():
    assert options.mesh_size(None) == 0.7 and options.mesh_size(1.5) == 1.5
    with pytest.raises(InputError, match="--size-mm must be greater than 0"):
        options.mesh_size(0.0)


def test_a_fault_names_its_file_once(tmp_path):
    for said in ("a fault", f"{tmp_path}: a fault"):
        with pytest.raises(InputError, match=f"^{tmp_path}: a fault$"), options.about(tmp_path):
            raise InputError(said)


def test_notes_of_a_log_are_said_and_units_where_they_are_asked_for(tmp_path, capsys):
    path = tmp_path / "log.csv"
    path.write_text("force_N,modulus_MPa,g1,who\n20,0.5,1,a\n30,0.1,2,b\n")
    quiet, loud = [], []
    for units, said in ((False, quiet), (True, loud)):
        assert options.read_press_log(path, units).force_N.tolist() == [20, 30]
        said += capsys.readouterr().err.splitlines()
    assert quiet == [f"{path}: ignored columns: who"] and loud[0] == quiet[0] and "gf" in loud[1]
