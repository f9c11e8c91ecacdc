"""How the Python package finds and checks its library, and what it says of one that it cannot use."""
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import sunder


def run_python(code, **environment):
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **environment}
    )


def test_a_library_that_is_not_there_or_not_ours_is_told(tmp_path):
    assert "is not there" in run_python("import sunder", SUNDER_LIBRARY=str(tmp_path / "gone.so")).stderr
    (tmp_path / "text.so").write_text("no library")
    assert "is not Sunder's library" in run_python("import sunder", SUNDER_LIBRARY=str(tmp_path / "text.so")).stderr


@pytest.mark.parametrize("told, sentence", [
    ("libassimp.so.5: cannot open shared object file: No such file or directory",
     "a.so: needs libassimp.so.5, which this system has not (install it; on Debian it is libassimp5)"),
    ("libImath-3_1.so.29: cannot open shared object file: No such file or directory",
     "a.so: needs libImath-3_1.so.29, which this system has not (install it; on Debian it is libimath-3-1-29)"),
    ("/lib/x86_64-linux-gnu/libm.so.6: version `GLIBC_2.35' not found (required by a.so)",
     "a.so: needs GLIBC 2.35, and this system has glibc 2.31 (use a later system, or build Sunder on this one)"),
    ("/lib/libstdc++.so.6: version `GLIBCXX_3.4.30' not found (required by a.so)",
     "a.so: needs GLIBCXX 3.4.30, and this system's is older (use a later system, or build Sunder on this one)"),
    ("a.so: file too short", "a.so: is not Sunder's library: a.so: file too short"),
])
def test_what_a_library_lacks_is_told_with_its_cure(told, sentence, monkeypatch):
    monkeypatch.setattr(sunder.library, "_libc", lambda: "glibc 2.31")
    assert str(sunder.library._unusable("a.so", told)) == sentence


def test_a_system_without_glibc_is_told(monkeypatch):
    monkeypatch.setattr(os, "confstr", lambda name: (_ for _ in ()).throw(ValueError(name)))
    told = "Error loading shared library ld-linux-x86-64.so.2: No such file or directory (needed by a.so)"
    assert "a.so: needs glibc, and this system has another C library" in str(sunder.library._unusable("a.so", told))


@pytest.mark.parametrize("bits, processor, machine, maxsize, sentence", [
    (2, 62, "aarch64", 2**63 - 1, "is for 64-bit programs on x86-64, and this is a 64-bit Python on aarch64"),
    (2, 62, "armv7l", 2**31 - 1, "is for 64-bit programs on x86-64, and this is a 32-bit Python on armv7l"),
    (2, 62, "x86_64", 2**31 - 1, "is for 64-bit programs on x86-64, and this is a 32-bit Python on x86_64"),
    (2, 183, "x86_64", 2**63 - 1, "is for 64-bit programs on ARM64, and this is a 64-bit Python on x86_64"),
    (2, 62, "x86_64", 2**63 - 1, "is not Sunder's library"),  # for this machine, and broken
])
def test_a_library_for_another_processor_is_told(bits, processor, machine, maxsize, sentence, tmp_path, monkeypatch):
    library = tmp_path / "a.so"
    library.write_bytes(b"\x7fELF" + bytes([bits, 1, 1]) + bytes(9) + b"\3\0" + processor.to_bytes(2, "little"))
    monkeypatch.setenv("SUNDER_LIBRARY", str(library))
    monkeypatch.setattr(sunder.library.platform, "machine", lambda: machine)
    monkeypatch.setattr(sunder.library.sys, "maxsize", maxsize)
    with pytest.raises(sunder.Error) as caught:
        sunder.library._load()
    monkeypatch.undo()  # pytest looks at maxsize, too
    assert sentence in str(caught.value)


def test_a_library_whose_needs_are_not_there_is_told(tmp_path):
    """By the system's own linker: a copy of the library that asks for another name."""
    library = next(p for p in sunder.library._candidates() if os.path.exists(p))
    data = Path(library).read_bytes()
    name, = (n for n in ("libassimp", "libpthread") if re.search(rb"\b%s\.so\.\d\0" % n.encode(), data))  # plain or portable
    (tmp_path / "libsunder.so").write_bytes(re.sub(rb"\b%s\.so\.\d\0" % name.encode(), b"%s.so.9\0" % name.encode(), data))
    told = run_python("import sunder", SUNDER_LIBRARY=str(tmp_path / "libsunder.so")).stderr
    assert f"needs {name}.so.9, which this system has not (install it; on Debian it is {name}9)" in told


def test_a_library_older_than_the_package_is_told(monkeypatch):
    monkeypatch.setitem(sunder.library._FUNCTIONS, "graph_of_tomorrow", (None, []))
    with pytest.raises(sunder.Error, match="is older than this package, it has no sunder_graph_of_tomorrow"):
        sunder.library._load()
