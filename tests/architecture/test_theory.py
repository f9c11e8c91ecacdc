"""docs/theory.md names files, functions and tests that there are, its box is the step, and it reads in an evening."""
import re
import tempfile
import unittest
from pathlib import Path

from check_architecture import MAY_INCLUDE
from theory import (CALL, FRAME, MOST_WORDS, ROOT, STEP, THEORY, boxes, defines, departures, long_lines, lost_files,
                    lost_headings, mean_length, rows, sentences, stages, words, wrong_rows)
from thresholds import names_of_tests


class TheTheory(unittest.TestCase):
    def setUp(self):
        self.text = THEORY.read_text(encoding="utf-8")

    def test_files_and_functions_of_its_tables_are_there(self):
        self.assertEqual(wrong_rows(self.text), [])

    def test_the_sections_and_equations_of_the_paper_are_found(self):
        named = [cells for cells in rows(self.text) if len(cells) == 4]
        sections = {cells[0].split()[0] for cells in named}
        self.assertLessEqual({"3.1", "3.2", "3.3", "3.4", "3.5", "4", "4.1", "4.2", "5"}, sections)
        equations = " ".join(cells[1] for cells in named)
        for equation in ("Eq. 1", "Eq. 2 to 8", "Eq. 9"):
            self.assertIn(equation, equations)

    def test_its_box_has_the_stages_of_the_step_and_no_others(self):
        self.assertEqual(set(CALL.findall(boxes(self.text)[0])), stages())

    def test_functions_of_the_frame_s_box_are_called_there(self):
        source = (ROOT / FRAME).read_text(encoding="utf-8")
        named = CALL.findall(boxes(self.text)[1])
        self.assertGreater(len(named), 5)
        self.assertEqual([name for name in named if not re.search(rf"\b{name}\(", source)], [])

    def test_departures_say_where_they_are_measured(self):
        self.assertGreater(len(departures(self.text)), 80)
        self.assertEqual([d[:60] for d in departures(self.text) if "*Measured:*" not in d], [])

    def test_tests_and_notes_that_it_names_are_there(self):
        there = names_of_tests()
        named = set(re.findall(r"`(\w+\.\w+)`", self.text)) - {"suite.case"}
        self.assertEqual({n for n in named if n not in there and not n.endswith((".h", ".cpp", ".py"))}, set())
        for link in re.findall(r"\]\(([^)#]+)\)", self.text):
            self.assertTrue((THEORY.parent / link).is_file(), link)

    def test_headings_that_comments_point_to_are_there(self):
        self.assertEqual(lost_headings(self.text), [])

    def test_sentences_are_short_on_average(self):
        self.assertGreater(len(sentences(self.text)), 300)
        self.assertLessEqual(mean_length(self.text), MOST_WORDS)

    def test_no_line_is_longer_than_lines_are(self):
        self.assertEqual(long_lines(self.text), [])


class TheArchitecture(unittest.TestCase):
    def setUp(self):
        self.text = (THEORY.parent / "architecture.md").read_text(encoding="utf-8")

    def test_files_that_docs_name_are_there(self):
        self.assertEqual(lost_files(self.text), [])
        self.assertEqual(lost_files(THEORY.read_text(encoding="utf-8")), [])

    def test_its_table_has_every_room(self):
        for room in MAY_INCLUDE:
            name = room.split("/", 1)[-1]
            self.assertTrue(f"`{room}`" in self.text or f"`{name}`" in self.text, room)


