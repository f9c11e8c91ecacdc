"""Reads every #include of the tree and says which break the layers drawn in docs/architecture.md."""
import re
from pathlib import Path

# Who may include whom. A folder may always include itself; `solver` and `fracture_tools` do not see one another. In a
# layer each room sees those before it that are named, and what lies in no room of it sees them all.
MAY_INCLUDE = {
    "solver/data": set(),
    "solver/threads": {"solver/data"},
    "solver/lanes": set(),
    "solver/scene": {"solver/data", "solver/threads"},
    "solver/matching": {"solver/data", "solver/threads", "solver/lanes", "solver/scene"},
    "solver/material": {"solver/data", "solver/threads", "solver/lanes", "solver/scene", "solver/matching"},
    "solver/collision": {"solver/data", "solver/threads", "solver/lanes", "solver/scene", "solver/matching"},
    "solver/contacts/solve": {"solver/data", "solver/threads", "solver/lanes", "solver/scene", "solver/matching",
                              "solver/collision"},
    "solver/contacts/find": {"solver/data", "solver/threads", "solver/scene", "solver/matching", "solver/collision",
                             "solver/contacts/solve"},
    "solver/contacts/memory": {"solver/data", "solver/scene", "solver/contacts/solve"},
    "solver/pieces": {"solver/data", "solver/threads", "solver/scene", "solver/matching", "solver/contacts/solve"},
    "solver/step": {"solver/data", "solver/threads", "solver/scene", "solver/matching", "solver/material",
                    "solver/collision", "solver/contacts/solve", "solver/contacts/find", "solver/contacts/memory",
                    "solver/pieces"},
    "solver/sleep": {"solver/data", "solver/threads", "solver/scene", "solver/matching", "solver/collision",
                     "solver/step"},
    "solver/frame": {"solver/data", "solver/threads", "solver/scene", "solver/matching", "solver/material",
                     "solver/collision", "solver/step", "solver/sleep"},
    "solver": {"solver/data", "solver/threads", "solver/scene", "solver/matching", "solver/material", "solver/frame"},
    "fracture_tools/mesh": {"solver/data"},
    "fracture_tools/repair": {"solver/data", "fracture_tools/mesh"},
    "fracture_tools/cells": {"solver/data", "fracture_tools/mesh"},
    "fracture_tools/voronoi": {"solver/data", "fracture_tools/mesh", "fracture_tools/cells"},
    "fracture_tools/fragments": {"solver/data", "fracture_tools/mesh", "fracture_tools/repair", "fracture_tools/cells",
                                 "fracture_tools/voronoi"},
    "fracture_tools/skin": {"solver/data", "fracture_tools/mesh", "fracture_tools/fragments"},
    "fracture_tools": {"solver/data", "fracture_tools/mesh", "fracture_tools/repair", "fracture_tools/cells",
                       "fracture_tools/voronoi", "fracture_tools/fragments", "fracture_tools/skin"},
}
PHYSICS_AND_MESHES = {"solver", "solver/data", "solver/scene", "solver/threads", "fracture_tools", "fracture_tools/mesh",
                      "fracture_tools/repair", "fracture_tools/fragments", "fracture_tools/skin"}
MAY_INCLUDE |= {
    "nodes/files": PHYSICS_AND_MESHES,
    "nodes/graph": PHYSICS_AND_MESHES | {"nodes/files"},
    "nodes/types": PHYSICS_AND_MESHES | {"nodes/files", "nodes/graph"},
    "nodes/bake_files": PHYSICS_AND_MESHES | {"nodes/files", "nodes/graph"},
    "nodes/exports": PHYSICS_AND_MESHES | {"nodes/files", "nodes/graph", "nodes/types", "nodes/bake_files"},
    "nodes": PHYSICS_AND_MESHES | {"nodes/files", "nodes/graph", "nodes/types", "nodes/bake_files", "nodes/exports"},
    "plugin_src/packaging": {"solver/data"},  # the mathematical functions that it gives to libraries linked in
    "plugin_src": {"nodes", "nodes/files", "nodes/graph", "nodes/types", "nodes/bake_files", "nodes/exports"},
}
# Slow to compile, so they stay in few translation units: never in a header, never outside fracture_tools.
# Tests of fracture_tools may use them as an oracle.
SLOW_LIBRARIES = ("CGAL/", "openvdb/", "assimp/")
SLOW_LIBRARY_FOLDERS = ("fracture_tools", "tests/fracture_tools")
LONGEST_FILE = 500  # lines; a file that wants more wants to be two
C_FAMILY = {".h", ".hpp", ".c", ".cpp", ".cu", ".ipp"}
COUNTED = C_FAMILY | {".py", ".sh", ".cmake"}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')


def layer_of(path):
    """The folder of MAY_INCLUDE, the innermost, that a path from the root is in, or None (tests, system headers)."""
    folders = path.split("/")[:-1]
    for depth in range(len(folders), 0, -1):
        if (room := "/".join(folders[:depth])) in MAY_INCLUDE:
            return room
    return None


def check_include(source, line_number, target, root):
    where = f"{source}:{line_number}: includes {target}"
    if ".." in target.split("/"):
        yield f"{where}: paths start at the root of the repository"
        return
    if target.startswith(SLOW_LIBRARIES) and not (source.endswith(".cpp") and source.startswith(
            tuple(folder + "/" for folder in SLOW_LIBRARY_FOLDERS))):
        yield f"{where}: allowed only in .cpp files of fracture_tools"
    layer, target_layer = layer_of(source), layer_of(target)
    if layer is None or target_layer is None:
        return
    if target_layer != layer and target_layer not in MAY_INCLUDE[layer]:
        yield f"{where}: {layer} does not see {target_layer}"
    if not (root / target).is_file():
        yield f"{where}: there is no such file"


def source_files(root):
    for top in (*dict.fromkeys(name.split("/")[0] for name in MAY_INCLUDE), "tests"):
        yield from sorted(p for p in (root / top).rglob("*") if p.is_file())


def check(root):
    """Every violation under `root` as one sentence that starts with file:line."""
    root = Path(root)
    violations = []
    for file in source_files(root):
        source = file.relative_to(root).as_posix()
        if file.suffix not in COUNTED and file.name != "CMakeLists.txt":
            continue
        lines = file.read_text(encoding="utf-8").splitlines()
        if len(lines) > LONGEST_FILE:
            violations.append(f"{source}:{len(lines)}: longer than {LONGEST_FILE} lines")
        if file.suffix not in C_FAMILY:
            continue
        for number, line in enumerate(lines, 1):
            if match := INCLUDE.match(line):
                violations.extend(check_include(source, number, match.group(1), root))
    return violations
