"""What comes from outside: bounds, types, owners, and one line for each fault."""

import gzip
import os
import socket
import zipfile

import numpy as np
import pytest

from papilla.core import outside
from papilla.core.errors import FileAccessError, FileFormatError, InputError, NotOwnError


def test_a_file_larger_than_its_bound_is_refused_before_it_is_used(tmp_path):
    path = tmp_path / "big.toml"
    path.write_bytes(b"a = 1\n" * 1000)
    assert outside.read_bytes(path, most_bytes=6000) == path.read_bytes()
    with pytest.raises(FileFormatError, match="big.toml has more than 5999 bytes"):
        outside.read_bytes(path, most_bytes=5999)


@pytest.mark.parametrize("name", ["missing.json", ".", "nul\0.json"])
def test_a_file_that_cannot_be_read_is_named_in_one_line(tmp_path, name):
    with pytest.raises(FileAccessError, match="cannot read calibration ") as caught:
        outside.read_json(tmp_path / name, "calibration")
    assert "\n" not in str(caught.value) and "\0" not in str(caught.value)


@pytest.mark.parametrize(
    "text", ["NaN", "[1, -Infinity]", "1e999", "[" * 100_000, "9" * 5000, "{'a': 1}", "", '{"a": 1', "[1] 2"]
)
def test_json_has_finite_numbers_and_an_end(text):
    with pytest.raises(FileFormatError, match="^row 3 .*not valid JSON"):
        outside.json_value(text, "row 3")


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a = " + "9" * 5000, "a = 'b", "a = 1\na = 2"])
def test_toml_that_is_none_is_refused_in_one_line(text):
    with pytest.raises(FileFormatError, match="^design.toml is not valid TOML"):
        outside.toml(text, "design.toml")


def test_arrays_are_counted_before_they_are_unpacked(tmp_path):
    bomb = tmp_path / "bomb.npz"
    np.savez_compressed(bomb, zeros=np.zeros(10**7))
    assert bomb.stat().st_size < 10**6
    with pytest.raises(FileFormatError, match="would take 8000[0-9]* bytes"):
        outside.read_arrays(bomb, most_bytes=10**7)
    assert outside.read_arrays(bomb)["zeros"].shape == (10**7,)


def test_arrays_of_objects_are_never_unpickled(tmp_path):
    path = tmp_path / "objects.npz"
    np.savez(path, harmless=np.ones(2), objects=np.array([{"a": 1}, None], dtype=object))
    with pytest.raises(FileFormatError, match="objects.npz is no file of arrays"):
        outside.read_arrays(path)
    with zipfile.ZipFile(path, "w") as members:
        members.writestr("a.npy", b"not an array")
    with pytest.raises(FileFormatError, match="objects.npz is no file of arrays"):
        outside.read_arrays(path)


def test_a_packed_log_that_unpacks_to_far_more_is_refused(tmp_path):
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(b"0" * (100 * outside.BYTES_PER_MIB)))
    with pytest.raises(FileFormatError, match="unpacks to more than 700 times"):
        outside.repeatable_stream(path)
    path.write_bytes(gzip.compress(b"t_s,g1\n" + b"0.125,100.5\n" * 10**5))
    with outside.repeatable_stream(path) as stream:
        assert stream.read(6) == b"t_s,g1" and stream.seek(0) == 0


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no owners of files on this system")
@pytest.mark.parametrize("mode", [0o620, 0o602, 0o666])
def test_a_store_that_others_can_write_to_is_not_used(tmp_path, mode):
    path = tmp_path / "store.sqlite"
    outside.own_database(path, 1.0).close()
    assert path.stat().st_mode & 0o777 == 0o600
    path.chmod(mode)
    with pytest.raises(NotOwnError, match="others can write to .*store.sqlite"):
        outside.own_database(path, 1.0)


@pytest.mark.parametrize("host, family", [("0.0.0.0", socket.AF_INET), ("::", socket.AF_INET6)])
def test_nothing_listens_off_this_machine_without_a_key(host, family):
    with pytest.raises(InputError, match="needs a key"):
        outside.datagram_socket(family, (host, 0), keyed=False)


def test_it_listens_on_this_machine_without_a_key_and_elsewhere_with_one():
    for host, keyed in (("127.0.0.1", False), ("127.0.0.1", True), ("0.0.0.0", True)):
        with outside.datagram_socket(socket.AF_INET, (host, 0), keyed=keyed) as made:
            assert made.getsockname()[0] == host and not made.getblocking()


def test_a_message_beyond_its_bound_is_not_decoded():
    import msgspec

    decode = outside.message_decoder(list[int], most_bytes=4)
    assert decode(msgspec.msgpack.encode([1, 2, 3])) == [1, 2, 3]
    for data in (msgspec.msgpack.encode([1, 2, 3, 4]), msgspec.msgpack.encode("ab"), b"\xc1"):
        with pytest.raises(ValueError):
            decode(data)


