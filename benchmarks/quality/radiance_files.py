"""Radiance in files, without any library: what sky_table.py needs to make photographs of the data sets' images.

Half and float EXR by scan lines (not compressed, RLE, ZIPS, ZIP), 8-bit PNG, Radiance HDR (new run lengths).
"""

import array
import math
import struct
import zlib


def _unpacked(data, size, compression):
    """One block of an EXR file as it was before its predictor and interleaving."""
    if compression == 0 or len(data) >= size: return data
    if compression == 1:
        out, at = bytearray(), 0
        while at < len(data):
            count = data[at] - 256 if data[at] > 127 else data[at]
            out += data[at + 1:at + 1 - count] if count < 0 else bytes([data[at + 1]]) * (count + 1)
            at += 1 - count if count < 0 else 2
    else:
        out = bytearray(zlib.decompress(data))
    for i in range(1, len(out)): out[i] = (out[i - 1] + out[i] - 128) & 255
    half = (len(out) + 1) // 2
    apart = bytearray(len(out))
    apart[0::2], apart[1::2] = out[:half], out[half:]
    return bytes(apart)


def read_exr(path):
    """Width, height, and the rows of each channel by its name."""
    data = path.read_bytes()
    if data[:4] != b"\x76\x2f\x31\x01": raise ValueError(f"{path}: no EXR file")
    at, header = 8, {}
    while data[at]:
        end = data.index(0, at)
        name, at = data[at:end].decode(), data.index(0, end + 1) + 1
        size, = struct.unpack_from("<i", data, at)
        header[name], at = data[at + 4:at + 4 + size], at + 4 + size
    compression = header["compression"][0]
    if compression > 3: raise ValueError(f"{path}: compression {compression} is not read here")
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
    width, height, channels, where = x1 - x0 + 1, y1 - y0 + 1, [], 0
    while header["channels"][where]:
        end = header["channels"].index(0, where)
        channels.append((header["channels"][where:end].decode(), *struct.unpack_from("<i", header["channels"], end + 1)))
        where = end + 17
    lines = 16 if compression == 3 else 1
    line_bytes = width * sum(2 if kind == 1 else 4 for _, kind in channels)
    rows = {name: [None] * height for name, _ in channels}
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at + 1):
        y, size = struct.unpack_from("<ii", data, offset)
        count = min(lines, height - (y - y0))
        block = _unpacked(data[offset + 8:offset + 8 + size], count * line_bytes, compression)
        where = 0
        for row in range(y - y0, y - y0 + count):
            for name, kind in channels:
                rows[name][row] = struct.unpack_from(f"<{width}{'e' if kind == 1 else 'f'}", block, where)
                where += width * (2 if kind == 1 else 4)
    return width, height, rows


def write_png(path, width, height, rows):
    """8-bit RGB; a row is 3 x width bytes."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    raw = b"".join(b"\0" + bytes(row) for row in rows)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(raw, 3)) + chunk(b"IEND", b""))


class Photograph:
    """Linear values to sRGB bytes that end at white."""

    STEPS = 1 << 16

    def __init__(self):
        encode = lambda v: 12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055
        self.bytes = bytes(round(255 * encode(i / self.STEPS)) for i in range(self.STEPS + 1))

    def write(self, path, width, height, rows, gain):
        scale, top = gain * self.STEPS, self.STEPS
        out = []
        for y in range(height):
            line = bytearray(3 * width)
            for c, name in enumerate("RGB"):
                line[c::3] = bytes([self.bytes[min(top, max(0, int(v * scale)))] for v in rows[name][y]])
            out.append(line)
        write_png(path, width, height, out)


def read_hdr(path):
    """Width, height, and for every row the bytes of mantissas and exponents: four arrays."""
    data = path.read_bytes()
    at = data.index(b"\n\n") + 2
    end = data.index(b"\n", at)
    _, height, _, width = data[at:end].split()
    height, width, at, rows = int(height), int(width), end + 1, []
    for _ in range(height):
        if data[at:at + 2] != b"\2\2":
            rows.append([bytearray(data[at + c:at + 4 * width:4]) for c in range(4)])
            at += 4 * width
            continue
        at, line = at + 4, []
        for _ in range(4):
            channel = bytearray()
            while len(channel) < width:
                count = data[at]
                if count > 128:
                    channel += bytes([data[at + 1]]) * (count - 128)
                    at += 2
                else:
                    channel += data[at + 1:at + 1 + count]
                    at += 1 + count
            line.append(channel)
        rows.append(line)
    return width, height, rows


def values_of_hdr(rows):
    """Rows of red, green and blue."""
    scales = [math.ldexp(1, e - 136) if e else 0.0 for e in range(256)]
    return [[array.array("d", (m * scales[e] for m, e in zip(line[c], line[3]))) for c in range(3)] for line in rows]


def write_hdr(path, width, values):
    """Not compressed."""
    out = bytearray(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (len(values), width))
    for red, green, blue in values:
        for rgb in zip(red, green, blue):
            mantissa, exponent = math.frexp(max(rgb))
            scale = 0 if max(rgb) < 1e-32 else mantissa * 256 / max(rgb)
            out += bytes([min(255, int(v * scale)) for v in rgb] + [exponent + 128 if scale else 0])
    path.write_bytes(out)
