"""Blender's command line for `bpy`, the official build of Blender as a Python module: what tests and scripts use of it.

    python blender_module.py [-b] [--factory-startup] [--addons A,B] [FILE.blend] [--python-exit-code N]
        [--python-expr TEXT] [--python SCRIPT] [-- ARGUMENTS]

Arguments are executed in their order, as Blender does. The process ends without the module's own tidying up: 4.5 waits there for
a thread of its own for ever, once it has closed files. By itself the module starts with factory settings; without
`--factory-startup` the preferences and the startup file of the profile are read, as Blender reads them.
"""
import os
import runpy
import sys
import traceback

import bpy

import addon_utils  # of Blender: there once bpy is


def _run(script, status):
    """Calls what runs a script as __main__. With a status of errors an exception ends the process with it."""
    try:
        script()
    except SystemExit as end:
        _leave(end.code if isinstance(end.code, int) else end.code is not None)
    except BaseException:
        traceback.print_exc(file=sys.stdout)
        if status:
            _leave(status)


def _leave(status):
    sys.stdout.flush(), sys.stderr.flush()
    os._exit(status)


def main(arguments):
    given = arguments[:arguments.index("--")] if "--" in arguments else arguments
    if "--factory-startup" not in given:
        bpy.ops.wm.read_userpref()
        bpy.ops.wm.read_homefile()
    status, queue = 0, list(given)
    while queue:
        word = queue.pop(0)
        if word in ("-b", "--background", "--factory-startup"):
            continue
        if word == "--addons":
            for name in queue.pop(0).split(","):
                addon_utils.enable(name, persistent=True)
        elif word == "--python-exit-code":
            status = int(queue.pop(0))
        elif word == "--python-expr":
            text = queue.pop(0)
            _run(lambda: exec(text, {"__name__": "__main__"}), status)
        elif word == "--python":
            path = queue.pop(0)
            _run(lambda: runpy.run_path(path, run_name="__main__"), status)
        elif not word.startswith("-"):
            bpy.ops.wm.open_mainfile(filepath=os.path.abspath(word))
        else:
            sys.exit(f"blender_module.py: {word} is none of the options that it knows")


if __name__ == "__main__":
    main(sys.argv[1:])
    _leave(0)