@pytest.mark.parametrize(
    "read, most",
    [(outside.read_toml, 4 * 2**20), (outside.read_key, 4096), (outside.checked_file, 2**40)],
    ids=["design", "key", "log"],
)
def test_each_source_has_its_bound(tmp_path, read, most):
    path = tmp_path / "file"
    path.write_bytes(b"#" * min(most, 2**22))
    path.chmod(0o600)
    os.truncate(path, most)  # A large one is a hole
    read(path)
    with open(path, "ab") as file:
        file.write(b"#")
    with pytest.raises(FileFormatError, match=rf"{path} has .*\b({most}|{most + 1}) bytes"):
        read(path)
    with pytest.raises(FileAccessError, match=r"missing: No such file"):
        read(tmp_path / "missing")


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no rights of files on this system")
def test_a_key_is_for_its_user_alone(tmp_path):
    path = tmp_path / "key"
    path.write_bytes(b" \n0123 45\r\n")
    for mode in (0o640, 0o604, 0o610, 0o601):
        path.chmod(mode)
        with pytest.raises(NotOwnError, match="others can read or write .*chmod 600"):
            outside.read_key(path)
    path.chmod(0o600)
    assert outside.read_key(path) == b"0123 45" == outside.own_bytes(path, private=True).strip()
    for mode in (0o640, 0o604):
        path.chmod(mode)
        assert outside.own_bytes(path).strip() == b"0123 45", "others may read a store"
        with pytest.raises(NotOwnError, match="others can read"):
            outside.own_bytes(path, private=True)
    with pytest.raises(FileAccessError, match="it is not a regular file"):
        outside.checked_file(tmp_path)


def test_whole_numbers_have_as_many_digits_as_a_float():
    """400 in JSON; in TOML as many bits as 400 hexadecimal digits, in tables and lists, too."""
    assert outside.json_value("9" * 400, "n") == outside.toml(f"a = {'9' * 400}", "n")["a"] == 10**400 - 1
    assert outside.toml(f"a = [0x{'f' * 400}]", "n") == {"a": [16**400 - 1]}
    for text in ("9" * 401, f"[{'9' * 401}]"):
        with pytest.raises(FileFormatError, match=r"9{40}\.\.\. is too long for a number"):
            outside.json_value(text, "n")
    for text in (f"a = 0x1{'0' * 400}", f"[t]\na = 0x1{'0' * 400}", f"a = [1, 0x1{'0' * 400}]"):
        with pytest.raises(FileFormatError, match="a whole number is too long"):
            outside.toml(text, "n")


def test_half_a_letter_is_no_text_and_numbers_that_json_lacks_are_read_where_asked():
    assert outside.json_value(r'"\ud83d\ude00 \u00e9"', "n") == "\U0001f600 \xe9"
    for text in (r'"\ud83d"', rb'["\uDE00"]', r'{"\ud800": 1}'):
        with pytest.raises(FileFormatError, match="^n was cut short or is damaged: not valid JSON"):
            outside.json_value(text, "n")
    infinite, none = outside.json_value("[Infinity, NaN]", "n", finite=False)
    assert infinite == np.inf and np.isnan(none)
    with pytest.raises(FileFormatError, match="^n is not a map, or was cut short"):
        outside.json_value("{", "n", "map")


def test_a_long_path_is_shown_by_its_ends():
    middle = outside.PRINTED_PATH_LETTERS // 2
    text = "a" * middle + "b" * middle
    assert outside.shown(text) == text and outside.shown(f"{text}b") == f"{'a' * middle}...{'b' * middle}"
    assert outside.shown("a\nb\0") == r"a\nb\0" and outside.PRINTED_PATH_LETTERS < 500


@pytest.mark.parametrize("mib, refused", [(63, False), (65, True)])
def test_a_short_packed_log_may_have_64_MiB(tmp_path, mib, refused):
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(bytes(mib * outside.BYTES_PER_MIB - 2**19), 9))
    if refused:
        with pytest.raises(FileFormatError, match="unpacks to more than"):
            outside.repeatable_stream(path)
    else:
        outside.repeatable_stream(path).close()


def test_a_text_of_arrays_has_letters_alone(tmp_path):
    path, letters = tmp_path / "a.npz", np.array([0x10FFFF], np.uint32).view("U1")
    np.savez(path, name=letters, none=np.array([], "U3"))
    assert outside.read_arrays(path)["name"][0] == "\U0010ffff"
    np.savez(path, name=np.array([0x110000], np.uint32).view("U1"))
    with pytest.raises(FileFormatError, match=r"a.npz is no file of arrays .*a letter that is none"):
        outside.read_arrays(path)
    with pytest.raises(FileAccessError, match="cannot read .*missing.npz: No such file"):
        outside.read_arrays(tmp_path / "missing.npz")


@pytest.mark.parametrize("host, here", [("127.0.0.1", True), ("127.9.9.9", True), ("::1", True), ("fe80::1%lo", False),
                                        ("::1%lo", True), ("192.168.0.1", False)])  # fmt: skip
def test_this_machine_is_what_no_other_reaches(host, here):
    assert outside.is_this_machine((host, 80)) == here
