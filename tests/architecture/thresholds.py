"""The table of docs/thresholds.md against the sources: `thresholds.py --write` takes over names, values and places.

What a threshold decides, relative to what and which test guards it is written by hand, in the table.
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "docs" / "thresholds.md"
SOURCES = ("solver/scene/scales.*", "solver/matching/live_model.*", "solver/step/*", "solver/pieces/*", "solver/frame/local_hit.*",
           "solver/sleep/sleeping.*", "solver/contacts/*/*")
# Numbers that a branch is taken by or a share is bounded by; sizes of arrays and of work (size_t, uint32_t) are none.
DEFINITION = re.compile(r"^\s*(?:static |inline )?const(?:expr)? (?:double|int) (k[A-Z][^;]*);", re.M)
COLUMNS = ("where", "name", "value", "unit", "what it decides", "relative to", "guarded by")
UNKNOWN = "?"


def definitions(root=ROOT):
    """{(file, name): value}, in the order of the sources."""
    found = {}
    for pattern in SOURCES:
        for path in sorted(root.glob(pattern)):
            text = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
            for match in DEFINITION.finditer(text):
                for part in re.split(r",\s*(?=k[A-Z])", match[1]):
                    name, value = part.split("=", 1)
                    name = re.sub(r"\[.*", "", name).strip()
                    found[str(path.relative_to(root)), name] = " ".join(value.replace("std::numbers::", "").split())
    return found


def rows(text):
    """{(file, name): cells} of the table."""
    found = {}
    for line in text.splitlines():
        cells = [c.strip() for c in line.strip().strip("|").split("|")] if line.startswith("| `") else []
        if len(cells) == len(COLUMNS):
            found[cells[0].strip("`"), cells[1].strip("`")] = cells
    return found


def written(text, found):
    """The text with a table of what the sources define; what was said of a threshold stays."""
    said = rows(text)
    head = text[:text.index("| " + COLUMNS[0])]
    lines = ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    for (place, name), value in found.items():
        cells = said.get((place, name), [UNKNOWN] * len(COLUMNS))
        lines.append("| " + " | ".join([f"`{place}`", f"`{name}`", f"`{value}`", *cells[3:]]) + " |")
    return head + "\n".join(lines) + "\n"


def names_of_tests(root=ROOT):
    """"suite.name" of all tests of the solver."""
    pattern = re.compile(r"^TEST(?:_F|_P)?\((\w+),\s*(\w+)\)", re.M)
    return {f"{suite}.{name}" for path in (root / "tests").rglob("*_test.cpp")
            for suite, name in pattern.findall(path.read_text(encoding="utf-8"))}


if __name__ == "__main__":
    now = written(TABLE.read_text(encoding="utf-8"), definitions())
    if sys.argv[1:] == ["--write"]:
        TABLE.write_text(now, encoding="utf-8")
    else:
        sys.exit("usage: thresholds.py --write")
