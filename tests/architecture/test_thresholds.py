"""The table of thresholds is that of the sources, and names tests that there are."""
import re
import unittest

from thresholds import TABLE, UNKNOWN, definitions, rows, names_of_tests, written


class Thresholds(unittest.TestCase):
    def setUp(self):
        self.text = TABLE.read_text(encoding="utf-8")

    def test_the_table_is_that_of_the_sources(self):
        self.assertEqual(written(self.text, definitions()), self.text,
                         "a threshold changed: run tests/architecture/thresholds.py --write, and say what it decides")

    def test_each_is_explained(self):
        for key, cells in rows(self.text).items():
            self.assertNotIn(UNKNOWN, cells, key)

    def test_tests_that_it_names_are_there(self):
        there = names_of_tests()
        for key, cells in rows(self.text).items():
            for name in re.findall(r"`(\w+\.\w+)`", cells[-1]):
                self.assertIn(name, there, key)

    def test_a_threshold_that_is_new_or_changed_is_found(self):
        found = dict(definitions())
        self.assertGreater(len(found), 40)
        key = next(iter(found))
        self.assertNotEqual(written(self.text, {**found, key: "17"}), self.text)
        self.assertNotEqual(written(self.text, {**found, ("solver/step/step.cpp", "kNew"): "1"}), self.text)
        del found[key]
        self.assertNotEqual(written(self.text, found), self.text)


if __name__ == "__main__":
    unittest.main()
