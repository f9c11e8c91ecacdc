"""Builds what the portable library is linked with, once for each list of sources and recipe, in ~/.cache/sunder/package.

    python3 build.py        builds it if it is not there, and prints the folder: prefix/ libc/ source/
"""
import fcntl
import hashlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import sources
from sources import Failed

HERE = Path(__file__).resolve().parent
PACKAGING = HERE.parent
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "sunder/package"
COMPILER = 12
TOOLCHAIN = PACKAGING / "linux-x64.cmake"
RECIPES = [sources.LIST, TOOLCHAIN, *(HERE / name for name in ("CMakeLists.txt", "no_documentation.mk", "sources.py"))]


def build():
    """The folder with everything. Raises Failed."""
    compiler = subprocess.run(["g++", "--version"], text=True, capture_output=True).stdout.split("\n")[0]
    if not re.search(rf" {COMPILER}\.\d+\.\d+$", compiler):
        raise Failed(f"the portable package is made by g++ {COMPILER}, on Debian 12, and this is {compiler or 'none'}: the runtime of "
                     "another asks for more of a C library than glibc_2_28.c has")
    key = hashlib.sha256(b"".join(file.read_bytes() for file in RECIPES) + compiler.encode()).hexdigest()[:12]
    folder = CACHE / key
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / ".lock", "w") as lock:  # two at once: the second waits
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / ".ready").exists():
            _build(folder)
            (folder / ".ready").touch()
    return folder


def _build(folder):
    print(f"sunder: building what the package is linked with, in {folder} (about 15 minutes of one processor, once)",
          file=sys.stderr, flush=True)
    files = sources.fetch(CACHE / "files")
    for name in files:
        sources.unpack(files, name, folder / ("libc" if name == "libc" else f"source/{name}"))
    for name in ("build", "prefix"):
        shutil.rmtree(folder / name, ignore_errors=True)
    configure = ["cmake", "-S", HERE, "-B", folder / "build", "-G", "Ninja", f"-DSOURCES={folder / 'source'}",
                 f"-DCMAKE_INSTALL_PREFIX={folder / 'prefix'}", f"-DCMAKE_TOOLCHAIN_FILE={TOOLCHAIN}"]
    log = folder / "build.log"
    with open(log, "w") as out:
        for words in (configure, ["ninja", "-C", folder / "build", "-j1"]):  # each of its steps uses all processors
            done = subprocess.run([str(w) for w in words], stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT)
            if done.returncode:
                raise Failed(f"a library to link with could not be built; {log} ends with:\n{log.read_text()[-2000:]}")
    shutil.rmtree(folder / "build")


if __name__ == "__main__":
    try:
        print(build())
    except Failed as error:
        sys.exit(f"sunder: error: {error}")
