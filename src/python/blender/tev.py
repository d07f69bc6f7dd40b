# SPDX-License-Identifier: MIT OR Apache-2.0
"""The picture so far, as `rayfront --tev` sends it. Without threads: Blender does not support those of Python."""

from __future__ import annotations

import select
import socket
import struct
import time

import numpy as np

CREATE, UPDATE = 4, 6


class Viewer:
    """Listens on a port of this computer. `picture` is (height, width, 3), the top row first, or None at first."""

    def __init__(self) -> None:
        self.server = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.server.getsockname()[1]}"
        self.link: socket.socket | None = None
        self.pending = bytearray()
        self.picture: np.ndarray | None = None
        self.changes = 0

    def poll(self, seconds: float) -> None:
        """Takes in what comes, for so long."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            if not select.select([self.link or self.server], [], [], left)[0]:
                return
            if not self.link:
                self.link, _ = self.server.accept()
                continue
            data = self.link.recv(1 << 20)
            if not data:  # The program has closed it, and is about to end.
                time.sleep(min(left, 0.01))
                return
            self.pending += data
            self._take()

    def close(self) -> None:
        for end in (self.link, self.server):
            if end:
                end.close()

    def _take(self) -> None:
        while len(self.pending) >= 4:
            (size,) = struct.unpack_from("<I", self.pending)
            if len(self.pending) < size:
                return
            self._packet(bytes(self.pending[4:size]))
            del self.pending[:size]

    def _packet(self, body: bytes) -> None:
        at = body.index(b"\0", 2) + 1  # After the kind, a flag and the picture's name.
        if body[0] == CREATE:
            width, height = struct.unpack_from("<II", body, at)
            self.picture = np.zeros((height, width, 3), np.float32)
        elif body[0] == UPDATE and self.picture is not None:
            (channels,) = struct.unpack_from("<I", body, at)
            at += 4
            for _ in range(channels):
                at = body.index(b"\0", at) + 1
            x, y, width, height = struct.unpack_from("<4I", body, at)
            at += 16 + 16 * channels
            tile = np.frombuffer(body, "<f4", width * height * channels, at).reshape(height, width, channels)
            self.picture[y : y + height, x : x + width] = tile[..., :3]
            self.changes += 1
