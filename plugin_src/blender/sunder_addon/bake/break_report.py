"""What broke in a tree's bake, when and why, and why the rest did not: the library's report, in rows that a person reads."""
import os

from ..base import core, runtime
from ..tree import trees
from . import cache

_MOST_FRAGMENTS = 10_000_000  # that can be asked about


class Row:
    """What one thing broke of one body in one frame.

    edges: how many; fragments: those they joined; time: of the first, s; strain and toughness of the edge that was strained
    most for its toughness, strain below 0 where it was pressed; by: what pushed, as text.
    """

    def __init__(self, first):
        self.frame, self.body, self.by = first["frame"], first["body"], _pusher(first)
        self.edges, self.fragments, self.time = 0, set(), first["time"]
        self.strain, self.toughness = first["strain"], first["toughness"]

    def add(self, edge):
        self.edges += 1
        self.fragments.update(edge["fragments"])
        self.time = min(self.time, edge["time"])
        if abs(edge["strain"]) * self.toughness > abs(self.strain) * edge["toughness"]:
            self.strain, self.toughness = edge["strain"], edge["toughness"]


def _pusher(edge):
    if edge["by_kind"] == "nothing":
        return "nothing"
    return "its own piece" if edge["by"] == edge["body"] else edge["by"]


def rows(told):
    """[Row, ...] by frame and, within one, by time."""
    found = {}
    for edge in told["breaks"]:
        key = edge["frame"], edge["solver"], edge["body"], edge["by_kind"], _pusher(edge)
        found.setdefault(key, Row(edge)).add(edge)
    return sorted(found.values(), key=lambda row: (row.frame, row.time))


def summary(told):
    """What broke, in a sentence."""
    first, last = told["frames"]
    range_ = f"frames {first} to {last}"
    if not told["broken"]:
        return f"nothing broke in {range_}"
    pieces = told["pieces"][-1]
    n = len({edge["frame"] for edge in told["breaks"]})
    return (f"{told['broken']} edges broke in {n} of {range_}; {pieces['pieces']} pieces, "
            f"the largest of {pieces['largest'][0]} fragments")


def why(load):
    """Why a fragment broke or did not, in a sentence."""
    share, toughness = load["share"], load["toughness"]
    if load["broken_edges"]:
        n = load["broken_edges"]
        return f"{n} of its edges broke, the first at {load['first_broken']:.3f} s" if n > 1 else \
            f"an edge of it broke at {load['first_broken']:.3f} s"
    if toughness is None:
        return "never breaks: its toughness is null, or it is glued"
    if share == 0:
        return "was never strained"
    if share >= 1:
        return ("was strained enough, and is whole: it was pressed, and compressive toughness is never; or a neighbour broke first "
                "and relieved it")
    if share > 0.9:
        return "nearly broke: another seed may break it"
    return f"wants {1 / share:.3g} times the load, or a toughness below {load['strain']:.3g}"


def numbers(text):
    """{3, 7, 8, 9} of "3, 7-9"; refuses what names no fragments."""
    found = set()
    for part in text.replace(" ", "").split(","):
        first, dash, last = part.partition("-")
        if not first.isdecimal() or dash and not last.isdecimal():
            raise core.Refused(f"'{text}' names no fragments: write all, or numbers and ranges as 3, 7-9")
        begin, end = int(first), int(last or first)
        if end < begin or end > _MOST_FRAGMENTS:
            raise core.Refused(f"'{text}' names no fragments: {part} is no range of them")
        found.update(range(begin, end + 1))
    return found


def as_text(fragments):
    """The shortest text of which `numbers` makes these."""
    parts = []
    for number in sorted(fragments):
        if parts and number == parts[-1][1] + 1:
            parts[-1][1] = number
        else:
            parts.append([number, number])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in parts)


def lack(tree):
    """Why a tree's bake can tell nothing; empty if it can."""
    manifest = cache.manifest(cache.folder(tree))
    if manifest is None or not manifest.numbers:
        return "nothing baked yet"
    if manifest.log is None:
        return "an earlier Sunder baked it and kept no log of what broke: bake it anew"
    return core.problem()


def stamp(tree):
    """What a report is of: another one where the bake went on or was made anew; empty where there is none."""
    folder = cache.folder(tree)
    manifest = cache.manifest(folder)
    return "" if manifest is None or manifest.log is None else f"{folder} {manifest.numbers[-1:]} {manifest.log}"


def read(tree, fragments=None, body=None):
    """What sunder.report tells of a tree's bake. Refuses (core.Refused) where that cannot be had, in a sentence."""
    problem = lack(tree)
    if problem:
        raise core.Refused(problem)
    sunder = core.sunder()
    try:
        return sunder.report(cache.folder(tree), fragments=fragments, body=body)
    except sunder.Error as error:
        again = ": it is being baked, read it again" if tree.cache_id in runtime.jobs else ""
        file = os.path.basename(error.where) + " " if os.path.isabs(error.where) else ""
        raise core.Refused(file + error.what + again) from error


def body_of(thing):
    """Name in the graph of the body that a result object shows in the bake that is there; empty if it shows none."""
    manifest = cache.manifest(cache.folder(thing.sunder.tree))
    fields = manifest.graph["nodes"].get(thing.sunder.node, {}) if manifest else {}
    return fields.get("body", "@").partition("@")[2].rpartition(".")[0]