class TheCheck(unittest.TestCase):
    TABLE = "| section | equation | file | function |\n|---|---|---|---|\n| 3.9 Nothing | Eq. 0 | {} | {} |\n"

    def wrong(self, function, file="`solver/a.cpp`", source="// gone()\nint there(int x) {\n    return gone(x);\n}\n"):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "solver/a.cpp")
            path.parent.mkdir()
            path.write_text(source)
            return wrong_rows(self.TABLE.format(file, function), Path(folder))

    def test_a_file_that_is_gone_is_found(self):
        self.assertIn("no `solver/b.cpp`", self.wrong("`there`", "`solver/b.cpp`")[0])
        self.assertEqual(len(self.wrong("`there`", "solver/a.cpp")), 1)

    def test_a_function_that_is_gone_is_found_though_it_is_called_or_spoken_of(self):
        self.assertEqual(self.wrong("`there`"), [])
        self.assertIn("no function gone", self.wrong("`gone`")[0])
        self.assertEqual(len(self.wrong("`there`, `gone`")), 1)
        self.assertIn("are no functions", self.wrong("")[0])

    def test_declarations_of_all_kinds_are_known(self):
        for line in ("void f(int);", "    static Vec3 f();", "const Mat3& f() const;", "Status A::f(",
                     "double* f(int a) {", "std::vector<A> f(B b) {", "template <class V>\nvoid A<V>::f(int) {"):
            self.assertTrue(defines(line, ".h", "f"), line)
        for line in ("    f(1);", "return f(1);", "x = f(1);", "if (f(1)) {", "// int f(int);", "a.f(1);",
                     "int g(int f);"):
            self.assertFalse(defines(line, ".h", "f"), line)
        self.assertTrue(defines("def f(a):\n", ".py", "f"))

    def test_a_stage_that_is_new_or_gone_is_found(self):
        self.assertIn("tumble_pieces", stages())
        text = THEORY.read_text(encoding="utf-8")
        self.assertNotEqual(set(CALL.findall(boxes(text.replace("tumble_pieces()", ""))[0])), stages())
        with tempfile.TemporaryDirectory() as folder:
            for name, source in ((STEP, "void run() {\n    old();\n    fresh();\n}\n"),
                                 ("solver/step/a.h", "void old();\nStatus fresh();\n")):
                path = Path(folder, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(source)
            self.assertEqual(stages(Path(folder)), {"old", "fresh"})

    def test_sentences_are_those_of_prose_lists_and_tables(self):
        text = ("# A heading of no words\n\nOne two three.\nFour five (see Eq. 8). Six\nseven.\n\n    E = m c\n\n"
                "- An item\n  of four.\n  *Why:* it is.\n  *Measured:* `a.b`, `c.d`.\n\n"
                "| 1 | not six |\n|---|---|\n| 2 | this cell has more than six words |\n")
        self.assertEqual([len(words(s)) for s in sentences(text)], [3, 5, 2, 4, 2, 7])

    def test_long_sentences_and_lines_are_found(self):
        self.assertGreater(mean_length("word " * 30 + ". " + "word " * 12 + "."), MOST_WORDS)
        self.assertEqual(long_lines("x" * 150 + "\n|" + "x" * 258 + "|"), [])
        self.assertEqual(len(long_lines("x" * 151 + "\n|" + "x" * 259 + "|")), 2)

    def test_files_and_headings_that_are_gone_are_found(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "solver/step/a.h")
            path.parent.mkdir(parents=True)
            path.write_text('// As docs/theory.md has it (theory.md, "The step"; docs/theory.md,\n// "Gone").\n')
            text = "# T\n\n## The step (3.2)\n"
            self.assertEqual(lost_headings(text, Path(folder)), [("solver/step/a.h", "Gone")])
            named = "`solver/step/a.h`, `a.h`, `solver/step/*.h`, `solver/a.h`, `b.h`, `solver/step/*.cpp`"
            self.assertEqual(lost_files(named, Path(folder)), ["solver/a.h", "b.h", "solver/step/*.cpp"])

    def test_a_departure_that_is_not_measured_is_found(self):
        found = departures("\n- **One.** Why.\n  *Measured:* `a.b`.\n- **Two.** Why.\n\nText.\n- plain\n")
        self.assertEqual(["*Measured:*" in d for d in found], [True, False])


if __name__ == "__main__":
    unittest.main()
