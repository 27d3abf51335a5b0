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
    """`count` damaged copies of content."""
    for _ in range(count):
        damaged = bytearray(content)
        for _ in range(rng.randint(1, FEW)):
            _damage(rng, damaged, rng.choice(("flip", "cut", "repeat", "insert", "move", "truncate", "renumber")))
        yield bytes(damaged)


def _piece(rng: random.Random, content: bytearray) -> slice:
    """A place of a short piece."""
    start = rng.randint(0, len(content))
    return slice(start, min(len(content), start + rng.randint(1, PIECE_BYTES)))


def _damage(rng: random.Random, content: bytearray, kind: str) -> None:
    if kind == "flip" and content:
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    elif kind == "cut":
        del content[_piece(rng, content)]
    elif kind == "repeat":
        place = _piece(rng, content)
        content[place.start : place.start] = content[place] * rng.choice((1, 2, 100))
    elif kind == "insert":
        start = rng.randint(0, len(content))
        content[start:start] = rng.choice((*ODD, rng.randbytes(PIECE_BYTES)))
    elif kind == "move":
        content[_piece(rng, content)] = content[_piece(rng, content)]
    elif kind == "truncate" and rng.random() < 0.3:
        del content[rng.randint(0, len(content)) :]
    elif kind == "renumber":  # A digit, or a length field of four bytes
        digits = [at for at, byte in enumerate(content) if 48 <= byte <= 57]
        if digits and rng.random() < 0.5:
            at = rng.choice(digits)
            content[at : at + 1] = rng.choice((b"-1", b"0", b"1e308", b"9" * 12, b"0.5", b"nan"))
        elif len(content) >= 4:
            at, number = rng.randrange(len(content) - 3), rng.choice((0, 1, 2**16, 2**31 - 1, 2**32 - 1))
            content[at : at + 4] = number.to_bytes(4, rng.choice(("little", "big")))
