"""The portable package needs a C library alone, shows the C interface alone, loads beside a host's own OpenVDB and TBB in either
order, and gives the plain build's bits in every Debian. `./sunder test --all package` makes it and runs this."""
import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OUT = ROOT / "build/package"
LIBRARY, PROGRAM = OUT / "libsunder.so", OUT / "sunder"
PLAIN = {"SUNDER_LIBRARY": str(ROOT / "build/plugin_src/libsunder.so"), "PYTHONPATH": str(ROOT / "plugin_src/python")}
# The system's part: pip's name for it is manylinux_2_28, and TBB and OpenVDB are not in it.
PERMITTED = {"libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "ld-linux-x86-64.so.2"}
LATEST = (2, 28)
PYTHON = "/usr/bin/python3"

sys.path.insert(0, str(ROOT / "tests/hosts"))
import hosts  # noqa: E402

WHEEL = next(OUT.glob("sunder-*-py3-none-manylinux_2_28_x86_64.whl"))
ZIP = next(OUT.glob("sunder_addon-*-linux-x64.zip"))
PLACES = ["here", *hosts.PACKAGE_ROOTS]


def output(*words, **environment):
    """What a command prints; the variables of this process that name a library or package are not handed on."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith("SUNDER_") and k != "PYTHONPATH"}
    done = subprocess.run([str(w) for w in words], text=True, capture_output=True, stdin=subprocess.DEVNULL, timeout=600,
                          env={**kept, **environment})
    assert done.returncode == 0, f"{words[:6]}: {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


def result(text):
    return json.loads(next(line for line in text.splitlines() if line.startswith("RESULT "))[7:])


def inside(place, *words):
    """The words that run others there: in this system or a root."""
    return words if place == "here" else hosts.PACKAGE_ROOTS[place].inside(*words)


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """The folder of a place into which its own pip has installed the wheel; /tmp is the same in every root."""
    folders = {}

    def install(place):
        if place in folders:
            return folders[place]
        if place != "here":
            try:
                hosts.PACKAGE_ROOTS[place].prepare_root()
            except hosts.Unavailable as error:
                pytest.skip(str(error))
        folder = tmp_path_factory.mktemp(place)
        output(*inside(place, PYTHON, "-m", "pip", "install", "-q", "--no-deps", "--no-index", "--disable-pip-version-check",
                       "--target", folder, WHEEL))
        folders[place] = folder
        return folder

    return install


@pytest.fixture(scope="session")
def graphs(tmp_path_factory):
    """{name: (file, last frame, hashes that the plain build bakes)} of the README's first graph and the demo's first second."""
    folder = tmp_path_factory.mktemp("plain")
    beam, = (block for block in re.findall(r"```json\n(.*?)```", (ROOT / "README.md").read_text(), re.S) if '"sunder": 2' in block)
    (folder / "beam.json").write_text(beam)
    made = {}
    for file, last, n_files in ((folder / "beam.json", 36, 2 * 36), (ROOT / "tests/scenes/demo.json", 24, 3 * 24)):
        hashes = result(output(PYTHON, "-B", HERE / "bake_hashes.py", file, folder / file.stem, last, **PLAIN))
        assert len(hashes) == n_files
        made[file.stem] = file, last, hashes
    return made


@pytest.mark.parametrize("file", [LIBRARY, PROGRAM])
def test_it_needs_the_c_library_alone(file):
    needed = set(re.findall(r"\(NEEDED\).*\[(.*)\]", output("readelf", "-d", file)))
    assert needed <= PERMITTED and "libc.so.6" in needed
    versions = set(re.findall(r"Name: (\w+?)_([\d.]+)", output("readelf", "-W", "--version-info", file)))
    assert {name for name, _ in versions} == {"GLIBC"}
    late = [v for _, v in versions if tuple(map(int, v.split("."))) > LATEST]
    assert not late, f"needs glibc {late}"


def test_it_shows_the_c_interface_alone():
    output(PYTHON, ROOT / "tests/plugin_src/check_exports.py", LIBRARY, ROOT / "plugin_src/c_api/sunder.h", "nm")
    shown = re.findall(r" (\w) (\S+)", output("nm", "-D", "--defined-only", LIBRARY))
    assert all(kind == "T" and name.startswith("sunder_") for kind, name in shown)


def test_the_wheel_brings_the_types():
    with zipfile.ZipFile(WHEEL) as opened:
        assert {"sunder/py.typed", "sunder/_nodes.pyi"} <= set(opened.namelist())


def test_it_calls_no_inexact_function_of_libm():
    output(PYTHON, ROOT / "tests/plugin_src/check_libm.py", "readelf", LIBRARY, PROGRAM)


@pytest.mark.parametrize("archive, folder", [(ZIP, "sunder_addon/licences/"), (WHEEL, "")])
def test_the_licences_of_what_is_linked_in_are_with_it(archive, folder):
    with zipfile.ZipFile(archive) as opened:
        names = {name.rsplit("/", 1)[1]: opened.read(name) for name in opened.namelist() if "/licen" in name and folder in name}
        library, = (opened.read(name) for name in opened.namelist() if name.endswith("libsunder.so"))
    assert library == LIBRARY.read_bytes()
    pinned = {line.split()[0] for line in (ROOT / "plugin_src/packaging/sources.txt").read_text().splitlines() if line[0] != "#"}
    for name in (pinned - {"libc"}) | {"sunder", "cgal", "eigen", "boost", "nlohmann-json", "gcc-runtime", "GPL-3", "LGPL-3"}:
        assert len(names[f"{name}.txt"]) > 500, name


def interpreter(host):
    """A Python that has the host's libraries, and pip's folder for the package."""
    if host == "debian":
        return PYTHON
    blender = hosts.HOSTS["4.5"]
    try:
        blender.prepare()
    except hosts.Unavailable as error:
        pytest.skip(str(error))
    return blender.environment / "bin/python"


@pytest.mark.parametrize("host", ["debian", "bpy"])
def test_it_works_beside_a_hosts_own_libraries_whichever_comes_first(host, installed):
    """OpenVDB, TBB and Imath of Debian 12, seen by all; those within official Blender. What the library throws it catches itself."""
    alone = result(output(PYTHON, "-B", HERE / "beside.py", "sunder", PYTHONPATH=str(installed("here"))))
    assert "block offset is out of range" in alone["told"][0] and "ends too early" in alone["told"][1]
    for order in (["sunder", host], [host, "sunder"]):
        assert result(output(interpreter(host), "-B", HERE / "beside.py", *order, PYTHONPATH=str(installed("here")))) == alone, order


@pytest.mark.parametrize("graph", ["beam", "demo"])
@pytest.mark.parametrize("place", PLACES)
def test_it_bakes_the_bits_of_the_plain_build(place, graph, installed, graphs, tmp_path):
    file, last, plain = graphs[graph]
    words = inside(place, "env", f"PYTHONPATH={installed(place)}", PYTHON, "-B", HERE / "bake_hashes.py", file, tmp_path / "bake", last)
    hashes = result(output(*words))
    assert hashes.keys() == plain.keys()
    assert [name for name in plain if hashes[name] != plain[name]] == []


@pytest.mark.parametrize("place", PLACES)
def test_the_program_runs_and_its_bakes_verify(place, installed, graphs, tmp_path):
    program = installed(place) / "bin/sunder"
    assert output(*inside(place, program, "--version")) == output(ROOT / "build/plugin_src/sunder", "--version")
    output(*inside(place, program, "bake", graphs["beam"][0], "-o", tmp_path / "bake", "--frames", "1:2"))
    output(*inside(place, program, "verify", tmp_path / "bake"))


@pytest.mark.parametrize("old, new, sentence", [
    (b"GLIBC_2.25\0", b"GLIBC_2.99\0", "needs GLIBC 2.99, and this system has glibc 2."),
    (b"\x3e\0\1\0\0\0", b"\xb7\0\1\0\0\0", "is for 64-bit programs on ARM64, and this is a 64-bit Python on x86_64"),
    (b"\x7fELF\2", b"\x7fELF\1", "is for 32-bit programs on x86-64, and this is a 64-bit Python on x86_64"),
])
def test_one_that_this_system_cannot_load_is_refused_by_a_sentence(old, new, sentence, tmp_path):
    """Copies of the library that ask for a later glibc, and whose heads name another processor and width."""
    copy = tmp_path / "libsunder.so"
    data = LIBRARY.read_bytes()
    assert old in data
    copy.write_bytes(data.replace(old, new, 1))
    done = subprocess.run([PYTHON, "-c", "import sunder"], env={**os.environ, **PLAIN, "SUNDER_LIBRARY": str(copy)}, text=True,
                          capture_output=True)
    assert f"{copy}: {sentence}" in done.stderr
