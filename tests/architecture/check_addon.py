"""Reads every import of the Blender add-on and says which break the arrows between its rooms (docs/architecture.md)."""
import ast
from pathlib import Path

# Who may import whom; a room may always import itself. What lies in no room starts the add-on: it sees every room, and
# no room sees it.
MAY_IMPORT = {
    "base": set(),
    "tree": {"base"},
    "scene": {"base", "tree"},
    "bake": {"base", "tree", "scene"},
    "results": {"base", "tree", "scene", "bake"},
    "preview": {"base", "tree", "bake", "results"},
    "exports": {"base", "tree", "bake", "results"},
    "interface": {"base", "tree", "scene", "bake", "results", "preview", "exports"},
    "": {"base", "tree", "scene", "bake", "results", "preview", "exports", "interface"},
}
PACKAGE = "sunder_addon"
# Where the packaging puts what lies beside the add-on in the sources, because scripts without it use them, too.
PACKED = {"base/bake_reader.py": "bake_reader.py", "base/blender_versions.py": "blender_versions.py"}


def files(addon):
    """{path in the add-on as it is packaged: path of the source}."""
    found = {p.relative_to(addon).as_posix(): p for p in sorted(addon.rglob("*.py"))}
    return found | {name: addon.parent / source for name, source in PACKED.items() if (addon.parent / source).is_file()}


def room_of(name):
    return name.split("/")[0] if "/" in name else ""


def imports(name, text, known):
    """(line, path of the file in the add-on that is imported) of a file's imports, wherever they stand in it. What is not
    there is named as it would be called."""
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        folder = name.split("/")[:-node.level]
        above = [*folder, *(node.module.split(".") if node.module else [])]
        if "/".join(above) + ".py" in known:
            yield node.lineno, "/".join(above) + ".py"
            continue
        for alias in node.names:
            yield node.lineno, "/".join([*above, alias.name]) + ".py"


def check_import(name, line, target, known):
    where = f"{name}:{line}: imports {target}"
    room, other = room_of(name), room_of(target)
    if target not in known:
        yield f"{where}: there is no such file"
    elif other != room and other not in MAY_IMPORT[room]:
        yield f"{where}: {room} does not see {other or 'what starts the add-on'}"


def rounds(arrows):
    """Names whose arrows go round, or lead to such; {name: those it sees}."""
    left = dict(arrows)
    while free := {name for name, seen in left.items() if not seen & left.keys()}:
        left = {name: seen for name, seen in left.items() if name not in free}
    return set(left)


def arrows(addon):
    """{file: files that it imports} of the add-on."""
    known = files(addon)
    return {name: {target for _, target in imports(name, path.read_text(encoding="utf-8"), known)}
            for name, path in known.items()}


def check(addon):
    """Every violation in the add-on as one sentence that starts with file:line."""
    addon, violations = Path(addon), []
    known = files(addon)
    for name, path in known.items():
        if room_of(name) not in MAY_IMPORT:
            violations.append(f"{name}:1: '{room_of(name)}' is no room of the table")
            continue
        text = path.read_text(encoding="utf-8")
        for line, target in imports(name, text, known):
            violations.extend(check_import(name, line, target, known))
        for node in ast.walk(ast.parse(text)):
            absolute = [node.module] if isinstance(node, ast.ImportFrom) and not node.level else []
            absolute += [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if any(n.split(".")[0] == PACKAGE for n in absolute):
                violations.append(f"{name}:{node.lineno}: imports {PACKAGE}: Blender may give the package another name")
    return violations
