"""scripts/check_text finds planted lines, functions and subjects, and nothing in a right tree."""

import pathlib
import subprocess
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_text"


def function(name, lines):
    return f"int {name}(int x) {{\n" + "  ++x;\n" * lines + "}\n"


class CheckTextTest(unittest.TestCase):
    def run_with(self, files):
        """Runs the script on a folder with `files`; returns its exit code and lines."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in files.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            result = subprocess.run([SCRIPT, root], capture_output=True, text=True, check=False)
            self.assertEqual(result.stderr, "")
            return result.returncode, result.stdout.splitlines()

    def assert_found(self, files, start, message):
        code, lines = self.run_with(files)
        self.assertEqual((code, len(lines)), (1, 1), lines)
        self.assertTrue(lines[0].startswith(start), lines[0])
        self.assertIn(message, lines[0])

    def test_accepts_what_is_as_it_should_be(self):
        code, lines = self.run_with({
            "core/a.cc": "// " + "x" * 117 + "\n" + function("Short", 60),
            "README.md": "| " + "x" * 200 + " |\n```\n" + "x" * 200 + "\n```\n[a](" + "x" * 200 + ")\n",
        })
        self.assertEqual((code, len(lines)), (0, 1), lines)

    def test_wide_comment(self):
        self.assert_found({"core/a.h": "int x;\n// " + "x" * 118 + "\n"}, "core/a.h:2: ", "121 columns")

    def test_wide_comment_with_a_quote(self):
        self.assert_found({"core/a.h": '// "' + "x" * 117 + "\n"}, "core/a.h:1: ", "121 columns")
        self.assertEqual(self.run_with({"core/a.cc": 'f("' + "x" * 117 + '");\n'})[0], 0)

    def test_wide_line_of_a_proto(self):
        self.assert_found({"proto/a.proto": "// " + "x" * 118 + "\n"}, "proto/a.proto:1: ", "121 columns")

    def test_wide_line_of_a_document(self):
        self.assert_found({"docs/a.md": "# a\n\n" + "x " * 61 + "\n"}, "docs/a.md:3: ", "122 columns")
        self.assert_found({"docs/a.md": "|wx| is " + "x " * 61 + "\n"}, "docs/a.md:1: ", "130 columns")

    def test_long_function(self):
        self.assert_found({"core/a.cc": function("Long", 61)}, "core/a.cc:1: ", "Long has 61 lines")

    def test_long_function_that_is_listed(self):
        listed = {"core/a.cc": function("Long", 61), "scripts/long_functions.txt": "core/a.cc Long\n"}
        self.assertEqual(self.run_with(listed)[0], 0)

    def test_long_file(self):
        self.assert_found({"core/a.cc": "int x;\n" * 601}, "core/a.cc:600: ", "601 lines; at most 600")
        self.assertEqual(self.run_with({"core/a.cc": "int x;\n" * 600, "client/a.cc": "int x;\n" * 601})[0], 0)
        self.assert_found({"README.md": "a\n" * 131}, "README.md:130: ", "131 lines; at most 130")

    def test_large_class(self):
        members = "".join(f"  std::vector<int> name{i}_;\n  bool flag{i}_ = false;\n" for i in range(15))
        text = "class Large final : public Base {\n public:\n  int Count() const { return count_; }\n\n private:\n"
        self.assert_found({"core/a.h": text + members + "  int last_;\n  int count_{0};\n};\n"}, "core/a.h:1: ",
                          "Large has 32 private members; at most 30")
        self.assertEqual(self.run_with({"core/a.h": text + members + "};\nstruct B {\n  int last_;\n};\n"})[0], 0)

    def test_listed_function_that_is_no_longer_long(self):
        listed = {"core/a.cc": function("Long", 60), "scripts/long_functions.txt": "core/a.cc Long\n"}
        self.assert_found(listed, "scripts/long_functions.txt:1: ", "core/a.cc Long")

    def test_member_function_with_a_list_of_parameters_over_two_lines(self):
        text = "struct A {\n  int Long(int x,\n           int y) {\n" + "    ++x;\n" * 61 + "  }\n};\n"
        self.assert_found({"core/a.h": text}, "core/a.h:3: ", "Long has 61 lines")

    def test_python_of_the_package(self):
        wide = "x = '" + "x" * 115 + "'\n"
        self.assert_found({"client/python/a.py": "x = 1\n" + wide}, "client/python/a.py:2: ", "121 columns")
        body = "    x = 1\n" * 60
        self.assert_found({"examples/a.py": f"def long():\n    y = 1\n{body}"}, "examples/a.py:1: ",
                          "long has 61 lines")
        text = f'class A:\n  async def short(self):\n    """Two\n\n    lines."""\n{body}'
        self.assertEqual(self.run_with({"tests/client/a.py": text})[0], 0, "docstrings do not count")

    def test_wide_line_of_python_and_of_a_script(self):
        wide = "x" * 121 + "\n"
        self.assert_found({"bench/a.py": "\n" + wide}, "bench/a.py:2: ", "121 columns")
        self.assert_found({"scripts/a": "#!/bin/sh\n" + wide}, "scripts/a:2: ", "121 columns")
        self.assertEqual(self.run_with({"scripts/a": wide, "scripts/b.txt": "#!/bin/sh\n" + wide})[0], 0)

    def test_subjects(self):
        script = SCRIPT.read_text(encoding="utf-8")
        cases = (("core: " + "x" * 67, "73 characters"), ("Mend it", "no area"), ("core: " + "x" * 66, ""))
        for subject, message in cases:
            with self.subTest(subject), tempfile.TemporaryDirectory() as folder:
                git = ["git", "-C", folder, "-c", "user.name=a", "-c", "user.email=a@b.example"]
                subprocess.run([*git, "init", "--quiet"], check=True)
                for text in ("before the check", subject):
                    subprocess.run([*git, "commit", "--quiet", "--allow-empty", "--message", text], check=True)
                first = subprocess.run([*git, "rev-parse", "HEAD~1"], capture_output=True, text=True, check=True)
                # The check begins at a commit of this project, which the folder does not have.
                copy = pathlib.Path(folder) / "check_text"
                since = script.split('SINCE = "')[1].split('"')[0]
                copy.write_text(script.replace(since, first.stdout.strip()), encoding="utf-8")
                result = subprocess.run(["python3", copy, folder], capture_output=True, text=True, check=False)
                self.assertEqual(result.returncode, 1 if message else 0, result.stdout)
                self.assertIn(message, result.stdout)


if __name__ == "__main__":
    unittest.main()
