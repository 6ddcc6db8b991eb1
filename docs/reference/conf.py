"""Sphinx's configuration of the reference of the Python package; `scripts/reference` builds it, from the docstrings."""

import wellspace

project = "wellspace"
author = "The Wellspace authors"
copyright = author
version = release = wellspace.__version__
language = "en"
# No extension asks a network: links lead to pages of the reference alone.
extensions = ["sphinx.ext.autodoc", "numpydoc", "sphinx.ext.viewcode"]

# Docstrings have names of arguments and attributes in single backticks.
default_role = "code"
numpydoc_show_class_members = False  # autodoc has them
numpydoc_class_members_toctree = False
autodoc_member_order = "bysource"
# The docstring of an argument has its type. Some functions take fifty of them.
autodoc_typehints = "none"
autodoc_default_options = {"members": True}
add_module_names = False

html_theme = "alabaster"
html_title = f"wellspace {version}"
html_theme_options = {"description": "Quality simplicial meshes, from Python", "page_width": "70em",
                      "show_powered_by": False}
html_show_sphinx = False
html_copy_source = False
