"""The manual page and bash's completion against --help of every command."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest

PROGRAM = os.path.join(os.environ["WELLSPACE_BIN_DIR"], "wellspace")


def run(*arguments):
    return subprocess.run([PROGRAM, *arguments], check=True, capture_output=True, text=True).stdout


def subcommands(*command):
    """The names below `Subcommands:` of a command's help."""
    section = run(*command, "--help").partition("Subcommands:\n")[2].partition("\n\n")[0]
    return [line.split()[0] for line in section.splitlines() if re.match(r"  \w", line)]


def leaves():
    for name in subcommands():
        below = subcommands(name)
        yield from ((name, other) for other in below) if below else ((name,),)


def options(command):
    """The long options in a command's help."""
    head = run(*command, "--help").partition("\nExit codes:")[0]
    return set(re.findall(r"^ +(?:-\w,)?(--[\w-]+)", head, re.MULTILINE))


class ManualTest(unittest.TestCase):
    def test_has_every_command_and_option(self):
        page = run("manual").replace("\\-", "-")
        names = list(leaves())
        commands = ("mesh estimate convert info upload refine watch cancel download cells add check render completion "
                    "manual")
        for name in commands.split():
            self.assertIn((name,), names)
        for name in ("create list show update delete").split():
            self.assertIn(("session", name), names)
        for name in ("info health").split():
            self.assertIn(("server", name), names)
        for command in names:
            section = page.partition('.SS "wellspace ' + " ".join(command))[2].partition("\n.S")[0]
            self.assertTrue(section, command)
            for option in options(command):
                self.assertIn(option, section, command)
        for part in (".SH NAME\n", ".SH EXIT STATUS\n", "130 ", "WELLSPACE_SERVER"):
            self.assertIn(part, page)

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_groff_has_nothing_to_say(self):
        result = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-z"], input=run("manual"), capture_output=True,
                                text=True, check=True)
        self.assertEqual(result.stderr, "")


class CompletionTest(unittest.TestCase):
    def complete(self, *words, folder="."):
        """What bash offers for the last of `words`."""
        line = " ".join(f"'{word}'" for word in ("wellspace", *words))
        script = (f'source "$1"; COMP_WORDS=({line}); COMP_CWORD={len(words)}; _wellspace; '
                  'printf "%s\\n" "${COMPREPLY[@]}"')
        with tempfile.NamedTemporaryFile("w") as completion:
            completion.write(run("completion", "bash"))
            completion.flush()
            result = subprocess.run(["bash", "-u", "-c", script, "bash", completion.name], cwd=folder,
                                    capture_output=True, text=True, check=True)
        self.assertEqual(result.stderr, "")
        return result.stdout.split()

    def test_commands(self):
        self.assertEqual(sorted(self.complete("")), sorted(subcommands()))
        self.assertEqual(self.complete("se"), ["session", "server"])
        self.assertEqual(sorted(self.complete("session", "")), sorted(subcommands("session")))
        self.assertEqual(self.complete("server", "h"), ["health"])
        self.assertEqual(self.complete("completion", ""), ["bash"])

    def test_options_of_every_command(self):
        for command in leaves():
            self.assertLessEqual(options(command), set(self.complete(*command, "--")), command)
        self.assertEqual(self.complete("mesh", "in.csv", "--size-"), ["--size-box"])

    def test_values(self):
        self.assertEqual(self.complete("mesh", "--criterion", ""), ["radius-edge", "well-spaced"])
        self.assertEqual(self.complete("session", "list", "--output", "j"), ["json"])
        self.assertEqual(self.complete("session", "list", "--ttl", ""), self.complete("session", "list", ""))
        self.assertEqual(self.complete("mesh", "--rho", ""), [])

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("cloud.csv", "other.npz"):
                open(os.path.join(folder, name), "w").close()
            self.assertEqual(self.complete("mesh", "cl", folder=folder), ["cloud.csv"])
            self.assertEqual(sorted(self.complete("mesh", "a.csv", "-o", "", folder=folder)),
                             ["cloud.csv", "other.npz"])


if __name__ == "__main__":
    unittest.main()
