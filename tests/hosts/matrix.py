"""The whole matrix of tests: every Blender, every part; what came of each is written to docs/matrix.md.

    python3 matrix.py --all [PART]...   parts that have not passed on this commit; with names, those alone
    python3 matrix.py --blender HOST    the add-on's tests in one Blender, without a window

Called by `./sunder test`, which has built everything. Results are kept in build/matrix. A part that cannot run here counts
as not run, never as passed; a part that fails makes the whole fail.
"""
import argparse
import functools
import json
import os
import shlex
import subprocess
import sys
import time
import xml.etree.ElementTree as xml
from pathlib import Path

import gate
import hosts
import source_builds

REPOSITORY = hosts.REPOSITORY
BUILD = REPOSITORY / "build"
KEPT = BUILD / "matrix"
PACKAGE = BUILD / "package"  # what `./sunder package` makes: every Blender of the matrix has the add-on from there
TABLE = REPOSITORY / "docs/matrix.md"
FAULTS = Path(__file__).with_name("host_faults.json")  # what fails in a host by the host's own fault: {part: {test: why}}


def say(text):
    print(f"sunder: {text}", file=sys.stderr, flush=True)


class Part:
    """name; sentence; run(): Result."""

    def __init__(self, name, sentence, run):
        self.name, self.sentence, self.run = name, sentence, run


class Result:
    def __init__(self, passed=0, failed=(), versions="", not_run=""):
        self.passed, self.failed, self.versions, self.not_run = passed, list(failed), versions, not_run


def _ctest(arguments, environment, name, folder=BUILD, within=()):
    """Runs a build folder's tests by ctest; what it tells of each in its report of JUnit's form. within: words that run others
    where the folder was built."""
    report = KEPT / f"{name}.xml"
    report.unlink(missing_ok=True)
    subprocess.run([*within, "ctest", "--test-dir", str(folder), "--output-on-failure", "--no-tests=error", "--timeout", "600", "-j",
                    str(os.cpu_count()), "--output-junit", str(report), *arguments], env={**os.environ, **environment},
                   stdin=subprocess.DEVNULL)
    if not report.exists():
        return Result(failed=["ctest itself"])
    passed, failed = 0, []
    for case in xml.parse(report).getroot().iter("testcase"):
        if case.get("status") == "run":
            passed += 1
        else:  # one that could not run has guarded nothing
            failed.append(case.get("name"))
    return Result(passed, failed)


def _package():
    """The portable package, made and tried here and in roots of other Debians; then the scripted tests with it in the place of
    the plain build."""
    try:
        hosts.install_here(["python3-pip"])
    except hosts.Unavailable as error:
        return Result(not_run=str(error))
    if not _package_is_made():
        return Result(failed=["./sunder package"])
    portable = {"SUNDER_LIBRARY": str(PACKAGE / "libsunder.so"), "SUNDER_PROGRAM": str(PACKAGE / "sunder"),
                "SUNDER_USD_READER": str(BUILD / "usd_reader"), "PYTHONPATH": str(REPOSITORY / "plugin_src/python")}
    results = [_pytest(folder, portable, f"package_{folder.name}") for folder in
               (REPOSITORY / "tests/packaging", REPOSITORY / "tests/scripted")]
    return Result(sum(r.passed for r in results), sum((r.failed for r in results), []))


def _pytest(folder, environment, name):
    report = KEPT / f"{name}.xml"
    report.unlink(missing_ok=True)
    subprocess.run([hosts.PYTHON, "-B", "-m", "pytest", "-q", "-p", "no:cacheprovider", "--junitxml", str(report), str(folder)],
                   env={**os.environ, **environment}, stdin=subprocess.DEVNULL)
    if not report.exists():
        return Result(failed=[f"pytest of {folder.name} itself"])
    passed, failed = 0, []
    for case in xml.parse(report).getroot().iter("testcase"):
        bad = [child for child in case if child.tag in ("failure", "error", "skipped")]
        passed += not bad
        failed += [case.get("name") + (f" (did not run: {child.get('message')})" if child.tag == "skipped" else "") for child in bad]
    return Result(passed, failed)


@functools.cache
def _package_is_made():
    return subprocess.run([str(REPOSITORY / "sunder"), "package"], stdin=subprocess.DEVNULL).returncode == 0


