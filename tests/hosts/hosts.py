"""Blenders that the add-on is tested in: where each comes from, how it is made ready, how it is started.

    python3 hosts.py prepare HOST     makes it ready (in the cache, kept between runs) and prints the words that start it
    python3 hosts.py prepare readers  makes ready what reads their exports back, and prints its interpreter

A host is Debian's own Blender, here or in a root of another Debian made by debootstrap, or an official build: the wheel `bpy`
in a virtual environment. What is made lies below $XDG_CACHE_HOME/sunder/hosts (default: ~/.cache); a root is made and used
by root alone.
"""
import fcntl
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "sunder/hosts"
PYTHON = "/usr/bin/python3"  # Debian's: another may come first on PATH
# What the wheels of `bpy` expect of the system.
MODULE_PACKAGES = ["libegl1", "libgl1", "libgl1-mesa-dri", "libgomp1", "libice6", "libsm6", "libx11-6", "libxext6", "libxfixes3",
                   "libxi6", "libxkbcommon0", "libxrender1", "libxxf86vm1"]
# What the tests run beside Blender.
TOOL_PACKAGES = ["fonts-dejavu-core", "imagemagick", "python3-numpy", "xdotool"]
# What Debian's Blender 5.2 needs to start without a traceback of its own, and does not ask for.
LACKING_PACKAGES = ["python3-cattr", "python3-requests"]
# What reads exports back: libraries of the formats' own makers, bound to Python. The folder's name changes with them.
READER_PACKAGES = ["usd-core==26.11", "alembic3d==1.8.12.1", "numpy<3"]
READERS = CACHE / "readers-26.11-1.8.12"


class Unavailable(Exception):
    """A host cannot be had here; the sentence says why."""


