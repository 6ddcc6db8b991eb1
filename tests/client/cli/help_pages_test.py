"""The manual page and the shells' completions against --help of every command."""

import os
import pathlib
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
        commands = ("mesh estimate convert info upload refine watch cancel download cells add check render view "
                    "completion manual")
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

    def test_the_page_of_the_documentation_is_it(self):
        page = pathlib.Path(__file__).resolve().parents[3] / "docs" / "cli.md"
        self.assertEqual(page.read_text(encoding="utf-8"), run("manual", "--format", "markdown"),
                         "make it anew: wellspace manual --format markdown > docs/cli.md")

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_groff_has_nothing_to_say(self):
        result = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-z"], input=run("manual"), capture_output=True,
                                text=True, check=True)
        self.assertEqual(result.stderr, "")


class BashTest(unittest.TestCase):
    def complete(self, *words, folder="."):
        """The completions that bash offers for the last of `words`."""
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
        self.assertEqual(self.complete("completion", ""), ["bash", "zsh", "fish"])

    def test_options_of_every_command(self):
        for command in leaves():
            self.assertLessEqual(options(command), set(self.complete(*command, "--")), command)
        self.assertEqual(self.complete("mesh", "in.csv", "--size-"),
                         ["--size-box", "--size-field", "--size-unit", "--size-field-between"])

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


def script_of(test, shell, name):
    """The shell's script in a folder of its own."""
    folder = tempfile.TemporaryDirectory()
    test.addCleanup(folder.cleanup)
    path = os.path.join(folder.name, name)
    with open(path, "w") as file:
        file.write(run("completion", shell))
    return path


@unittest.skipUnless(shutil.which("fish"), "fish is not installed")
class FishTest(unittest.TestCase):
    def setUp(self):
        self.script = script_of(self, "fish", "wellspace.fish")

    def complete(self, *lines):
        """The completions that fish offers at the end of each line: words without their descriptions."""
        commands = "".join(f"complete -C'wellspace {line}'; echo ---;" for line in lines)
        folder = os.path.dirname(self.script)
        result = subprocess.run(["fish", "-c", f"source {self.script}; {commands}"], capture_output=True, text=True,
                                check=True, cwd=folder, env=os.environ | {"HOME": folder})
        self.assertEqual(result.stderr, "")
        return [[word.partition("\t")[0] for word in part.splitlines()] for part in result.stdout.split("---\n")[:-1]]

    def test_options_of_every_command(self):
        commands = list(leaves())
        lines = (" ".join(command) + " --" for command in commands)
        for command, offered in zip(commands, self.complete(*lines)):
            self.assertLessEqual(options(command), set(offered), command)

    def test_words(self):
        lines = ("", "se", "session ", "completion ", "mesh --criterion ", "session list --output j", "mesh --rho ",
                 "mesh well", "mesh a.csv -o well")
        expected = (subcommands(), ["server", "session"], subcommands("session"), ["bash", "zsh", "fish"],
                    ["radius-edge", "well-spaced"], ["json"], [], ["wellspace.fish"], ["wellspace.fish"])
        for line, words, offered in zip(lines, expected, self.complete(*lines)):
            self.assertEqual(sorted(words), sorted(offered), line)


# zsh at a terminal of its own, which is given a line and a tab, until it shows the word that is looked for.
ZSH_AT_A_TERMINAL = r"""
zmodload zsh/zpty
zpty shell zsh -f -i
zpty -w shell "PS1=; fpath=($1 \$fpath); autoload -Uz compinit; compinit -D -u; bindkey '^I' list-choices"
zpty -w shell "print READY\$((1+1))"
zpty -r shell output '*READY2*'
zpty -w -n shell "$2"$'\t'
zpty -r shell output "*$3*"
zpty -d shell
"""


@unittest.skipUnless(shutil.which("zsh"), "zsh is not installed")
class ZshTest(unittest.TestCase):
    def setUp(self):
        self.script = script_of(self, "zsh", "_wellspace")

    def specifications(self, *words):
        """The arguments of zsh's own functions, as the script calls them for the last of `words`."""
        line = " ".join(f"'{word}'" for word in ("wellspace", *words))
        code = ('_arguments() { print -rl -- "$@" }; _describe() { print -rl -- "${(@P)2}" }; '
                f'words=({line}); CURRENT=$#words; source "$1"')
        result = subprocess.run(["zsh", "-f", "-c", code, "zsh", self.script], capture_output=True, text=True,
                                check=True)
        self.assertEqual(result.stderr, "")
        return result.stdout

    def test_options_of_every_command(self):
        for command in leaves():
            offered = self.specifications(*command, "--")
            self.assertLessEqual(options(command), set(re.findall(r"^\*(--[\w-]+)\[", offered, re.MULTILINE)), command)

    def test_words(self):
        for command in ((), ("session",), ("server",)):
            offered = re.findall(r"^(\w+):", self.specifications(*command, ""), re.MULTILINE)
            self.assertEqual(sorted(offered), sorted(subcommands(*command)))
        self.assertIn(":SHELL:(bash zsh fish)\n", self.specifications("completion", ""))
        self.assertRegex(self.specifications("mesh", ""), r"\*--criterion\[.*\]:value:\(radius-edge well-spaced\)\n")
        self.assertRegex(self.specifications("mesh", ""), r"\*--out\[.*\]:value:_files\n")

    def test_at_a_terminal(self):
        for line, shown in (("wellspace session c", "create "), ("wellspace mesh --criterion ", "well-spaced"),
                            ("wellspace server info --tls-c", "--tls-cert"), ("wellspace mesh a --quie", "--quiet")):
            subprocess.run(["zsh", "-f", "-c", ZSH_AT_A_TERMINAL, "zsh", os.path.dirname(self.script), line, shown],
                           capture_output=True, check=True, timeout=60)


if __name__ == "__main__":
    unittest.main()
