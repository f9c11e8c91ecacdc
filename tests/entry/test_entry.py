"""The entry script, on a stand-in project whose program is a shell script: what is handed on, what is told, how it ends."""
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

CMAKE_LISTS = """
cmake_minimum_required(VERSION 3.25)
project(stand_in LANGUAGES NONE)
add_custom_command(OUTPUT "${CMAKE_BINARY_DIR}/plugin_src/sunder" COMMAND cp "${CMAKE_SOURCE_DIR}/program.sh" plugin_src/sunder
  DEPENDS "${CMAKE_SOURCE_DIR}/program.sh" VERBATIM)
add_custom_target(sunder ALL DEPENDS "${CMAKE_BINARY_DIR}/plugin_src/sunder")
enable_testing()
file(GLOB scripts CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/*.sh")  # as the real one has
include(${CMAKE_SOURCE_DIR}/tests.cmake)
"""
PROGRAM = """#!/bin/bash
case $1 in
  show) printf '<%s>' "$PWD" "${@:2}" ;;
  end) exit "$2" ;;
  wait) trap 'echo asked to end; exit 130' INT; echo waiting; for i in {1..400}; do sleep 0.05; done ;;
  bake) exec "$0" wait ;;
esac
"""


class Entry(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.home = Path(folder.name)
        self.project = self.home / "a project"
        (self.project / ".ci").mkdir(parents=True)
        for name in ("sunder", ".ci/run"):
            shutil.copy(ROOT / name, self.project / name)
        (self.project / "tests/scripted/usd_reader").mkdir(parents=True)
        (self.project / "build/usd_reader/node_modules/tinyusdz").mkdir(parents=True)  # as if it had been installed
        self.write("build/usd_reader/node_modules/tinyusdz/tinyusdz.mjs", "")
        for folder in ("tests/scripted/usd_reader", "build/usd_reader"):
            self.write(f"{folder}/package-lock.json", "{}")
        self.write("CMakeLists.txt", CMAKE_LISTS)
        self.write("tests.cmake", "")
        self.write("program.sh", PROGRAM)
        (self.project / "program.sh").chmod(0o755)

    def write(self, name, text):
        (self.project / name).write_text(text)

    def run_entry(self, *arguments, script="sunder", cwd=None):
        return subprocess.run(["bash", self.project / script, *arguments], cwd=cwd or self.home, text=True, capture_output=True)

    def result_of(self, tests, *options):
        self.write("tests.cmake", tests)
        done = self.run_entry(*options, script=".ci/run")
        lines = [line for line in done.stdout.splitlines() if re.fullmatch(r"\d+ passed, \d+ failed", line)]
        return done.returncode, lines

    def test_the_reader_of_usd_is_installed_when_its_lock_file_changes(self):
        npm = self.home / "bin/npm"
        npm.parent.mkdir()
        npm.write_text(f"#!/bin/sh\necho \"$@\" >> {self.home}/asked\n"
                       "mkdir -p \"$3/node_modules/tinyusdz\" && touch \"$3/node_modules/tinyusdz/tinyusdz.js\"\n")
        npm.chmod(0o755)
        environment = {**os.environ, "PATH": f"{npm.parent}:{os.environ['PATH']}"}
        self.write("tests.cmake", "add_test(NAME a COMMAND true)")
        self.write("tests/scripted/usd_reader/package.json", "{}")
        self.write("tests/scripted/usd_reader/package-lock.json", '{"lockfileVersion": 3}')
        done = subprocess.run(["bash", self.project / "sunder", "test"], env=environment, text=True, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex((self.home / "asked").read_text(), r"^ci --prefix .*build/usd_reader .*\n$")
        works = npm.read_text()
        npm.write_text("#!/bin/sh\necho no network; exit 1\n")
        self.write("tests/scripted/usd_reader/package-lock.json", '{"lockfileVersion": 4}')
        done = subprocess.run(["bash", self.project / "sunder", "test"], env=environment, text=True, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("no network", done.stderr)
        self.assertEqual(done.stderr.count("WARNING: npm could not install tinyusdz"), 2)  # before and after the tests
        npm.write_text(works)
        done = subprocess.run(["bash", self.project / "sunder", "test"], env=environment, text=True, capture_output=True)
        self.assertNotIn("WARNING", done.stderr)

    def test_the_official_blender_is_taken_in_or_missed_loudly(self):
        (self.project / "tests/hosts").mkdir(parents=True)
        self.write("ask.sh", "#!/bin/sh\necho \"$SUNDER_BLENDER.\" >> asked\n")
        (self.project / "ask.sh").chmod(0o755)
        self.write("tests.cmake", 'add_test(NAME a COMMAND "${CMAKE_SOURCE_DIR}/ask.sh")\nadd_test(NAME b COMMAND true)\n'
                   "set_tests_properties(a PROPERTIES LABELS blender_host)")
        self.write("tests/hosts/hosts.py", "print('the official one')")
        done = self.run_entry("test")
        self.assertEqual((done.returncode, done.stdout.splitlines()[-1]), (0, "3 passed, 0 failed"), done.stderr)
        self.assertEqual((self.project / "build/asked").read_text(), ".\nthe official one.\n")
        self.write("tests/hosts/hosts.py", "import sys\nsys.exit('no wheel')")
        done = self.run_entry("test")
        self.assertEqual((done.returncode, done.stdout.splitlines()[-1]), (0, "2 passed, 0 failed"), done.stderr)
        self.assertRegex(done.stderr, "(?s)no wheel.*WARNING: the official Blender .* was NOT TESTED")

    def test_chart_tells_what_it_takes(self):
        for wrong in (["--fast"], ["-o"]):
            done = self.run_entry("chart", *wrong)
            self.assertEqual(done.returncode, 2)
            self.assertIn("error", done.stderr)

    def test_package_takes_nothing(self):
        done = self.run_entry("package", "windows")
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("error: package takes nothing, not windows", done.stderr)

    def test_hands_arguments_on_from_any_folder(self):
        elsewhere = self.home / "some where"
        elsewhere.mkdir()
        done = self.run_entry("show", "a b", "", "*", "--set=x y", cwd=elsewhere)
        self.assertEqual(done.stdout, f"<{elsewhere}><a b><><*><--set=x y>")
        self.assertEqual(done.returncode, 0)

    def test_works_through_a_link(self):
        (self.home / "link").symlink_to(self.project / "sunder")
        done = subprocess.run([self.home / "link", "show", "x"], cwd=self.home, text=True, capture_output=True)
        self.assertEqual(done.stdout, f"<{self.home}><x>")

    def test_passes_exit_statuses_through(self):
        for status in (0, 1, 2, 3, 130):
            self.assertEqual(self.run_entry("end", str(status)).returncode, status)

    def test_says_nothing_of_its_own_once_built(self):
        self.run_entry("end", "0")
        done = self.run_entry("end", "0")
        self.assertEqual([done.stdout, done.stderr], ["", ""])

    def test_rebuilds_what_changed(self):
        self.run_entry("end", "0")
        time.sleep(0.01)
        self.write("program.sh", PROGRAM.replace("exit \"$2\"", "exit 42"))
        self.assertEqual(self.run_entry("end", "0").returncode, 42)

    def test_a_moved_checkout_is_configured_anew(self):
        self.run_entry("end", "0")
        self.project = self.project.rename(self.home / "moved")
        self.assertEqual(self.run_entry("end", "3").returncode, 3)

    def test_a_failing_build_fails_loudly_and_next_time_again(self):
        self.write("CMakeLists.txt", CMAKE_LISTS + "message(FATAL_ERROR \"needs a thing\")\n")
        for _ in range(2):
            done = self.run_entry("end", "0", script="sunder")
            self.assertNotEqual(done.returncode, 0)
            self.assertIn("needs a thing", done.stderr)
        self.write("CMakeLists.txt", CMAKE_LISTS.replace("COMMAND cp", "COMMAND false"))
        self.assertEqual(self.run_entry(script=".ci/run").returncode, 1)

    def test_reports_passed_tests(self):
        self.assertEqual(self.result_of("add_test(NAME a COMMAND true)\nadd_test(NAME b COMMAND true)"),
                         (0, ["2 passed, 0 failed"]))

    def test_reports_failed_tests(self):
        status, lines = self.result_of("add_test(NAME a COMMAND true)\nadd_test(NAME b COMMAND false)")
        self.assertEqual(lines, ["1 passed, 1 failed"])
        self.assertNotEqual(status, 0)

    def test_hands_ctest_options_on(self):
        self.assertEqual(self.result_of("add_test(NAME a COMMAND true)\nadd_test(NAME b COMMAND false)", "-R", "^a$"),
                         (0, ["1 passed, 0 failed"]))

    def test_fast_leaves_out_what_is_long_and_says_so(self):
        self.write("tests.cmake", "".join(f"add_test(NAME {name} COMMAND false)\nset_tests_properties({name} PROPERTIES LABELS {label})\n"
                                          for name, label in (("a", "long"), ("b", "blender"), ("c", "blender_host"))) +
                   "add_test(NAME d COMMAND true)\nadd_test(NAME e COMMAND false)")
        done = self.run_entry("test", "--fast", "-E", "^e$")
        self.assertEqual((done.returncode, done.stdout.splitlines()[-1]), (0, "1 passed, 0 failed"))
        self.assertRegex(done.stderr, "not run: .*stability.*Blender")
        self.assertNotEqual(self.run_entry("test", "--fast").returncode, 0)

    def test_what_only_all_runs_is_left_out_unless_it_is_asked_for(self):
        tests = "add_test(NAME a COMMAND true)\nadd_test(NAME b COMMAND false)\nset_tests_properties(b PROPERTIES LABELS all)"
        self.assertEqual(self.result_of(tests), (0, ["1 passed, 0 failed"]))
        self.assertEqual(self.result_of(tests, "--fast")[1], ["1 passed, 0 failed"])
        self.assertEqual(self.result_of(tests, "-L", "^all$")[1], ["0 passed, 1 failed"])

    def test_no_tests_is_a_failure(self):
        for options in ((), ("-R", "nothing is called so")):
            status, lines = self.result_of("", *options)
            self.assertNotEqual(status, 0)
            self.assertIn(lines, ([], ["0 passed, 0 failed"]))

    def test_a_test_that_could_not_run_counts_as_failed(self):
        could_not = ("add_test(NAME b COMMAND no_such_program)",
                     "add_test(NAME b COMMAND sh -c \"exit 77\")\nset_tests_properties(b PROPERTIES SKIP_RETURN_CODE 77)",
                     "add_test(NAME b COMMAND true)\nset_tests_properties(b PROPERTIES DISABLED TRUE)")
        for test in could_not:
            with self.subTest(test=test):
                status, lines = self.result_of("add_test(NAME a COMMAND true)\n" + test)
                self.assertEqual(lines, ["1 passed, 1 failed"])
                self.assertNotEqual(status, 0)

    def test_in_tests_on_debian_12_alone_a_warning_is_an_error(self):
        self.write("CMakeLists.txt", CMAKE_LISTS + 'file(WRITE "${CMAKE_BINARY_DIR}/strict" "${CMAKE_COMPILE_WARNING_AS_ERROR}.")')
        self.write("tests.cmake", "add_test(NAME a COMMAND true)")
        release = dict(re.findall(r'^(ID|VERSION_ID)="?(\w+)"?$', Path("/etc/os-release").read_text(), re.M))
        in_tests = "ON" if release == {"ID": "debian", "VERSION_ID": "12"} else ""
        # What tests were configured with stays, or each command would build all anew.
        for command, wanted in (("end", ""), ("test", in_tests), ("end", in_tests)):
            self.run_entry(command, "0") if command == "end" else self.run_entry(command)
            self.assertEqual((self.project / "build/strict").read_text(), f"{wanted}.", command)

    def test_an_interrupt_reaches_the_program_and_its_status_comes_back(self):
        for command in ("wait", "demo"):
            with self.subTest(command=command):
                self.run_entry("end", "0")
                job = subprocess.Popen(["bash", self.project / "sunder", command], cwd=self.home, text=True,
                                       stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
                self.assertEqual(job.stdout.readline(), "waiting\n")
                os.kill(job.pid, signal.SIGINT)
                out, _ = job.communicate(timeout=15)
                self.assertEqual([out, job.returncode], ["asked to end\n", 130])


if __name__ == "__main__":
    unittest.main()
