"""Runs scripts in Blender's background mode, with a profile and a temporary folder of their own.

    run_in_blender.py SCRIPT    runs one whose last words are "N passed, M failed" (addon_case.py)
"""
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

BLENDER = shlex.split(os.environ.get("SUNDER_BLENDER", "blender"))  # the words that start it (tests/hosts)
ADDON_ROOT = os.environ["SUNDER_ADDON_ROOT"]  # holds addons/sunder_addon and the zip


def environment(folder, scripts=None):
    """`scripts`: a folder that holds addons/; None for a clean profile."""
    names = {**os.environ, "BLENDER_USER_RESOURCES": str(folder / "profile"), "TMPDIR": str(folder / "tmp"),
             "PYTHONDONTWRITEBYTECODE": "1",
             "PATH": "/usr/bin:" + os.environ["PATH"]}  # Debian's Blender takes the first python3 there for its own
    for name in ("DISPLAY", "SUNDER_LIBRARY", "PYTHONPATH", "BLENDER_USER_SCRIPTS"):
        names.pop(name, None)
    if scripts:
        names["BLENDER_USER_SCRIPTS"] = str(scripts)
    (folder / "tmp").mkdir(exist_ok=True)
    return names


def blender(folder, *arguments, scripts=None):
    """The finished process, its two outputs as one text. Arguments are executed in their order."""
    return subprocess.run([*BLENDER, "-b", *map(str, arguments)], env=environment(Path(folder), scripts), text=True,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=120)


def main(script):
    with tempfile.TemporaryDirectory() as folder:
        done = blender(folder, "--factory-startup", "--addons", "sunder_addon", "--python-exit-code", "9", "--python-expr",
                       f"import sys; sys.path.insert(0, {str(Path(__file__).resolve().parent)!r})", "--python", script,
                       "--", folder, scripts=ADDON_ROOT)
    print(done.stdout)
    told = re.findall(r"^(\d+) passed, (\d+) failed$", done.stdout, re.MULTILINE)
    # The status alone would miss a script that never came to its end.
    return 0 if done.returncode == 0 and len(told) == 1 and told[0][0] != "0" and told[0][1] == "0" else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
