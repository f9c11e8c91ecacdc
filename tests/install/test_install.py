"""What `cmake --install` lays down is found and used by another's project, also from where it was moved to; the sources do as a
part of one; and cpack's package of Debian asks for what it needs."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CLIENT = Path(__file__).resolve().parent / "client"
ROOT = CLIENT.parents[2]
BUILD, VERSION, CMAKE = Path(os.environ["SUNDER_BUILD"]), os.environ["SUNDER_VERSION"], os.environ["CMAKE"]
MAJOR, MINOR, _ = map(int, VERSION.split("."))


def run(*words, cwd=None, may_fail=False, **environment):
    done = subprocess.run([str(w) for w in words], cwd=cwd, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, env={**os.environ, **environment})
    if (done.returncode != 0) != may_fail:
        raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}")
    return done.stdout


class Folder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        made = tempfile.TemporaryDirectory()
        cls.addClassCleanup(made.cleanup)
        cls.home = Path(made.name)

    @classmethod
    def configure(cls, name, **variables):
        """What CMake says of the client, configured in a folder."""
        may_fail = variables.pop("may_fail", False)
        given = [f"-D{key}={value}" for key, value in variables.items()]
        return run(CMAKE, "-S", CLIENT, "-B", cls.home / name, "-G", "Ninja", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", *given,
                   may_fail=may_fail)


class Installed(Folder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        run(CMAKE, "--install", BUILD, "--strip", "--prefix", cls.home / "first")
        cls.prefix = (cls.home / "first").rename(cls.home / "moved")  # nothing may remember where it was laid

    def test_another_project_finds_links_and_runs_it(self):
        self.configure("client", SUNDER_WANTED=f"{MAJOR}.{MINOR}", CMAKE_PREFIX_PATH=self.prefix)
        run(CMAKE, "--build", self.home / "client")
        self.assertEqual(run(self.home / "client/client_c"), f"{VERSION} friction 0.25\n")
        self.assertEqual(run(self.home / "client/client_cpp"), f"{VERSION} particles 16\n")
        needed = run("readelf", "-d", self.home / "client/client_c")
        self.assertIn(f"[libsunder.so.{MAJOR}.{MINOR}]", needed)
        self.assertNotIn("libassimp", needed)

    def test_another_version_is_refused_by_name(self):
        for wanted in (f"{MAJOR}.{MINOR + 1}", f"{MAJOR + 1}", f"{MAJOR}.{MINOR - 1}"):
            told = self.configure("client", SUNDER_WANTED=wanted, CMAKE_PREFIX_PATH=self.prefix, may_fail=True)
            told = " ".join(told.split())
            self.assertIn(f'compatible with requested version "{wanted}"', told)
            self.assertRegex(told, rf"moved/lib\S*/cmake/Sunder/SunderConfig.cmake, version: {re.escape(VERSION)}")

    def test_the_program_and_the_python_package_run(self):
        self.assertEqual(run(self.prefix / "bin/sunder", "--version"), f"sunder {VERSION}\n")
        script = "import sunder; print(sunder.version(), sunder.__file__)"
        package = self.prefix / "lib/python3/dist-packages"
        told = run(sys.executable, "-B", "-c", script, PYTHONPATH=str(package), SUNDER_LIBRARY="")
        self.assertEqual(told, f"{VERSION} {package}/sunder/__init__.py\n")

    def test_the_python_package_brings_its_types(self):
        package = self.prefix / "lib/python3/dist-packages/sunder"
        for name in ("py.typed", "_nodes.pyi"):
            self.assertEqual((package / name).read_bytes(), (ROOT / "plugin_src/python/sunder" / name).read_bytes())

    def test_no_file_remembers_a_folder(self):
        for path in self.prefix.rglob("*"):
            if path.is_symlink():
                self.assertTrue(path.exists() and not os.path.isabs(os.readlink(path)), path)
            elif path.is_file():
                for folder in (self.home, BUILD):
                    self.assertNotIn(str(folder).encode(), path.read_bytes(), path)


class APart(Folder):
    def test_of_another_project_it_is_the_library_and_the_program_alone(self):
        self.configure("whole", SUNDER_SOURCE=ROOT)
        targets = run("ninja", "-C", self.home / "whole", "-t", "targets", "all")
        self.assertIn("client_cpp:", targets)
        for of_ours in ("test_solver", "sunder_bench", "sunder_addon"):
            self.assertNotIn(of_ours, targets)
        self.assertIn("libsunder.so", run("ninja", "-C", self.home / "whole", "-n", "client_c"))
        self.assertIn("Total Tests: 0", run("ctest", "--test-dir", self.home / "whole", "-N"))
        self.assertEqual(list((self.home / "whole/sunder").glob("CPack*")), [])
        for entry in json.loads((self.home / "whole/compile_commands.json").read_text()):
            self.assertNotIn("-Wall", entry["command"])


class OfDebian(Folder):
    def test_the_package_asks_for_what_it_needs(self):
        run("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", self.home, "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=none")
        package, = self.home.glob(f"sunder_{VERSION}_*.deb")
        asked = run("dpkg-deb", "--field", package, "Depends")
        for name in ("libc6", "libstdc++6", "libassimp", "libopenvdb", "libtbb", "libgmp", "libmpfr", "libzstd"):
            self.assertRegex(asked, rf"\b{re.escape(name)}\S* \(>= ")
        held = run("dpkg-deb", "--contents", package)
        for file in ("bin/sunder", f"libsunder.so.{MAJOR}.{MINOR}", "include/sunder.h", "SunderConfig.cmake", "doc/sunder/copyright"):
            self.assertRegex(held, rf"\./usr/(\S*/)?{re.escape(file)}( ->.*)?\n")


if __name__ == "__main__":
    unittest.main()
