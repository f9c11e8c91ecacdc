"""The tree keeps to its layers, and the check that says so is able to say no."""
import tempfile
import unittest
from pathlib import Path

from check_architecture import LONGEST_FILE, MAY_INCLUDE, check

ROOT = Path(__file__).resolve().parents[2]


class TheTree(unittest.TestCase):
    def test_every_include_follows_an_arrow_that_is_drawn(self):
        self.assertEqual(check(ROOT), [])

    def test_the_check_reads_the_real_sources(self):
        for layer in MAY_INCLUDE:
            self.assertTrue(any((ROOT / layer).glob("*.cpp")) or any((ROOT / layer).glob("**/*.h")), layer)

    def test_every_room_is_in_the_table(self):
        for layer in ("solver", "fracture_tools", "nodes"):
            for room in (ROOT / layer).iterdir():
                inner = {f"{layer}/{room.name}/{r.name}" for r in room.iterdir() if r.is_dir()} if room.is_dir() else ()
                self.assertTrue(not room.is_dir() or f"{layer}/{room.name}" in MAY_INCLUDE or
                                inner and inner <= MAY_INCLUDE.keys(), room)

    def test_no_arrows_go_round(self):
        left = {room: set(seen) for room, seen in MAY_INCLUDE.items()}
        while left:
            free = {room for room, seen in left.items() if not seen & left.keys()}
            self.assertTrue(free, left)
            left = {room: seen for room, seen in left.items() if room not in free}


class TheCheck(unittest.TestCase):
    def violations(self, files):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                path = Path(folder, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            return check(folder)

    def assert_refused(self, files, start, reason):
        found = self.violations(files)
        self.assertEqual(len(found), 1, found)
        self.assertTrue(found[0].startswith(start), found[0])
        self.assertIn(reason, found[0])

    def test_arrows_that_are_drawn_pass(self):
        self.assertEqual(self.violations({
            "solver/data/a.h": "#include <vector>\n",
            "solver/b.cpp": '#include "solver/data/a.h"\n',
            "fracture_tools/c.h": '#include "solver/data/a.h"\n',
            "fracture_tools/c.cpp": '#include <CGAL/Mesh_3.h>\n#include "fracture_tools/c.h"\n',
            "nodes/d.h": '#include "solver/data/a.h"\n#include "fracture_tools/c.h"\n',
            "plugin_src/cli/e.cpp": '#include "nodes/d.h"\n',
            "tests/solver/f.cpp": '#include "solver/data/a.h"\n#include "nodes/d.h"\n',
        }), [])

    def test_refuses_each_arrow_that_is_not_drawn(self):
        headers = {f"{layer}/x.h": "" for layer in MAY_INCLUDE}
        for layer, unseen in (("solver/data", "solver"), ("solver", "fracture_tools"), ("solver", "nodes"),
                              ("fracture_tools", "solver"), ("fracture_tools", "nodes"), ("nodes", "plugin_src"),
                              ("plugin_src", "solver"), ("plugin_src", "fracture_tools"),
                              ("solver/scene", "solver/matching"), ("solver/contacts/solve", "solver/contacts/find"),
                              ("nodes", "solver/contacts/solve"), ("solver/pieces", "solver/step"), ("fracture_tools/mesh", "fracture_tools/skin")):
            with self.subTest(layer=layer, unseen=unseen):
                self.assert_refused({**headers, f"{layer}/y.cpp": f'\n  #  include <{unseen}/x.h>\n'},
                                    f"{layer}/y.cpp:2:", f"{layer} does not see {unseen}")

    def test_refuses_slow_libraries_outside_fracture_tools_sources(self):
        for file in ("fracture_tools/a.h", "nodes/a.cpp", "solver/a.cpp", "plugin_src/a.cpp", "tests/solver/a.cpp"):
            for library in ("CGAL/Mesh_3.h", "openvdb/openvdb.h", "assimp/Importer.hpp"):
                with self.subTest(file=file, library=library):
                    self.assert_refused({file: f"#include <{library}>\n"}, f"{file}:1:", "allowed only in .cpp")

    def test_refuses_paths_that_do_not_start_at_the_root(self):
        self.assert_refused({"nodes/a.cpp": '#include "../solver/x.h"\n'}, "nodes/a.cpp:1:", "start at the root")

    def test_refuses_an_include_of_nothing(self):
        self.assert_refused({"nodes/a.cpp": '#include "solver/gone.h"\n'}, "nodes/a.cpp:1:", "no such file")

    def test_refuses_files_that_grew_too_long(self):
        self.assertEqual(self.violations({"nodes/a.cpp": "\n" * LONGEST_FILE}), [])
        self.assert_refused({"nodes/a.cpp": "\n" * (LONGEST_FILE + 1)}, "nodes/a.cpp:501:", "longer than 500")


if __name__ == "__main__":
    unittest.main()
