# SPDX-License-Identifier: MIT
"""Sphinx settings of the manual (`make site`). Loaded by Sphinx, which tools/site/make_site.py starts. No I/O."""

project = "Hodograph"
author = "the Hodograph developers"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 4
myst_enable_extensions: list[str] = []
nitpicky = True
html_theme = "furo"
html_title = "Hodograph"
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
html_show_sourcelink = False
templates_path: list[str] = []
html_static_path = ["static"]
html_css_files = ["manual.css"]
html_show_search_summary = False  # it would fetch pages, which browsers refuse from the disk
highlight_language = "text"
pygments_style = "friendly"
pygments_dark_style = "monokai"
smartquotes = False
