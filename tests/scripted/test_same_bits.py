"""One library gives the same states and meshes on every processor: whatever instructions its kernels use, and whatever
libm has. libm's own choice is changed by glibc's tunables, as a processor without fused multiply-add and AVX2 would."""
import hashlib
import itertools
import os
import re
import subprocess
import sys
from pathlib import Path

from conftest import contents, run_program

ROOT = Path(__file__).resolve().parents[2]
PLAIN_LIBM = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2"}
MACHINES = [{**libm, **kernels} for libm, kernels in itertools.product(
    ({}, PLAIN_LIBM), ({}, {"SUNDER_INSTRUCTIONS": "avx2"}, {"SUNDER_INSTRUCTIONS": "portable"}))]


def on(machine):
    return {**{k: v for k, v in os.environ.items() if k != "SUNDER_INSTRUCTIONS"}, **machine}


def bake(graph, folder, machine, *options):
    """Hashes of the state and mesh files."""
    run = run_program("bake", graph, "-o", folder, *options, env=on(machine))
    assert run.status == 0, run.err
    return {name: hashlib.sha256(data).hexdigest() for name, data in contents(folder).items() if name != "manifest.json"}


def expect_same_bits(graph, tmp_path, n_files, *options):
    first, *others = (bake(graph, tmp_path / str(i), machine, *options) for i, machine in enumerate(MACHINES))
    assert sum(name.endswith(".ply") for name in first) == n_files
    for machine, other in zip(MACHINES[1:], others):
        assert other.keys() == first.keys()
        differing = sorted(name for name in first if other[name] != first[name])
        assert not differing, f"{machine}: {len(differing)} of {len(first)} files differ, the first is {differing[0]}"


def test_the_tunables_change_what_libm_does():
    """Otherwise the tests below compare a thing with itself, as they do where a processor leaves libm no choice."""
    flags = re.search(r"^flags\s*:(.*)$", Path("/proc/cpuinfo").read_text(), re.M)[1].split()
    script = "import math; print([f(0.0137 * i).hex() for i in range(1, 20000) for f in (math.sin, math.exp, math.log)])"
    results = [subprocess.run([sys.executable, "-c", script], env=on(libm), check=True, capture_output=True).stdout
               for libm in ({}, PLAIN_LIBM)]
    assert (results[0] != results[1]) == ("fma" in flags and "avx2" in flags)


def test_the_first_graph_of_the_readme(tmp_path):
    graph, = (block for block in re.findall(r"```json\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
              if '"sunder": 2' in block)
    (tmp_path / "beam.json").write_text(graph)
    expect_same_bits(tmp_path / "beam.json", tmp_path, 2 * 36)


def test_the_first_second_of_the_demo(tmp_path):
    expect_same_bits(ROOT / "tests/scenes/demo.json", tmp_path, 3 * 24, "--frames", "1:24")
