#!/usr/bin/env python3
"""How much of a bake is writing, and how near that comes to the disk.

    bake_rate.py SUNDER GRAPH [--frames A:B] [--repeats N]      (SUNDER: the built program)

Bakes the graph into a temporary folder of the present one's disk, then writes the very same bytes plainly (one write, fsync and rename
a file, as the bake promises for each) in the same run. Prints the least of the repeats of each, and the sums of what frames tell
of themselves: with one thread after the other the bake would take simulation + meshes + writing.
"""
import argparse
import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

_TIMES = re.compile(r"simulate ([\d.]+).*?other nodes ([\d.]+).*?write ([\d.]+)", re.S)


def plain_write(files, folder):
    begin = time.perf_counter()
    for name, data in files:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(str(path) + ".part", "wb", buffering=0) as file:
            file.write(data)
            os.fsync(file.fileno())
        os.replace(str(path) + ".part", path)
    return time.perf_counter() - begin


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("sunder")
    parser.add_argument("graph")
    parser.add_argument("--frames")
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    rows = []
    for _ in range(given.repeats):
        with tempfile.TemporaryDirectory(dir=".") as name:
            bake = Path(name) / "bake"
            command = [given.sunder, "bake", given.graph, "-o", str(bake)]
            command += ["--frames", given.frames] if given.frames else []
            begin = time.perf_counter()
            told = subprocess.run(command, check=True, capture_output=True, text=True)
            whole = time.perf_counter() - begin
            sums = [sum(map(float, column)) for column in zip(*_TIMES.findall(told.stdout + told.stderr))]
            files = [(str(p.relative_to(bake)), p.read_bytes()) for p in sorted(bake.rglob("*")) if p.is_file()]
            shutil.rmtree(bake)
            size = sum(len(data) for _, data in files)
            rows.append([whole, *sums, plain_write(files, Path(name) / "plain")])
    whole, simulate, meshes, write, plain = map(min, zip(*rows))
    print(f"bake {whole:.2f} s; simulation {simulate:.2f}, meshes {meshes:.2f}, writing {write:.2f} s "
          f"(sum {simulate + meshes + write:.2f}); {size / 1e6:.0f} MB")
    print(f"writing {size / write / 1e6:.0f} MB/s; the same bytes plainly {size / plain / 1e6:.0f} MB/s ({plain:.2f} s)")


if __name__ == "__main__":
    main()
