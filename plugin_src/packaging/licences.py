"""The licence texts of all that is linked into the portable library, gathered into a folder.

    python3 licences.py OUT --folder FOLDER     FOLDER: what dependencies/build.py made
"""
import argparse
import re
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# {name in the package: files}. With a pattern after "|" only what it matches is taken. $ is the folder of the sources, % that of
# Debian 11's C library; the rest lies where Debian keeps it.
TEXTS = {
    "sunder": [ROOT / "LICENSE"],
    "assimp": ["$/assimp/LICENSE"],
    "boost": ["/usr/share/doc/libboost1.74-dev/copyright|(?s)Boost Software License - Version 1\\.0.*?DEALINGS IN THE *\\n? *SOFTWARE\\."],
    "cgal": ["/usr/share/doc/libcgal-dev/copyright"],
    "cli11": ["/usr/share/doc/libcli11-dev/copyright"],
    "draco": ["$/assimp/contrib/draco/LICENSE"],
    "eigen": ["/usr/share/doc/libeigen3-dev/copyright"],
    "gcc-runtime": ["/usr/share/doc/gcc-12-base/copyright"],
    "glibc-nonshared": ["%/usr/share/doc/libc6-dev/copyright"],
    "gmp": ["$/gmp/COPYING.LESSERv3", "$/gmp/COPYINGv2"],
    "mpfr": ["$/mpfr/COPYING.LESSER"],
    "nlohmann-json": ["/usr/share/doc/nlohmann-json3-dev/copyright"],
    "open3dgc": ["$/assimp/contrib/Open3DGC/o3dgcCommon.h|(?s)/\\*.*?\\*/"],
    "openvdb": ["$/openvdb/LICENSE"],
    "rapidjson": ["$/assimp/contrib/rapidjson/license.txt"],
    "tbb": ["$/tbb/LICENSE.txt", "$/tbb/third-party-programs.txt"],
    "utfcpp": ["$/utfcpp/usr/share/doc/libutfcpp-dev/copyright"],
    "xxhash": ["$/xxhash/LICENSE"],
    "zlib": ["$/zlib/LICENSE"],
    "zstd": ["$/zstd/LICENSE"],
    **{name: [f"/usr/share/common-licenses/{name}"] for name in ("Apache-2.0", "GPL-3", "LGPL-2.1", "LGPL-3", "MPL-2.0")},
}


def text(source, folder):
    path, _, pattern = str(source).partition("|")
    path = path.replace("$", str(folder / "source")).replace("%", str(folder / "libc"))
    whole = Path(path).read_text(errors="replace")
    if not pattern:
        return whole
    found = re.search(pattern, whole)
    if not found:
        raise SystemExit(f"sunder: error: {path} holds no licence where licences.py looks for it")
    return re.sub(r"(?m)^ \.?", "", found[0]) + "\n"  # without the marks of Debian's form


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--folder", type=Path, required=True)
    given = parser.parse_args()
    shutil.rmtree(given.out, ignore_errors=True)
    given.out.mkdir(parents=True)
    for name, sources in TEXTS.items():
        (given.out / f"{name}.txt").write_text("\n".join(text(source, given.folder) for source in sources))


if __name__ == "__main__":
    main()
