"""Sunder built from its sources in a root of another Debian, with the libraries and compilers there (hosts.SOURCE_ROOTS).

What is built stays: a build that was stopped goes on, and ccache keeps what an older one compiled.
"""
import hashlib
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import hosts

# Folders of tests that run there, with arguments of ctest: Blender, speed and long runs are others' matters.
TESTED = {"solver": [], "fracture_tools": [], "nodes": [], "plugin_src": ["-R", "^c_api"], "install": []}
LIBRARIES = {"CGAL": "libcgal-dev", "Eigen": "libeigen3-dev", "assimp": "libassimp-dev", "OpenVDB": "libopenvdb-dev", "glibc": "libc6-dev"}


class Failed(Exception):
    """A step of the build; its output was shown."""


class SourceBuild:
    """host: one of hosts.SOURCE_ROOTS, made ready; folder: the build's, in the checkout."""

    def __init__(self, host, folder):
        self.host, self.folder = host, folder

    def within(self, **environment):
        """The words that run others there, with nothing of this system's environment."""
        c, cxx = self.host.compilers
        given = {"HOME": "/root", "PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "CC": c, "CXX": cxx, "CCACHE_NOHASHDIR": "1",
                 "CCACHE_BASEDIR": hosts.REPOSITORY, "CCACHE_DIR": hosts.CACHE / f"{self.host.name}-ccache", **environment}
        return self.host.inside("env", "-i", *(f"{name}={value}" for name, value in given.items()))

    def make(self):
        """Builds everything; raises Failed."""
        self._step("configuring", "cmake", "-S", hosts.REPOSITORY, "-B", self.folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                   "-DSUNDER_TESTS=ON", "-DCMAKE_COMPILE_WARNING_AS_ERROR=ON", "-DPython3_EXECUTABLE=/usr/bin/python3",
                   *self.host.options)
        self._step("building", "nice", "ninja", "-C", self.folder, "-j", os.cpu_count())

    def versions(self):
        """What it was built with, and what README's first graph came out as."""
        c_plus_plus = self.host.compilers[1]
        compiler = re.search(r"\d+\.\d+\.\d+", self._output(c_plus_plus, "--version"))[0]
        told = self._output("dpkg-query", "-W", "-f", "${Package} ${Version}\n", *LIBRARIES.values())
        versions = dict(line.split() for line in told.splitlines())
        libraries = ", ".join(f"{name} {re.split('[-+~]', versions[package])[0]}" for name, package in LIBRARIES.items())
        return f"{c_plus_plus} {compiler}, {libraries}; beam.json {self.beam_hash()}"

    def beam_hash(self):
        """One number of all states and meshes."""
        beam, = (block for block in re.findall(r"```json\n(.*?)```", (hosts.REPOSITORY / "README.md").read_text(), re.S)
                 if '"sunder": 2' in block)
        with tempfile.TemporaryDirectory() as folder:  # /tmp is the same in every root
            graph = Path(folder, "beam.json")
            graph.write_text(beam)
            script = hosts.REPOSITORY / "tests/packaging/bake_hashes.py"
            told = self._output("/usr/bin/python3", "-B", script, graph, Path(folder, "bake"), 36,
                                SUNDER_LIBRARY=self.folder / "plugin_src/libsunder.so",
                                PYTHONPATH=hosts.REPOSITORY / "plugin_src/python")
        return hashlib.sha256(told.encode()).hexdigest()[:12]

    def _step(self, name, *words):
        if subprocess.run([*self.within(), *map(str, words)], stdin=subprocess.DEVNULL, stdout=sys.stderr).returncode:
            raise Failed(f"{name} in the root of Debian {self.host.root}")

    def _output(self, *words, **environment):
        done = subprocess.run([*self.within(**environment), *map(str, words)], text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
        if done.returncode:
            raise Failed(f"{words[0]} in the root of Debian {self.host.root}")
        return done.stdout