class Host:
    """name: as `--blender` takes it; sentence: what it is. root: suite of Debian that it runs in, None for this system;
    wheel: version of `bpy`, None for Debian's package of Blender; packages: what the root has, Blender with all that the tests
    want unless told; at: the root's name in the cache, the suite's unless told."""

    def __init__(self, name, sentence, root=None, wheel=None, packages=None, at=None):
        self.name, self.sentence, self.root, self.wheel, self.packages = name, sentence, root, wheel, packages
        self.folder = CACHE / (at or root) if root else None

    @property
    def environment(self):
        return CACHE / f"bpy-{self.wheel}" if self.wheel else None

    def command(self):
        """The words that start it; Blender's arguments follow. Needs `prepare`."""
        words = []
        if self.root:
            words += self.inside()
        if self.wheel:
            return words + [str(self.environment / "bin/python"), str(HERE / "blender_module.py")]
        return words + ["blender"]

    def has_window(self):
        return not self.wheel

    def prepare(self):
        """Makes it ready; raises Unavailable."""
        CACHE.mkdir(parents=True, exist_ok=True)
        if self.root:
            self.prepare_root()
        elif self.wheel:
            install_here(["python3-pip", *MODULE_PACKAGES])
        if self.wheel:
            self._make_environment()

    def versions(self):
        """{part: version} of Blender, Python, numpy and the C library, as they are."""
        script = ("import bpy, json, sys, numpy, platform; print('VERSIONS', json.dumps({'blender': bpy.app.version_string, "
                  "'python': platform.python_version(), 'numpy': numpy.__version__, 'libc': platform.libc_ver()[1]}))")
        done = subprocess.run([*self.command(), "-b", "--factory-startup", "--python-expr", script], text=True,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=120)
        for line in done.stdout.splitlines():
            if line.startswith("VERSIONS "):
                return json.loads(line[9:])
        raise Unavailable(f"Blender {self.name} does not start: {done.stdout.strip()[-400:]}")

    def inside(self, *words):
        """The words that run others in the root."""
        return [str(HERE / "in_root.sh"), str(self.folder), *map(str, words)]

    def prepare_root(self):
        """Makes the root alone ready; raises Unavailable."""
        CACHE.mkdir(parents=True, exist_ok=True)
        if os.geteuid() != 0:
            raise Unavailable(f"a root of Debian {self.root} is made and entered by root alone")
        wanted = self.packages or [*TOOL_PACKAGES, *LACKING_PACKAGES, *MODULE_PACKAGES, "python3", "python3-pip", "blender"]
        stamp = self.folder / ".sunder_packages"
        has_others = stamp.exists() and stamp.read_text().split("\n")[0] != " ".join(wanted)
        if has_others or not (self.folder / ".debootstrapped").exists():
            install_here(["debootstrap"])
            shutil.rmtree(self.folder, ignore_errors=True)
            _run(["debootstrap", "--variant=minbase", self.root, str(self.folder), _mirror()], f"debootstrap of {self.root}")
            (self.folder / ".debootstrapped").touch()
        for file in ("etc/resolv.conf", "etc/ssl/certs/ca-certificates.crt"):  # how the network is reached, and whom it trusts
            if Path("/", file).exists():
                (self.folder / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(Path("/", file), self.folder / file)
        if stamp.exists():
            return
        # A mirror's copy of sid may be older than its lists say that they last.
        self._inside(["apt-get", "-qq", "-o", "Acquire::Check-Valid-Until=false", "update"])
        there = [p for p in wanted if self._inside(["apt-cache", "show", p], may_fail=True)]
        self._inside(["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq", "install", "-y", "--no-install-recommends", *there])
        stamp.write_text(" ".join(wanted) + "\n")

    def _make_environment(self):
        _make_environment(self.environment, [f"bpy=={self.wheel}"], self._inside if self.root else _run_here)

    def _inside(self, words, may_fail=False):
        """Output of a command in the root; "" for one that may fail and did."""
        command = self.inside(*words)
        if may_fail:
            done = subprocess.run(command, text=True, stdin=subprocess.DEVNULL, capture_output=True)
            return done.stdout if done.returncode == 0 else ""
        return _run(command, f"{' '.join(words[:4])} in the root of {self.root}")


def _make_environment(folder, packages, within):
    """A virtual environment of packages; `within` runs a command where it is to be used."""
    if (folder / ".ready").exists():
        return
    shutil.rmtree(folder, ignore_errors=True)
    within([PYTHON, "-m", "venv", "--without-pip", str(folder)])
    within([PYTHON, "-m", "pip", "--python", str(folder / "bin/python"), "install", "-q", "--disable-pip-version-check",
            *packages])
    (folder / ".ready").touch()


def prepare_readers():
    """The interpreter of a Python that reads USD and Alembic: what Blender wrote shall be read back by another. Raises
    Unavailable."""
    CACHE.mkdir(parents=True, exist_ok=True)
    with open(CACHE / "readers.lock", "w") as lock:  # two tests at once: the second waits
        fcntl.flock(lock, fcntl.LOCK_EX)
        install_here(["python3-pip"])
        _make_environment(READERS, READER_PACKAGES, _run_here)
    return READERS / "bin/python"


def _run_here(words):
    return _run(words, " ".join(map(str, words)))


def _run(words, what):
    done = subprocess.run(words, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode:
        raise Unavailable(f"{what} failed: {done.stdout.strip()[-400:]}")
    return done.stdout


def install_here(packages):
    """Packages of Debian, of which those that are missing are installed in this system; raises Unavailable."""
    told = subprocess.run(["dpkg-query", "-W", "-f", "${db:Status-Abbrev} ${Package}\n", *packages], text=True,
                          capture_output=True).stdout
    there = {line.split()[1].split(":")[0] for line in told.splitlines() if line[1:2] == "i"}
    missing = [p for p in packages if p not in there]
    if missing:
        _run(["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq", "install", "-y", "--no-install-recommends", *missing],
             f"apt-get install {' '.join(missing)}")


def _mirror():
    """The mirror that this system's own packages come from."""
    told = _run(["apt-get", "indextargets", "--format", "$(REPO_URI) $(ORIGIN) $(LABEL)", "Created-By: Packages"], "apt-get")
    for line in told.splitlines():
        address, *names = line.split()
        if names == ["Debian", "Debian"]:
            return address
    raise Unavailable("apt knows no mirror of Debian")


# The wheels are the last of their series when this list was written.
HOSTS = {host.name: host for host in [
    Host("3.4", "Debian 12's own"),
    Host("4.2", "official build, LTS", wheel="4.2.23"),
    Host("4.3", "Debian 13's own", root="trixie"),
    Host("4.5", "official build, LTS", wheel="4.5.15"),
    Host("5.0", "official build", wheel="5.0.1"),
    Host("5.2", "official build, LTS, in Debian 13", root="trixie", wheel="5.2.3"),
    Host("sid", "Debian sid's own", root="sid"),
]}
# What the portable package is tried in beside this system; the oldest has no Blender that the add-on knows.
OLD_DEBIAN = Host("bullseye", "Debian 11, Python alone", root="bullseye", packages=["python3", "python3-numpy", "python3-pip"])
# What an artist's system has at least; Debian's Blender recommends numpy, which official ones bring.
BLENDER_ALONE = Host("alone", "Debian 13's Blender and nothing else", root="trixie", packages=["blender", "python3-numpy"],
                     at="trixie-blender")
PACKAGE_ROOTS = {host.root: host for host in (OLD_DEBIAN, HOSTS["4.3"], HOSTS["sid"])}


def _source_root(name, sentence, root, compilers=("gcc", "g++"), options=()):
    """A host with what a newcomer's build installs, and what the tests of parts ask for beside; options are CMake's."""
    listed, = re.findall(r"^build_packages=\((.*?)\)", (REPOSITORY / "sunder").read_text(), re.S | re.M)
    # clang's sanitizers come in a package of their own.
    of_compiler = [] if "gcc" in compilers else [compilers[0], compilers[0].replace("clang-", "libclang-rt-") + "-dev"]
    packages = [*listed.split(), *of_compiler, "libcgal-demo", "dpkg-dev", "file"]
    host = Host(name, sentence, root=root, packages=packages, at=f"{root}-build")
    host.compilers = compilers  # of C and C++
    host.options = options
    return host


# What Sunder is built in from its sources; the first file by file, the last by the earliest clang that does.
SOURCE_ROOTS = {host.name: host for host in [
    _source_root("source-13", "Debian 13, g++ 14", "trixie", options=["-DSUNDER_UNITY=OFF"]),
    _source_root("source-sid", "Debian sid, g++ 16", "sid"),
    _source_root("source-clang", "Debian 12, clang 16", "bookworm", ("clang-16", "clang++-16")),
]}


def main(arguments):
    if len(arguments) != 2 or arguments[0] != "prepare" or arguments[1] not in (*HOSTS, "readers"):
        sys.exit(f"{__doc__}\nHosts: {', '.join(HOSTS)}")
    try:
        if arguments[1] == "readers":
            print(prepare_readers())
            return
        host = HOSTS[arguments[1]]
        host.prepare()
    except Unavailable as error:
        sys.exit(f"hosts.py: error: {error}")
    print(shlex.join(host.command()))


if __name__ == "__main__":
    main(sys.argv[1:])
