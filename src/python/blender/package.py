# SPDX-License-Identifier: MIT OR Apache-2.0
"""Makes the extension: python package.py PROGRAM OUTPUT.zip [DOCUMENT …]

The program goes inside, and the documents of its licences. The version is the program's. Needs no Blender.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
# What stays behind.
OWN = ("package.py", "test_")
PLATFORMS = {("linux", "x86_64"): "linux-x64", ("linux", "aarch64"): "linux-arm64", ("darwin", "arm64"): "macos-arm64",
             ("darwin", "x86_64"): "macos-x64", ("win32", "AMD64"): "windows-x64", ("win32", "ARM64"): "windows-arm64"}  # fmt: skip


def main(program: str, output: str, documents: list[str]) -> None:
    """Writes the zip. The same files give the same bytes."""
    here = PLATFORMS[sys.platform, platform.machine()]
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout.split()[1]
    with open(os.path.join(HERE, "blender_manifest.toml"), encoding="utf-8") as file:
        manifest = re.sub(r"(?m)^version = .*$", f'version = "{version}"\nplatforms = ["{here}"]', file.read())
    manifest = "".join(line for line in manifest.splitlines(keepends=True) if "package.py" not in line)
    with zipfile.ZipFile(output, "w", zipfile.ZIP_DEFLATED) as out:

        def put(name: str, data: bytes, mode: int = 0o644) -> None:
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.external_attr, entry.compress_type = mode << 16, zipfile.ZIP_DEFLATED
            out.writestr(entry, data)

        put("blender_manifest.toml", manifest.encode())
        for name in sorted(os.listdir(HERE)):
            if name.endswith(".py") and not name.startswith(OWN):
                with open(os.path.join(HERE, name), "rb") as file:
                    put(name, file.read())
        with open(program, "rb") as file:
            put("bin/" + ("rayfront.exe" if sys.platform == "win32" else "rayfront"), file.read(), 0o755)
        for document in documents:
            with open(document, "rb") as file:
                put("licences/" + os.path.basename(document), file.read())


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2], sys.argv[3:])
