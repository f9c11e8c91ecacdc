"""Writes the wheel of the Python package with the portable library, by PEP 427. The same files give the same wheel.

    python3 wheel.py OUT --version V --package DIR --library FILE --program FILE --licences DIR
"""
import argparse
import base64
import hashlib
import zipfile
from pathlib import Path

THEN = (2020, 1, 1, 0, 0, 0)  # of every file: what is packed decides the wheel's bytes, not when
TAG = "py3-none-manylinux_2_28_x86_64"
METADATA = """Metadata-Version: 2.1
Name: sunder
Version: {version}
Summary: Ductile fracture with oriented particles
License: GPL-3.0-or-later
Requires-Python: >=3.9
Requires-Dist: numpy
"""
WHEEL = f"""Wheel-Version: 1.0
Generator: sunder
Root-Is-Purelib: false
Tag: {TAG}
"""


def contents(given):
    """{path in the wheel: bytes}; pip lays what is in data/scripts on the PATH."""
    info = f"sunder-{given.version}.dist-info"
    files = {f"sunder/{path.name}": path.read_bytes() for path in sorted(given.package.glob("*.py*")) if path.is_file()}
    files["sunder/py.typed"] = (given.package / "py.typed").read_bytes()
    files["sunder/libsunder.so"] = given.library.read_bytes()
    files[f"sunder-{given.version}.data/scripts/sunder"] = given.program.read_bytes()
    for path in sorted(given.licences.iterdir()):
        files[f"{info}/licenses/{path.name}"] = path.read_bytes()
    files[f"{info}/METADATA"] = METADATA.format(version=given.version).encode()
    files[f"{info}/WHEEL"] = WHEEL.encode()
    record = f"{info}/RECORD"
    lines = [f"{name},sha256={_digest(data)},{len(data)}\n" for name, data in files.items()] + [f"{record},,\n"]
    files[record] = "".join(lines).encode()
    return files


def _digest(data):
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--version", required=True)
    for name in ("package", "library", "program", "licences"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    given = parser.parse_args()
    for old in given.out.glob("sunder-*.whl"):
        old.unlink()
    with zipfile.ZipFile(given.out / f"sunder-{given.version}-{TAG}.whl", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in contents(given).items():
            entry = zipfile.ZipInfo(name, THEN)
            is_program = "/scripts/" in name or name.endswith(".so")
            entry.external_attr, entry.compress_type = (0o100755 if is_program else 0o100644) << 16, zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)


if __name__ == "__main__":
    main()
