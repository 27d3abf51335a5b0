"""Damaged copies of valid content, to fuzz readers with."""

import random
from collections.abc import Iterator

FEW = 8
"""Largest number of damages in one copy."""
PIECE_BYTES = 64
"""Longest piece that is inserted, moved or repeated."""
ODD = (
    b"", b"\0", b"\n", b"\r", b"\r\n", b'"', b"'", b"'''", b"\\", b"[", b"]", b"{", b"}", b"=", b"#", b",", b";", b"\t",
    b"\x1b[2J", b"\x7f", b"\xff\xfe", b"\xef\xbb\xbf", b"\xed\xa0\x80", "é\u2028\u202e".encode(), b"nan", b"inf",
    b"-inf", b"-1", b"0", b"1e999", b"1e-999", b"9" * 30, b"9" * 5000, b"true", b"null", b"\xff" * 8, b"\0" * 8,
    b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"[" * 300, b"x" * 3000, b"\n\n[map]\n", b"1e3\xc2\xb5",
)  # fmt: skip
"""Pieces that readers are known to trip over."""


def mutations(rng: random.Random, content: bytes, count: int) -> Iterator[bytes]:
    """`count` damaged copies of content: bytes flipped, pieces cut, repeated, inserted, moved, or the end missing."""
    damages = (_flip, _cut, _repeat, _insert, _splice, _truncate, _renumber)
    for _ in range(count):
        damaged = bytearray(content)
        for _ in range(rng.randint(1, FEW)):
            rng.choice(damages)(rng, damaged)
        yield bytes(damaged)


def _piece(rng: random.Random, content: bytearray) -> slice:
    """A place of a short piece."""
    start = rng.randint(0, len(content))
    return slice(start, min(len(content), start + rng.randint(1, PIECE_BYTES)))


def _flip(rng: random.Random, content: bytearray) -> None:
    if content:
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)


def _cut(rng: random.Random, content: bytearray) -> None:
    del content[_piece(rng, content)]


def _repeat(rng: random.Random, content: bytearray) -> None:
    place = _piece(rng, content)
    content[place.start : place.start] = content[place] * rng.choice((1, 2, 100))


def _insert(rng: random.Random, content: bytearray) -> None:
    start = rng.randint(0, len(content))
    content[start:start] = rng.choice((*ODD, rng.randbytes(PIECE_BYTES)))


def _splice(rng: random.Random, content: bytearray) -> None:
    """A piece over another place."""
    content[_piece(rng, content)] = content[_piece(rng, content)]


def _truncate(rng: random.Random, content: bytearray) -> None:
    if rng.random() < 0.3:
        del content[rng.randint(0, len(content)) :]


def _renumber(rng: random.Random, content: bytearray) -> None:
    """Another number, or a length field of four bytes, in place of a digit or of four bytes."""
    digits = [at for at, byte in enumerate(content) if 48 <= byte <= 57]
    if digits and rng.random() < 0.5:
        at = rng.choice(digits)
        content[at : at + 1] = rng.choice((b"-1", b"0", b"1e308", b"9" * 12, b"0.5", b"nan"))
    elif len(content) >= 4:
        at = rng.randrange(len(content) - 3)
        content[at : at + 4] = rng.choice((0, 1, 2**16, 2**31 - 1, 2**32 - 1)).to_bytes(
            4, rng.choice(("little", "big"))
        )
