"""The gate's slow parts, of `./sunder test --all`: sanitizers, libFuzzer and clang-tidy, with the tools of Debian 12.

What is built stays (build-sanitized, build-threads): a build that was stopped goes on. `./sunder test` has built everything else.
"""
import json
import os
import re
import subprocess
from pathlib import Path

import hosts

BUILD = hosts.REPOSITORY / "build"
FUZZ_SECONDS = 60  # a target
FUZZ_PACKAGES = ["clang-16", "libclang-rt-16-dev"]
TIDY_PACKAGES = ["clang-16", "clang-tidy-16"]


class Failed(Exception):
    """A step of a build; its output was shown."""


def _is_debian_12():
    release = dict(re.findall(r'^(ID|VERSION_ID)="?(\w+)"?$', Path("/etc/os-release").read_text(), re.M))
    return release == {"ID": "debian", "VERSION_ID": "12"}


def require_debian_12():
    if not _is_debian_12():
        raise hosts.Unavailable("the gate is Debian 12's: other versions of its tools see other things")


def _step(name, *words):
    if subprocess.run([str(word) for word in words], stdin=subprocess.DEVNULL).returncode:
        raise Failed(name)


def _ninja(folder, *targets):
    _step(f"building {targets[0]}", "nice", "ninja", "-C", folder, "-j", os.cpu_count(), *targets)


class Sanitized:
    """A build of library and tests under sanitizers. It lies as deep as the plain one: ccache has what is not instrumented."""

    def __init__(self, name, sanitizers, targets):
        self.folder, self.sanitizers, self.targets = hosts.REPOSITORY / f"build-{name}", sanitizers, targets

    def make(self):
        require_debian_12()
        _step("configuring", "cmake", "-S", hosts.REPOSITORY, "-B", self.folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
              "-DSUNDER_TESTS=ON", f"-DSUNDER_SANITIZE={self.sanitizers}", f"-DPython3_EXECUTABLE={hosts.PYTHON}")
        _ninja(self.folder, *self.targets)


MEMORY = Sanitized("sanitized", "address,undefined", ["test_solver", "test_nodes", "test_c_api", "test_c_api_errors", "test_threads"])
THREADS = Sanitized("threads", "thread", ["test_threads"])
# Folders of tests, with ctest's arguments. Leaks are looked for where a program ends by itself.
MEMORY_TESTS = {"solver": ["-LE", "long"], "nodes": [], "plugin_src": ["-R", "^(c_api|c_api_errors|threads)$"]}
THREADS_TESTS = {"plugin_src": ["-R", "^threads$"]}
ENVIRONMENT = {"UBSAN_OPTIONS": "print_stacktrace=1", "TSAN_OPTIONS": "halt_on_error=1 second_deadlock_stack=1"}


def fuzz(seconds=FUZZ_SECONDS):
    """[(target, whether no input was at fault)] of libFuzzer's programs; what they find goes to build/fuzz."""
    require_debian_12()
    hosts.install_here(FUZZ_PACKAGES)
    _step("configuring", "cmake", BUILD)  # clang may be there only now
    _ninja(BUILD, "libfuzzer")
    found = []
    for kept in sorted((hosts.REPOSITORY / "tests/fuzz/corpus").iterdir()):
        grown, faults = BUILD / "fuzz" / kept.name, BUILD / f"fuzz/{kept.name}-"
        grown.mkdir(parents=True, exist_ok=True)
        done = subprocess.run([BUILD / f"tests/fuzz/libfuzzer_{kept.name}", grown, kept, f"-max_total_time={seconds}", "-timeout=60",
                               "-rss_limit_mb=2048", "-malloc_limit_mb=512", "-max_len=65536", "-print_final_stats=1", "-verbosity=0",
                               f"-artifact_prefix={faults}"], stdin=subprocess.DEVNULL)
        found.append((kept.name, done.returncode == 0))
    return found


def tidy(*named):
    """(sources looked at, findings) of clang-tidy: all but tests and what the package alone has, or those whose path holds a name.
    A folder's sources are one, as they are compiled."""
    require_debian_12()
    hosts.install_here(TIDY_PACKAGES)
    sources = {}  # in the order of the database; kernels are in it once for each instruction set
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        path = Path(entry["file"]).relative_to(hosts.REPOSITORY)
        if not {"tests", "packaging"} & set(path.parts) and (not named or any(name in str(path) for name in named)):
            sources[path] = None
    words = ["nice", "xargs", "-d", "\n", "-P", str(os.cpu_count()), "-n", "1", "clang-tidy-16", "-p", str(BUILD), "--quiet",
             "--extra-arg=-Wno-unknown-warning-option"]  # the build is told what g++ knows
    told = subprocess.run(words, input="\n".join(map(str, sources)), text=True, cwd=hosts.REPOSITORY, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE)
    failed = [line for line in told.stderr.splitlines() if "error" in line.lower()]
    findings = re.findall(rf"^(?:{re.escape(str(hosts.REPOSITORY))}/)?(.*?:\d+):\d+: (?:warning|error): (.*)$", told.stdout, re.M)
    return list(sources), sorted({f"{place}: {what}" for place, what in findings}) + failed