def _in_host(host, arguments, name):
    """Tests by ctest with a Blender of the matrix in the place of this system's, and the packaged add-on, which needs nothing."""
    if not _package_is_made():
        return Result(failed=["./sunder package"])
    try:
        host.prepare()
        versions = host.versions()
    except hosts.Unavailable as error:
        return Result(not_run=str(error))
    result = _ctest(arguments, {"SUNDER_BLENDER": shlex.join(host.command()), "SUNDER_ADDON_ROOT": str(PACKAGE)}, name)
    result.versions = f"Blender {versions['blender']}, Python {versions['python']}, numpy {versions['numpy']}, " \
                      f"glibc {versions['libc']}"
    return result


def _from_source(host):
    """Built whole in a root of another Debian, a warning being an error; the tests of its parts and of installing run there."""
    try:
        host.prepare_root()
        build = source_builds.SourceBuild(host, BUILD / host.name)
        build.make()
    except hosts.Unavailable as error:
        return Result(not_run=str(error))
    except source_builds.Failed as error:
        return Result(failed=[str(error)])
    results = [_ctest(arguments, {}, f"{host.name}_{folder}", BUILD / host.name / "tests" / folder, build.within())
               for folder, arguments in source_builds.TESTED.items()]
    return Result(sum(r.passed for r in results), sum((r.failed for r in results), []), build.versions())


def _sanitized(build, tests):
    """Tests in a build under sanitizers."""
    try:
        build.make()
    except hosts.Unavailable as error:
        return Result(not_run=str(error))
    except gate.Failed as error:
        return Result(failed=[str(error)])
    results = [_ctest([*arguments, "-E", "_NOT_BUILT"], gate.ENVIRONMENT, f"{build.folder.name}_{folder}", build.folder / "tests" / folder)
               for folder, arguments in tests.items()]
    return Result(sum(r.passed for r in results), sum((r.failed for r in results), []), build.sanitizers)


def _fuzz():
    try:
        found = gate.fuzz()
    except hosts.Unavailable as error:
        return Result(not_run=str(error))
    except gate.Failed as error:
        return Result(failed=[str(error)])
    return Result(sum(is_well for _, is_well in found), [target for target, is_well in found if not is_well], "clang 16")


def _tidy():
    try:
        sources, findings = gate.tidy()
    except hosts.Unavailable as error:
        return Result(not_run=str(error))
    return Result(len(sources), findings, "clang-tidy 16")


def parts():
    made = [Part("suite", "all that `./sunder test` runs on this system, and what takes minutes: sheets against finite elements",
                 lambda: _ctest([], {}, "suite")),
            Part("sanitized", "tests of solver, nodes and C interface under the address and undefined-behaviour sanitizers",
                 lambda: _sanitized(gate.MEMORY, gate.MEMORY_TESTS)),
            Part("threads", "thread pool, frame writer, a small bake and a job under the thread sanitizer",
                 lambda: _sanitized(gate.THREADS, gate.THREADS_TESTS)),
            Part("fuzz", "libFuzzer, a minute for each reader of foreign bytes", _fuzz),
            Part("tidy", "clang-tidy: mistakes that tests do not see (.clang-tidy)", _tidy),
            Part("package", "the portable package (`./sunder package`): here, and in roots of Debian 11, 13 and sid", _package)]
    for host in hosts.SOURCE_ROOTS.values():
        made.append(Part(host.name, f"built from source and tested in its parts: {host.sentence}", lambda host=host: _from_source(host)))
    for host in hosts.HOSTS.values():
        name = f"blender-{host.name}"
        made.append(Part(name, f"the add-on without a window: {host.sentence}",
                         lambda host=host, name=name: _in_host(host, ["-L", "blender_host"], name)))
    for host in hosts.HOSTS.values():
        if host.has_window():
            name = f"window-{host.name}"
            made.append(Part(name, f"a session in Blender's window: {host.sentence}",
                             lambda host=host, name=name: _in_host(host, ["-L", "blender_window"], name)))
    return {part.name: part for part in made}


def _git(*arguments):
    return subprocess.run(["git", "-C", str(REPOSITORY), *arguments], text=True, capture_output=True).stdout.strip()


