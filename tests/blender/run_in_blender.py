"""Runs scripts in Blender's background mode, with a profile and a temporary folder of their own.

    run_in_blender.py SCRIPT    runs one whose last words are "N passed, M failed" (addon_case.py)

Files that it leaves in read_back/ are read by readers outside Blender (tests/hosts/hosts.py), which end with the same words.
"""
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
BLENDER = shlex.split(os.environ.get("SUNDER_BLENDER", "blender"))  # the words that start it (tests/hosts)
ADDON_ROOT = os.environ.get("SUNDER_ADDON_ROOT") or os.environ["SUNDER_BUILT_ADDON"]  # holds addons/sunder_addon and the zip


def environment(folder, scripts=None):
    """`scripts`: a folder that holds addons/; None for a clean profile."""
    names = {**os.environ, "BLENDER_USER_RESOURCES": str(folder / "profile"), "TMPDIR": str(folder / "tmp"),
             "PYTHONDONTWRITEBYTECODE": "1",
             # What is freed is overwritten at once: whoever still reads it crashes every time, and not now and then.
             "GLIBC_TUNABLES": "glibc.malloc.perturb=165:glibc.malloc.tcache_count=0",
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
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=290)


def _has_passed(done):
    """Prints what was told; the status alone would miss a script that never came to its end."""
    print(done.stdout)
    told = re.findall(r"^(\d+) passed, (\d+) failed$", done.stdout, re.MULTILINE)
    return done.returncode == 0 and len(told) == 1 and told[0][0] != "0" and told[0][1] == "0"


def _read_back(folder):
    """Whether readers found in files what they are to hold. Where they cannot be had that is told, and nothing has passed."""
    sys.path.insert(0, str(HERE.parent / "hosts"))
    import hosts

    try:
        python = hosts.prepare_readers()
    except hosts.Unavailable as error:
        print(f"WARNING: exports of Blender {' '.join(BLENDER)} were NOT READ BACK: {error}")
        return False
    return _has_passed(subprocess.run([python, "-B", HERE / "read_host_exports.py", folder], text=True, timeout=120,
                                      stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT))


def main(script):
    with tempfile.TemporaryDirectory() as folder:
        passed = _has_passed(blender(
            folder, "--factory-startup", "--addons", "sunder_addon", "--python-exit-code", "9", "--python-expr",
            f"import sys; sys.path.insert(0, {str(HERE)!r})", "--python", script, "--", folder, scripts=ADDON_ROOT))
        exports = Path(folder) / "read_back"
        if exports.exists():
            passed &= _read_back(exports)
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
