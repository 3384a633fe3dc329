"""LZF, by which `.pcd` files are compressed."""

from .problem import Problem


def decompressed(data: memoryview, length: int) -> bytearray:
    """So many bytes of compressed data."""
    made = bytearray()
    at, end = 0, len(data)
    try:
        while at < end:
            control = data[at]
            at += 1
            if control < 32:
                behind = at + control + 1
                made += data[at:behind]
                # Of a run that is cut off there is no last byte.
                data[behind - 1]
                at = behind
                continue
            count = control >> 5
            if count == 7:
                count += data[at]
                at += 1
            count += 2
            offset = ((control & 31) << 8) + data[at] + 1
            at += 1
            begin = len(made) - offset
            if begin < 0:
                raise Problem(f"LZF: {offset} bytes back from byte {len(made)}")
            piece = made[begin : begin + count]
            # What repeats itself is longer than what is there of it.
            made += piece if len(piece) == count else (piece * (count // len(piece) + 1))[:count]
            if len(made) > length:
                break
    except IndexError:
        raise Problem("LZF: the compressed data ends within a run") from None
    if len(made) != length:
        raise Problem(f"LZF: the compressed data becomes {'more' if len(made) > length else len(made)} bytes, not {length}")
    return made
