"""USD text as a tree, after the grammar of the format (openusd.org, "Usda file format"); knows nothing of who wrote it.

read(path) -> Prim: the pseudo root. Everything has to be understood: what is not raises ValueError with its line.
read_by_tinyusdz(path) -> Reading: the same by way of another program, which has its own idea of what is USD.
"""
import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np

_TOKEN = re.compile(r"""\s+|(?P<text>"(?:[^"\\\n]|\\.)*")|(?P<path><[^>\n]*>)|(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)
    |(?P<word>[A-Za-z_][A-Za-z0-9_:.]*)|(?P<mark>[\[\](){},;:=])""", re.VERBOSE)
_WIDTH = {"int": 1, "bool": 1, "color4f": 4, "token": 1, "string": 1, "float": 1, "float3": 3, "double3": 3, "quatf": 4, "color3f": 3, "point3f": 3, "vector3f": 3, "normal3f": 3, "texCoord2f": 2}


class Attribute:
    """value: of all times, or None; samples: {time: value}; metadata: {name: value}."""

    def __init__(self, kind):
        self.kind, self.value, self.samples, self.metadata = kind, None, {}, {}

    def at(self, time):
        """Held, as USD does where lengths differ; the default if there are no samples."""
        known = [t for t in self.samples if t <= time]
        return self.samples[max(known)] if known else self.value


class Prim:
    def __init__(self, kind="", name=""):
        self.kind, self.name, self.metadata, self.attributes, self.relations, self.children = kind, name, {}, {}, {}, {}

    def __getitem__(self, path):
        prim = self
        for name in path.split("/"):
            prim = prim.children[name]
        return prim


class _Reader:
    def __init__(self, text):
        if not text.startswith("#usda 1.0\n"):
            raise ValueError("no usda file")
        self.tokens, at = [], len("#usda 1.0")
        while at < len(text):
            found = _TOKEN.match(text, at)
            if not found:
                raise ValueError(f"line {text.count(chr(10), 0, at) + 1}: not understood: {text[at:at + 40]!r}")
            if found.lastgroup:
                self.tokens.append((found.lastgroup, found.group()))
            at = found.end()
        self.next = 0

    def peek(self):
        return self.tokens[self.next] if self.next < len(self.tokens) else ("end", "")

    def take(self, wanted=None):
        kind, text = self.peek()
        if wanted is not None and wanted not in (kind, text):
            raise ValueError(f"token {self.next}: {text!r} where {wanted} belongs")
        self.next += 1
        return text

    def accept(self, text):
        if self.peek()[1] == text and self.peek()[0] != "text":
            self.next += 1
            return True
        return False

    def value(self):
        kind, text = self.peek()
        if text in ("[", "("):
            close, items = {"[": "]", "(": ")"}[self.take()], []
            while not self.accept(close):
                items.append(self.value())
                if not self.accept(","):
                    self.take(close)
                    break
            return items
        self.take()
        if kind == "number":
            return float(text) if re.search("[.eE]", text) else int(text)
        if kind == "text":
            return re.sub(r"\\(.)", r"\1", text[1:-1])
        if kind == "path":
            return text
        raise ValueError(f"token {self.next}: {text!r} is no value")

    def metadata(self):
        fields = {}
        if self.accept("("):
            while not self.accept(")"):
                name = self.take("word")
                if name in ("prepend", "append", "delete", "add"):
                    name = self.take("word")
                self.take("=")
                fields[name] = self.value()
        return fields

    def typed(self, kind, value):
        """Arrays as numpy, rows of the type's width."""
        base = kind.rstrip("[]")
        if base not in _WIDTH:
            raise ValueError(f"unknown type {kind}")
        if not kind.endswith("[]"):
            return tuple(value) if isinstance(value, list) else value
        if base == "token":
            return value
        array = np.array(value, np.int64 if base in ("int", "bool") else np.float64)
        if _WIDTH[base] > 1:
            array = array.reshape(-1, _WIDTH[base])
        elif array.ndim != 1:
            raise ValueError(f"{kind} has tuples")
        return array

    def property(self, prim):
        if self.accept("rel"):
            name = self.take("word")
            self.take("=")
            prim.relations[name] = self.take("path")
            return
        self.accept("uniform")
        kind = self.take("word")
        if self.accept("["):
            self.take("]")
            kind += "[]"
        name = self.take("word")
        base, _, role = name.rpartition(".")
        if role not in ("timeSamples", "connect"):
            base, role = name, ""
        attribute = prim.attributes.setdefault(base, Attribute(kind))
        if attribute.kind != kind:
            raise ValueError(f"{base} has two types")
        if role == "timeSamples":
            self.take("=")
            self.take("{")
            while not self.accept("}"):
                time = float(self.take("number"))
                self.take(":")
                if time in attribute.samples:
                    raise ValueError(f"{base} has two samples at {time}")
                attribute.samples[time] = self.typed(kind, self.value())
                if not self.accept(","):
                    self.take("}")
                    break
        elif role == "connect":
            self.take("=")
            prim.relations[base] = self.take("path")
        elif self.accept("="):
            attribute.value = self.typed(kind, self.value())
        attribute.metadata.update(self.metadata())

    def prim(self):
        self.take("def")
        kind = self.take("word")
        prim = Prim(kind, self.take("text")[1:-1])
        prim.metadata = self.metadata()
        self.take("{")
        while not self.accept("}"):
            self.member(prim)
        return prim

    def member(self, prim):
        if self.peek() == ("word", "def"):
            child = self.prim()
            if child.name in prim.children or not re.fullmatch("[A-Za-z_][A-Za-z0-9_]*", child.name):
                raise ValueError(f"prim name {child.name!r} is there twice or is no name")
            prim.children[child.name] = child
        else:
            self.property(prim)


def parse(text):
    reader = _Reader(text)
    root = Prim()
    root.metadata = reader.metadata()
    while reader.peek()[0] != "end":
        root.children.update({p.name: p for p in [reader.prim()]})
    return root


def read(path):
    with open(path, encoding="utf-8") as file:
        return parse(file.read())


class Reading:
    """root: Prim of what tinyusdz understood, numbers rounded to 8 digits; meshes: {path: {name: flat array}} as it hands them
    to a renderer, at the first time."""

    def __init__(self, root, meshes):
        self.root, self.meshes = root, meshes


def why_there_is_no_tinyusdz():
    """What npm said when it could not bring it; "" where it is there, or was never asked for."""
    note = Path(os.environ["SUNDER_USD_READER"]) / "unavailable"
    return note.read_text() if note.is_file() else ""


def read_by_tinyusdz(path, has_meshes=True):
    """Without its meshes where a material takes colours of vertices: as of version 0.9.0 it has no idea how to render that, and
    takes UsdPrimvarReader_float for an error wherever it stands."""
    modules = Path(os.environ["SUNDER_USD_READER"]) / "node_modules"
    if not (modules / "tinyusdz").is_dir():
        raise FileNotFoundError(f"{modules}/tinyusdz is not there: `./sunder test` installs it")
    script = Path(__file__).with_name("usd_reader") / "read_usd.mjs"
    done = subprocess.run(["node", script, modules, path, *([] if has_meshes else ["layer"])], capture_output=True, timeout=60)
    if done.returncode:
        raise ValueError(done.stderr.decode()[-2000:])
    told = json.loads(done.stdout)
    return Reading(parse(told["text"]), {p: {n: np.array(v) for n, v in m.items()} for p, m in told["meshes"].items()})
