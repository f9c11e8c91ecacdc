"""The add-on keeps to its rooms, and the check that says so is able to say no."""
import ast
import tempfile
import unittest
from pathlib import Path

from check_addon import MAY_IMPORT, PACKED, arrows, check, files, room_of, rounds

ADDON = Path(__file__).resolve().parents[2] / "plugin_src/blender/sunder_addon"
STARTS = {"__init__.py", "registration.py", "core.py"}  # Blender asks for the first, scripts for the last


class TheAddon(unittest.TestCase):
    def test_every_import_follows_an_arrow_that_is_drawn(self):
        self.assertEqual(check(ADDON), [])

    def test_every_arrow_that_is_drawn_is_followed(self):
        followed = {(room_of(name), room_of(target)) for name, seen in arrows(ADDON).items() for target in seen}
        for room, seen in MAY_IMPORT.items():
            if room:  # what starts the add-on may see all
                self.assertEqual({other for other in seen if (room, other) in followed}, seen, room)

    def test_no_arrows_go_round(self):
        self.assertEqual(rounds(MAY_IMPORT), set())
        self.assertEqual(rounds(arrows(ADDON)), set())  # not between files, either

    def test_whatever_does_not_start_the_addon_lies_in_a_room(self):
        self.assertEqual({name for name in files(ADDON) if room_of(name) == ""}, STARTS)

    def test_every_room_says_what_it_is_and_does_nothing_when_imported(self):
        for room in MAY_IMPORT.keys() - {""}:
            with self.subTest(room):
                said, = ast.parse((ADDON / room / "__init__.py").read_text()).body
                self.assertTrue(said.value.value)

    def test_what_the_packaging_adds_is_where_the_check_believes_it(self):
        packaging = (ADDON.parent / "package_addon.py").read_text()
        for name, source in PACKED.items():
            self.assertTrue((ADDON.parent / source).is_file())
            self.assertIn(f'"{source}"', packaging)
            self.assertIn(f'"{room_of(name)}/"', packaging)


class TheCheck(unittest.TestCase):
    def violations(self, sources):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in sources.items():
                path = Path(folder, "addon", name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            return check(Path(folder, "addon"))

    def assert_refused(self, sources, start, reason):
        found = self.violations(sources)
        self.assertEqual(len(found), 1, found)
        self.assertTrue(found[0].startswith(start), found[0])
        self.assertIn(reason, found[0])

    def test_arrows_that_are_drawn_pass(self):
        self.assertEqual(self.violations({
            "base/runtime.py": "import json\n", "base/core.py": "from . import runtime\n",
            "tree/trees.py": "from ..base import core, runtime\nfrom ..base.core import Refused\n",
            "core.py": "from .base.core import sunder\n",
            "registration.py": "import bpy\nfrom . import core\nfrom .tree import trees\n",
        }), [])

    def test_refuses_each_arrow_that_is_not_drawn(self):
        rooms = {f"{room}/x.py": "" for room in MAY_IMPORT if room}
        for room in MAY_IMPORT.keys() - {""}:
            for unseen in MAY_IMPORT.keys() - {"", room} - MAY_IMPORT[room]:
                with self.subTest(room=room, unseen=unseen):
                    for line in (f"from ..{unseen} import x", f"from ..{unseen}.x import y"):
                        self.assert_refused({**rooms, f"{room}/y.py": f"def f():\n    {line}\n"}, f"{room}/y.py:2:",
                                            f"{room} does not see {unseen}")

    def test_refuses_what_starts_the_addon_to_rooms(self):
        for line in ("from .. import core", "from ..core import sunder"):
            self.assert_refused({"core.py": "", "base/a.py": line}, "base/a.py:1:", "base does not see what starts the add-on")

    def test_refuses_an_import_of_nothing(self):
        self.assert_refused({"base/a.py": "from . import gone\n"}, "base/a.py:1:", "no such file")

    def test_refuses_a_room_that_nobody_drew(self):
        self.assert_refused({"attic/a.py": ""}, "attic/a.py:1:", "no room")

    def test_refuses_the_package_by_name(self):
        for line in ("import sunder_addon.core", "from sunder_addon.base import core"):
            self.assert_refused({"base/a.py": line}, "base/a.py:1:", "another name")

    def test_sees_arrows_between_files_that_go_round(self):
        self.assertEqual(rounds({"a": {"b"}, "b": {"a"}, "c": {"a"}, "d": set()}), {"a", "b", "c"})


if __name__ == "__main__":
    unittest.main()
