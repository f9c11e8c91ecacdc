"""Puts the Blender add-on together: sources, Python package, library, node descriptions; as a folder and as a zip.

    python3 package_addon.py --library libsunder.so --package plugin_src/python/sunder --platform linux-x64 [--licences DIR] OUT

OUT/addons/sunder_addon is what the zip OUT/sunder_addon-VERSION-PLATFORM.zip holds. The same sources give the same zip.
"""
import argparse
import ctypes
import json
import shutil
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
NAME = "sunder_addon"
THEN = (2020, 1, 1, 0, 0, 0)  # of every file in the zip: what is packed decides its bytes, not when


def descriptions(library):
    function = ctypes.CDLL(str(library.resolve())).sunder_node_types_json
    function.restype = ctypes.c_char_p
    return json.loads(function())


def files(library, package, platform, licences):
    """{path below the add-on: bytes}."""
    content = {}
    for source in sorted((HERE / NAME).rglob("*")):
        if source.suffix in (".py", ".toml"):
            content[source.relative_to(HERE / NAME).as_posix()] = source.read_bytes()
    manifest = content["blender_manifest.toml"].decode()
    content["blender_manifest.toml"] = (manifest + f'platforms = ["{platform}"]\n').encode()
    for name in ("bake_reader.py", "blender_versions.py"):  # scripts that run without the add-on use them, too
        content["base/" + name] = (HERE / name).read_bytes()
    for source in sorted(package.glob("*.py")):
        content[f"sunder/{source.name}"] = source.read_bytes()
    content["sunder/" + library.name] = library.read_bytes()
    for source in sorted(licences.iterdir()) if licences else []:
        content[f"licences/{source.name}"] = source.read_bytes()
    content["nodes.json"] = json.dumps(descriptions(library), indent=1).encode()
    return content


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--library", type=Path, required=True)
    parser.add_argument("--package", type=Path, required=True)
    parser.add_argument("--platform", required=True)
    parser.add_argument("--licences", type=Path, help="texts of what is linked in")
    given = parser.parse_args()
    content = files(given.library, given.package, given.platform, given.licences)
    folder = given.out / "addons" / NAME
    shutil.rmtree(folder, ignore_errors=True)
    for name, data in content.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    version = json.loads(content["nodes.json"])["sunder"]
    for old in given.out.glob(f"{NAME}-*.zip"):
        old.unlink()
    with zipfile.ZipFile(given.out / f"{NAME}-{version}-{given.platform}.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            entry = zipfile.ZipInfo(f"{NAME}/{name}", THEN)
            entry.external_attr, entry.compress_type = 0o644 << 16, zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)


if __name__ == "__main__":
    main()
