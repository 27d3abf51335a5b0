"""What comes from outside: bounds, types, owners, and one line for each fault."""

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
    import gzip

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
