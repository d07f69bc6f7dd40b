# SPDX-License-Identifier: MIT OR Apache-2.0
"""OpenEXR files: Blender's Python has no library for them.

Reads files of scan lines: plain, RLE (rayfront's), ZIPS or ZIP (Blender's). Writes plain ones.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

# The rows of a block, by the number of the compression.
ROWS = {0: 1, 1: 1, 2: 1, 3: 16}
TYPES = ("<u4", "<f2", "<f4")


def read(path: str) -> dict[str, np.ndarray]:
    """(height, width) for each channel, the top row first; numbers of half precision as float32."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:4] != b"\x76\x2f\x31\x01":
        raise ValueError(f"{path}: not an OpenEXR file")
    attributes, at = _attributes(data)
    channels = _channels(attributes["channels"])
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height, compression = x1 - x0 + 1, y1 - y0 + 1, attributes["compression"][0]
    if compression not in ROWS:
        raise ValueError(f"{path}: compressed in a way that is not read here ({compression})")
    rows = ROWS[compression]
    line = sum(np.dtype(kind).itemsize for _, kind in channels) * width
    lines = np.empty((height, line), np.uint8)
    for offset in struct.unpack_from(f"<{-(-height // rows)}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        block, first = data[offset + 8 : offset + 8 + size], y - y0
        count = min(rows, height - first)
        if size < line * count:
            block = _undone(_runs(block) if compression == 1 else zlib.decompress(block))
        lines[first : first + count] = np.frombuffer(block, np.uint8).reshape(count, line)
    planes, column = {}, 0
    for name, kind in channels:
        end = column + np.dtype(kind).itemsize * width
        plane = np.ascontiguousarray(lines[:, column:end]).view(kind)
        planes[name], column = plane.astype(np.float32) if kind == "<f2" else plane, end
    return planes


def _attributes(data: bytes) -> tuple[dict[str, bytes], int]:
    found, at = {}, 8
    while data[at]:
        name_end = data.index(b"\0", at)
        type_end = data.index(b"\0", name_end + 1)
        (size,) = struct.unpack_from("<i", data, type_end + 1)
        found[data[at:name_end].decode()] = data[type_end + 5 : type_end + 5 + size]
        at = type_end + 5 + size
    return found, at + 1


def _channels(raw: bytes) -> list[tuple[str, str]]:
    found, at = [], 0
    while raw[at]:
        end = raw.index(b"\0", at)
        (kind,) = struct.unpack_from("<i", raw, end + 1)
        found.append((raw[at:end].decode(), TYPES[kind]))
        at = end + 17
    return found


def _runs(block: bytes) -> bytes:
    out, at = [], 0
    while at < len(block):
        count = block[at]
        if count > 127:
            out.append(block[at + 1 : at + 257 - count])
            at += 257 - count
        else:
            out.append(block[at + 1 : at + 2] * (count + 1))
            at += 2
    return b"".join(out)


def _undone(block: bytes) -> bytes:
    """Without the differences between bytes and the division into even and odd ones."""
    flat = np.frombuffer(block, np.uint8).copy()
    flat[1:] -= 128
    flat = np.cumsum(flat, dtype=np.uint8)
    half = (len(flat) + 1) // 2
    woven = np.empty_like(flat)
    woven[0::2], woven[1::2] = flat[:half], flat[half:]
    return woven.tobytes()


def write(path: str, rgb: np.ndarray) -> None:
    """(height, width, 3), the top row first."""
    height, width, _ = rgb.shape
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(name + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    header = b"\x76\x2f\x31\x01\x02\0\0\0"
    for name, kind, value in (
        (b"channels", b"chlist", channels),
        (b"compression", b"compression", b"\0"),
        (b"dataWindow", b"box2i", window),
        (b"displayWindow", b"box2i", window),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        (b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    ):
        header += name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    line = np.dtype([("y", "<i4"), ("size", "<i4"), ("texels", "<f4", (3, width))])
    lines = np.empty(height, line)
    lines["y"], lines["size"] = np.arange(height), 12 * width
    lines["texels"] = rgb[..., ::-1].transpose(0, 2, 1)
    first = len(header) + 8 * height
    with open(path, "wb") as out:
        out.write(header + (first + line.itemsize * np.arange(height, dtype="<u8")).tobytes())
        out.write(lines.tobytes())
