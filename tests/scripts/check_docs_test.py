"""scripts/check_docs finds names in documents that lead nowhere, and nothing in those that are right."""

import pathlib
import subprocess
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_docs"

CODE = {
    "core/tree.h": "class LeafTree {\n  void Build();\n};\n",
    "core/other.h": "void Elsewhere();\n",
    "proto/wellspace/v1/a.proto": "service Trees {\n  rpc Grow(A) returns (B);\n  rpc Fell(A) returns (B);\n}\n",
    "docs/calls.md": "| call | why |\n| --- | --- |\n| `Grow`, `Fell` | `Fell` is told apart |\n",
    "docs/glossary.md": "| word | means |\n| --- | --- |\n| tree, wood | a |\n| tree node | b |\n",
    "tests/core/tree_test.cc": "TEST(LeafTreeTest, SplitsLeaves) {}\n",
    "tests/core/other_test.cc": "TEST(OtherTest, IsElsewhere) {}\n",
}


class CheckDocsTest(unittest.TestCase):
    def run_with(self, line, calls=CODE["docs/calls.md"], words=""):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in {**CODE, "docs/calls.md": calls,
                               "docs/glossary.md": CODE["docs/glossary.md"] + words,
                               "docs/page.md": "# A page\n" + line + "\n"}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            result = subprocess.run([SCRIPT, root], capture_output=True, text=True, check=False)
            self.assertEqual(result.stderr, "")
            return result.returncode, result.stdout.splitlines()

    def test_accepts_what_is_there(self):
        for line in ("`core/tree.h`, `core/tree` and `core/*.h`",
                     "[tree](../core/tree.h) and [web](https://example.org)",
                     "`LeafTree::Build` and `LeafTree`",
                     "`LeafTreeTest.SplitsLeaves`, `LeafTreeTest.*`, `LeafTreeTest.Splits*`",
                     "tree_test: `SplitsLeaves` and `Splits…`", "`std::vector`, `--option`, `x + y`"):
            with self.subTest(line):
                self.assertEqual(self.run_with(line)[0], 0, self.run_with(line))

    def test_finds_what_is_not(self):
        for line, message in (("`core/trees.h`", "no such file or folder: core/trees.h"),
                              ("`core/*.cc`", "no such file or folder: core/*.cc"),
                              ("[tree](../core/trees.h)", "the link leads nowhere: ../core/trees.h"),
                              ("`LeafTree::Grow`", "not in the code: LeafTree::Grow"),
                              ("`LeafTree::Elsewhere`", "not in the code: LeafTree::Elsewhere"),
                              ("`LeafForest`", "not in the code: LeafForest"),
                              ("`LeafTreeTest.MergesLeaves`", "no such test: LeafTreeTest.MergesLeaves"),
                              ("tree_test: `IsElsewhere`", "no test IsElsewhere in tree_test")):
            with self.subTest(line):
                code, lines = self.run_with(line)
                self.assertEqual((code, lines), (1, [f"docs/page.md:2: {message}"]))

    def test_every_call_has_a_row(self):
        for calls, count in (("| `Grow` |\n| other | `Fell` |\n", 0), ("| `Grow`, `Fell` |\n| `Fell` |\n", 2)):
            code, lines = self.run_with("", calls)
            self.assertEqual((code, len(lines)), (1, 1), lines)
            self.assertIn(f"docs/calls.md:1: {count} rows for the call Fell of proto/wellspace/v1/a.proto", lines[0])

    def test_a_word_has_one_line(self):
        code, lines = self.run_with("", words="| leaf | c |\n\n| word | means |\n| --- | --- |\n| wood | d |\n")
        self.assertEqual((code, lines), (1, ["docs/glossary.md:9: wood has a line already, 3: a word means one thing"]))


if __name__ == "__main__":
    unittest.main()
