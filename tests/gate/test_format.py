"""C++ is formatted by clang-format as Debian 12 has it. Files in unformatted.txt are not yet: what is done leaves the list.

    python3 tests/gate/test_format.py --list    names those that are not formatted
"""
import re
import subprocess
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FOLDERS = ("solver", "fracture_tools", "nodes", "plugin_src", "tests")
VERSION = "14.0"


def unformatted():
    """Sources that clang-format would change, from the root."""
    files = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in (".h", ".c", ".cpp"))
    done = subprocess.run(["clang-format", "--dry-run", "--style=file", *files], text=True, capture_output=True, check=True)
    at_fault = re.findall(r"^(.*?):\d+:\d+: warning: code should be clang-formatted", done.stderr, re.M)
    return sorted({str(Path(path).relative_to(ROOT)) for path in at_fault})


class Format(unittest.TestCase):
    def test_what_is_not_formatted_is_known_not_to_be(self):
        version = subprocess.run(["clang-format", "--version"], text=True, capture_output=True).stdout
        self.assertIn(f"version {VERSION}.", version)
        # By their own names: files may move.
        known = set((HERE / "unformatted.txt").read_text().split())
        found = unformatted()
        new = [path for path in found if Path(path).name not in known]
        self.assertEqual(new, [], "run: clang-format -i " + " ".join(new))
        done = known - {Path(path).name for path in found}
        self.assertEqual(done, set(), "is formatted by now: take it out of tests/gate/unformatted.txt")


if __name__ == "__main__":
    if sys.argv[1:] == ["--list"]:
        print("\n".join(unformatted()))
    else:
        unittest.main()
