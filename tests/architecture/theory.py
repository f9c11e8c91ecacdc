"""What docs/theory.md says of the code, and how: functions and files that it names, and the length of its sentences.

Also whether files that other docs name, and headings of it that comments name, are there.
"""
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
THEORY = ROOT / "docs" / "theory.md"
STEP, FRAME = "solver/step/step.cpp", "solver/frame/frame_steps.cpp"
# Stages that step.cpp calls are declared in these, and the box names them.
STAGES = ("solver/step/*.h", "solver/pieces/piece_motion.h")
NOT_STAGES = {"step", "for_all"}

# An eye takes in a line of this many characters, as in the other docs; a row of a table is a line whatever it holds.
LONGEST_LINE, LONGEST_ROW = 150, 260
# Words of a sentence on average. What is read with the paper in hand wants one thought a sentence; 20 is what plain
# technical English keeps to (ASD-STE100: at most 25 a sentence, 20 in procedures).
MOST_WORDS = 20
FEWEST_WORDS_OF_A_CELL = 6  # shorter cells of tables are numbers, names and units, no sentences

FENCED = re.compile(r"^```.*?^```", re.M | re.S)
PATH = re.compile(r"`([\w/]+\.(?:h|cpp|py))`")
ANY_PATH = re.compile(r"`([\w/*]+\.(?:h|cpp|py))`")
POINTER = re.compile(r'theory\.md,\s+(?://+\s*)?"([^"]+)"')
SOURCES = ("solver", "fracture_tools", "nodes", "plugin_src", "tests")
CALL = re.compile(r"\b(\w+)\(\)")


def without_comments(source, suffix):
    return re.sub(r"#.*" if suffix == ".py" else r"//.*", "", source)


def defines(source, suffix, name):
    """Whether a file declares or defines a function of that name; a call alone is neither."""
    text = without_comments(source, suffix)
    if suffix == ".py":
        return re.search(rf"^\s*def {name}\(", text, re.M) is not None
    # A return type, and perhaps a class, before the name; arguments and no operator before them.
    declaration = rf"^\s*(?:(?!return\b|else\b)[\w:<>,&*]+\s+)+[&*]*(?:\w+(?:<\w+>)?::)?{name}\("
    return re.search(declaration, text, re.M) is not None


def rows(text):
    """[cells] of the tables from sections or subjects to files and functions."""
    found, is_in_one = [], False
    for line in text.splitlines():
        if line.endswith("| file | function |"):
            is_in_one = True
        elif not line.startswith("|"):
            is_in_one = False
        elif is_in_one and not line.startswith("|--"):
            found.append([c.strip() for c in re.split(r"(?<!\\)\|", line.strip())[1:-1]])
    return found


def wrong_rows(text, root=ROOT):
    """What the tables name and is not there, as sentences."""
    wrong = []
    for cells in rows(text):
        path = root / cells[-2].strip("`")
        if not PATH.fullmatch(cells[-2]) or not path.is_file():
            wrong.append(f"{cells[0]}: there is no {cells[-2]}")
            continue
        source = path.read_text(encoding="utf-8")
        if not re.fullmatch(r"`\w+`(, `\w+`)*", cells[-1]):
            wrong.append(f"{cells[0]}: {cells[-1]} are no functions")
        for name in re.findall(r"\w+", cells[-1]):
            if not defines(source, path.suffix, name):
                wrong.append(f"{cells[0]}: {cells[-2]} has no function {name}")
    return wrong


def lost_files(text, root=ROOT):
    """Files that a text names in code style, by path or by name alone, and that are not there."""
    there = {p.name for top in SOURCES for p in (root / top).rglob("*")}
    return [path for path in ANY_PATH.findall(text)
            if not (any(root.glob(path)) if "/" in path else path in there)]


def lost_headings(text, root=ROOT):
    """(file, heading) of the headings that comments point to and the text has not; a heading may say more."""
    headings = [line.lstrip("# ") for line in text.splitlines() if line.startswith("#")]
    lost = []
    for path in (p for top in SOURCES for p in sorted((root / top).rglob("*"))):
        if path.suffix in (".h", ".cpp"):
            for name in POINTER.findall(path.read_text(encoding="utf-8")):
                if not any(re.match(rf"{re.escape(name)}\b", heading) for heading in headings):
                    lost.append((str(path.relative_to(root)), name))
    return lost


def boxes(text):
    """The fenced blocks: the step, and the steps of a frame."""
    return FENCED.findall(text)


def stages(root=ROOT):
    """Functions that step.cpp calls and the rooms of the step declare."""
    called = set(re.findall(r"\b(\w+)\(", without_comments((root / STEP).read_text(encoding="utf-8"), ".cpp")))
    headers = [p.read_text(encoding="utf-8") for pattern in STAGES for p in root.glob(pattern)]
    return {name for name in called - NOT_STAGES
            if any(re.search(rf"^[A-Za-z][\w:<>, ]*[ >&]{name}\(", text, re.M) for text in headers)}


def sentences(text):
    """Sentences of prose, list items and longer cells of tables; formulas and headings are none."""
    text = FENCED.sub("\n\n", text)
    units = [""]
    for line in text.splitlines():
        if not line.strip() or line.startswith(("#", "    ", "![")):
            units.append("")
        elif line.startswith("|"):
            cells = [c for c in re.split(r"(?<!\\)\|", line) if len(words(c)) >= FEWEST_WORDS_OF_A_CELL]
            units += [*cells, ""]
        elif re.match(r"\s*(?:[-*]|\d+\.)\s", line):
            units.append(line)
        else:
            units[-1] += " " + line
    found = []
    for unit in units:
        unit = re.sub(r"\*Measured:\*.*?(?=\*Why:|$)", "", unit)  # names of tests make short sentences of no prose
        unit = re.sub(r"`[^`]*`", "code", unit)
        unit = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", unit).replace("*Why:*", "").replace("*", "")
        unit = re.sub(r"\b(Eq|Fig|et al|[A-Z])\.(?=\s)", r"\1", unit)
        found += [s for s in re.split(r"(?<=[.!?])\)?\s+", unit) if words(s)]
    return found


def words(text):
    return [w for w in text.split() if re.search(r"[A-Za-z0-9]", w)]


def mean_length(text):
    found = sentences(text)
    return sum(len(words(s)) for s in found) / max(len(found), 1)


def long_lines(text):
    """Lines that are longer than lines are."""
    return [f"{n}: {len(line)} characters" for n, line in enumerate(text.splitlines(), 1)
            if len(line) > (LONGEST_ROW if line.startswith("|") else LONGEST_LINE)]


def departures(text):
    """List items that begin with what is done, in bold."""
    items = re.split(r"\n(?=- |\n|\||#)", text)
    return [item for item in items if item.lstrip("\n").startswith("- **")]