def _commit():
    """The commit that is tested; one that was edited since is no commit."""
    edited = [line for line in _git("status", "--porcelain").splitlines() if not line.endswith("docs/matrix.md")]
    return _git("rev-parse", "--short=9", "HEAD") + ("+edits" if edited else "")


def _kept(name):
    path = KEPT / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else None


def _run(part, commit):
    started = time.monotonic()
    say(f"{part.name}: {part.sentence}")
    result = part.run()
    known = json.loads(FAULTS.read_text()).get(part.name, {}) if FAULTS.exists() else {}
    explained = {name: known[name] for name in result.failed if name in known}
    told = {"part": part.name, "sentence": part.sentence, "versions": result.versions, "commit": commit,
            "date": time.strftime("%Y-%m-%d"), "passed": result.passed,
            "failed": [name for name in result.failed if name not in explained], "explained": explained,
            "not_run": result.not_run, "seconds": round(time.monotonic() - started)}
    if not told["not_run"] and not told["passed"]:
        told["failed"] = told["failed"] or ["nothing ran"]
    KEPT.mkdir(parents=True, exist_ok=True)
    (KEPT / f"{part.name}.json").write_text(json.dumps(told, indent=1))
    return told


def _is_whole(told, commit):
    return told is not None and told["commit"] == commit and not commit.endswith("+edits") and not told["failed"] \
        and not told["not_run"] and told["passed"] > 0


def _rows():
    """What the table says of each part: of those that this copy never ran it stays."""
    lines = TABLE.read_text().splitlines() if TABLE.exists() else []
    return {line.split("|")[1].strip(): line for line in lines if line.startswith("| ")}


def write_table(known):
    before = _rows()
    lines = ["# What is tested where", "",
             "Written by `./sunder test --all`. *Not run* is no pass: nothing is known of it.", "",
             "| part | what | versions | commit | date | passed | failed | host's own faults | not run, and why |",
             "|---|---|---|---|---|---|---|---|---|"]
    for part in parts().values():
        told = known.get(part.name)
        if told is None:
            lines.append(before.get(part.name, f"| {part.name} | {part.sentence} | | | | | | | never run |"))
            continue
        failed = ", ".join(told["failed"]) or "0"
        explained = "; ".join(f"{name}: {why}" for name, why in told["explained"].items())
        lines.append(f"| {part.name} | {part.sentence} | {told['versions']} | {told['commit']} | {told['date']} | {told['passed']} | "
                     f"{failed} | {explained} | {told['not_run']} |")
    TABLE.write_text("\n".join(lines) + "\n")


def run_all(names):
    there, commit = parts(), _commit()
    unknown = [n for n in names if n not in there]
    if unknown:
        sys.exit(f"sunder: error: no part is called {', '.join(unknown)}; parts: {', '.join(there)}")
    for name in names or there:
        if not names and _is_whole(_kept(name), commit):
            say(f"{name}: passed on {commit} before")
            continue
        _run(there[name], commit)
        write_table({n: _kept(n) for n in there if _kept(n)})
    told = [_kept(name) for name in names or there]
    for part in told:
        if part["not_run"]:
            say(f"WARNING: {part['part']} was NOT RUN: {part['not_run']}")
        for name in part["failed"]:
            say(f"{part['part']}: failed: {name}")
    passed, failed = (sum(counts) for counts in ([p["passed"] for p in told], [len(p["failed"]) for p in told]))
    print(f"{passed} passed, {failed} failed")
    return 1 if failed or not passed else 0


def run_blender(name):
    if name not in hosts.HOSTS:
        sys.exit(f"sunder: error: no Blender is called {name}; there are {', '.join(hosts.HOSTS)}")
    told = _run(parts()[f"blender-{name}"], _commit())
    if told["not_run"]:
        say(f"WARNING: Blender {name} was NOT RUN: {told['not_run']}")
    print(f"{told['passed']} passed, {len(told['failed'])} failed")
    return 1 if told["failed"] or told["not_run"] else 0


def main():
    parser = argparse.ArgumentParser(prog="./sunder test")
    parser.add_argument("--all", nargs="*", metavar="PART")
    parser.add_argument("--blender", metavar="HOST")
    given = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    return run_blender(given.blender) if given.blender else run_all(given.all or [])


if __name__ == "__main__":
    sys.exit(main())
