"""Writes what nodes there are as types, from the descriptions that `sunder nodes --json` gives; a test holds them to it.

    ./sunder nodes --json | python3 plugin_src/python/write_stubs.py > plugin_src/python/sunder/_nodes.pyi

So a type checker refuses a misspelt parameter, and an editor shows the sentences. Nothing of it runs.
"""
import json
import keyword
import sys
import textwrap

HEAD = '''"""Node types and their parameters. Written by write_stubs.py from the nodes' descriptions."""
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Optional, SupportsFloat, SupportsIndex, Union, overload

import numpy.typing as npt

from .graph import Node

_Wire = str  # "@node.socket"
_Wires = Union[str, Sequence[str]]
_Animation = Mapping[str, Any]  # {"keys": [[frame, value], ...], "interpolation": "linear" or "step"}
_Number = Union[SupportsFloat, SupportsIndex]
_Integer = SupportsIndex
_Vector3 = Union[Sequence[float], npt.NDArray[Any]]
_Integer3 = Union[Sequence[int], npt.NDArray[Any]]
_Points = Union[Sequence[_Vector3], npt.NDArray[Any]]
_VertexGroups = Mapping[str, Union[Sequence[int], npt.NDArray[Any]]]
_Path = Union[str, PathLike[str]]
'''
TYPES = {"boolean": "bool", "choice": "str", "integer": "_Integer", "integer3": "_Integer3", "number": "_Number", "output_path": "_Path",
         "path": "_Path", "points": "_Points", "text": "str", "vector3": "_Vector3", "vectors": "_Points",
         "vertex_groups": "_VertexGroups"}
WIDTH = 120


def type_of(parameter):
    choices = parameter.get("choices", [])
    kind = f"Literal[{', '.join(map(json.dumps, choices))}]" if choices else TYPES[parameter["type"]]
    others = ["Literal[\"auto\"]"] * parameter["automatic"] + ["_Animation"] * parameter["animatable"]
    if others:
        kind = f"Union[{', '.join([kind, *others])}]"
    return f"Optional[{kind}]" if parameter["nullable"] else kind


def arguments(node):
    """[(name, type, sentence)] of a node's inputs and parameters."""
    wires = [(s["name"], "_Wires" if s["many"] else "_Wire", s["sentence"]) for s in node["inputs"]]
    units = [(p, f"{p['sentence']} [{p['unit']}]" if p["unit"] else p["sentence"]) for p in node["parameters"]]
    return wires + [(p["name"], type_of(p), sentence) for p, sentence in units]


def sentences(node):
    """Lines of the document: of inputs and what is seen at once, then group after group."""
    needs = {p["name"]: f" Needs {p['needs_text']}." for p in node["parameters"] if "needs" in p}
    group = {p["name"]: p["group"] for p in node["parameters"]}
    lines = {"": []}
    for name, _, sentence in arguments(node):
        lines.setdefault(group.get(name, ""), []).append(f"{name}: {sentence}.{needs.get(name, '')}")
    return [line for label, some in lines.items() for line in (["", f"{label}:"] if label else []) + some]


def overload(node):
    given = arguments(node)
    named = [f"{name}: {kind} = ..." for name, kind, _ in given if not keyword.iskeyword(name)]
    words = [name for name, _, _ in given if keyword.iskeyword(name)]
    lines = ["@overload", "def add(", "    self,", f"    type: Literal[{json.dumps(node['type'])}],", "    name: str,", "    *,",
             *(f"    {argument}," for argument in named), ") -> Node:"]
    if not named:
        lines.remove("    *,")
    document = [node["sentence"], "", *sentences(node)]
    if words:
        document += ["", *(f'{word}, a word of Python, is set in the node: node["{word}"] = ...' for word in words)]
    wrapped = (textwrap.fill(line, WIDTH - 8, subsequent_indent="    " if k else "") for k, line in enumerate(document))
    text = "\n".join(wrapped)
    text = text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    body = textwrap.indent(f'"""{text}\n"""', "    ")
    return textwrap.indent("\n".join(lines) + "\n" + body, "    ")


def stubs(nodes):
    """The stub's text for the descriptions of all node types."""
    names = ",\n".join(f"    {json.dumps(node['type'])}" for node in nodes)
    head = f"{HEAD}\nNodeType = Literal[\n{names},\n]\n\nclass AddsNodes:\n"
    return head + "\n".join(overload(node) + "\n" for node in nodes)


if __name__ == "__main__":
    sys.stdout.write(stubs(json.load(sys.stdin)["nodes"]))
