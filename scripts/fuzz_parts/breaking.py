"""Bytes of a file, broken at random: anywhere, in its numbers, or below its packing."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import random
import struct
import zipfile
import zlib
from pathlib import Path

NUMBERS = (
    b"1e308",
    b"-1e308",
    b"nan",
    b"inf",
    b"1e-320",
    b"9" * 40,
    b"0",
    b"-1",
    b"",
    b"0x10",
    b"1,5",
    b"1e999999999",
    "٣".encode(),
)
WORDS = (
    0,
    1,
    2,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0xFFFF,
    0x7FFFFFFF,
    0xFFFFFFFF,
    2**63 - 1,
    2**64 - 1,
    2**31,
    2**40,
)


def broken(data: bytes, name: str, rng: random.Random) -> bytes:
    """The bytes of a file, broken."""
    if rng.random() < 0.35 and (inside := _inside(data, name, rng)) is not None:
        return inside
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8, 40))):
        out = _once(out, rng)
    return bytes(out)


def _inside(data: bytes, name: str, rng: random.Random) -> bytes | None:
    """Broken below the packing: the checksum of what is packed is right, what is packed is not."""
    kinds = {
        ".gz": (gzip.decompress, gzip.compress),
        ".bz2": (bz2.decompress, bz2.compress),
        ".xz": (lzma.decompress, lzma.compress),
    }
    ending = Path(name).suffix
    if ending in kinds:
        unpack, pack = kinds[ending]
        return pack(broken(unpack(data), Path(name).stem, rng))
    if ending == ".npz":
        source, out = zipfile.ZipFile(io.BytesIO(data)), io.BytesIO()
        with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as target:
            for entry in source.namelist():
                inner = source.read(entry)
                if rng.random() < 0.5:
                    head, rest = bytearray(inner[:128]), inner[128:]
                    inner = (
                        bytes(_once(head, rng)) + rest
                        if rng.random() < 0.6
                        else broken(inner, "", rng)
                    )
                target.writestr(entry if rng.random() < 0.95 else "../" + entry, inner)
        return out.getvalue()
    if name == "v5.mat":
        at, out = 128, bytearray(data[:128])
        while at + 8 <= len(data):
            kind, size = struct.unpack_from("<II", data, at)
            body = zlib.compress(
                bytes(_once(bytearray(zlib.decompress(data[at + 8 : at + 8 + size])), rng))
            )
            out += struct.pack("<II", kind, len(body)) + body
            at += 8 + size
        return bytes(out)
    return None


def _once(data: bytearray, rng: random.Random) -> bytearray:
    if not data:
        return data
    at, size = rng.randrange(len(data)), rng.choice((1, 1, 2, 4, 8, 16, 200, 5000))
    part = data[at : at + size]
    match rng.randrange(9):
        case 0:
            data[at] ^= 1 << rng.randrange(8)
        case 1:
            data[at : at + size] = rng.randbytes(len(part))
        case 2:
            return data[:at]
        case 3:
            del data[at : at + size]
        case 4:
            other = rng.randrange(len(data))
            data[other:other] = part * rng.choice((1, 1, 3))
        case 5:
            width = rng.choice((2, 4, 8))
            value = (rng.choice(WORDS) % 256**width).to_bytes(width, rng.choice(("little", "big")))
            data[at : at + width] = value
        case 6:
            data[at : at + size] = bytes(len(part))
        case 7:  # a number of a text
            places = [k for k in range(at, min(at + 300, len(data))) if chr(data[k]).isdigit()]
            start = places[0] if places else at
            stop = next(
                (
                    k
                    for k in range(start, min(start + 40, len(data)))
                    if chr(data[k]) not in "0123456789.eE+-"
                ),
                start + 1,
            )
            data[start:stop] = rng.choice(NUMBERS)
        case _:
            data[at:at] = rng.choice(
                (
                    b"\n",
                    b'"',
                    b",",
                    b"\0",
                    b"\r",
                    b"\xff\xfe",
                    b"  ",
                    b"<",
                    b"&a;",
                    b"- ",
                    b"{",
                    b"*a",
                    b"'",
                )
            )
    return data
