"""The reference, as scripts/reference makes it of the docstrings: whole, without a warning, and without a network."""

import html.parser
import importlib.util
import inspect
import pathlib
import subprocess
import tempfile
import unittest
from unittest import mock

from support import PATIENCE, ROOT

import wellspace
import wellspace.aio


class Page(html.parser.HTMLParser):
    """The ids of a page, what it loads, and the names in lists of parameters, attributes and errors."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.loaded, self.terms = set(), [], []
        self._open = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.ids.add(given.get("id"))
        if tag in ("script", "img", "iframe"):
            self.loaded.append(given.get("src"))
        elif tag == "link":
            self.loaded.append(given.get("href"))
        if tag in ("dt", "strong"):
            self._open.append(tag)

    def handle_endtag(self, tag):
        if self._open and tag == self._open[-1]:
            self._open.pop()

    def handle_data(self, data):
        if self._open[-2:] == ["dt", "strong"]:
            self.terms.append(data)


@unittest.skipUnless(all(map(importlib.util.find_spec, ("sphinx", "numpydoc"))), "wants Sphinx and numpydoc")
class ReferenceTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        package = pathlib.Path(wellspace.__file__).parent.parent
        # Whatever would ask a network fails.
        nowhere = {"http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}
        with mock.patch.dict("os.environ", nowhere):
            cls.done = subprocess.run([ROOT / "scripts" / "reference", "--package", package, cls.folder],
                                      stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=3 * PATIENCE,
                                      check=False)
        cls.pages = {path.stem: Page(path) for path in cls.folder.glob("*.html")}

    def test_built_without_a_warning(self):
        self.assertEqual((self.done.returncode, self.done.stderr), (0, ""), self.done.stdout)
        self.assertEqual(self.done.stdout, f"reference: {self.folder}/index.html\n")

    def test_has_every_public_name(self):
        ids = set().union(*(page.ids for page in self.pages.values()))
        names = {f"wellspace.{name}" for name in wellspace.__all__ if not name.startswith("__")}
        names -= {"wellspace.errors", "wellspace.statistics"}  # modules, which have pages
        names |= {f"wellspace.aio.{name}" for name in wellspace.aio.__all__}
        names |= {f"wellspace.statistics.{name}" for name, thing in vars(wellspace.statistics).items()
                  if inspect.isclass(thing) and thing.__module__ == "wellspace.statistics"}
        for kind in (wellspace.Client, wellspace.Session, wellspace.Mesh, wellspace.aio.Session):
            module = "wellspace.aio" if kind is wellspace.aio.Session else "wellspace"
            names |= {f"{module}.{kind.__name__}.{name}" for name, value in vars(kind).items()
                      if not name.startswith("_") and callable(value)}
        # Those of statistics are there by one of their names.
        missing = {name for name in names if name not in ids
                   and name.replace("wellspace.", "wellspace.statistics.", 1) not in ids}
        self.assertEqual(missing, set())

    def test_every_term_is_a_name(self):
        """A sentence among them is one that Sphinx has taken for an argument."""
        terms = [term for page in self.pages.values() for term in page.terms]
        self.assertGreater(len(terms), 300)
        for term in terms:
            for name in term.replace("*", "").split(", "):
                self.assertTrue(name.isidentifier(), term)

    def test_arguments_that_are_described_once_are_everywhere(self):
        for name, count in (("size_boxes", 4), ("triangles", 2), ("segments", 2), ("rho", 4)):
            self.assertGreaterEqual(sum(page.terms.count(name) for page in self.pages.values()), count, name)

    def test_loads_nothing_from_elsewhere(self):
        for name, page in self.pages.items():
            self.assertEqual([one for one in page.loaded if one and "//" in one], [], name)


if __name__ == "__main__":
    unittest.main()
