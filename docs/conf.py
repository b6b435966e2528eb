"""Sphinx: how the site is made. tools/documentation puts its pages together first."""

from importlib.metadata import version as installed

project = "seatruth"
author = "the seatruth developers"
copyright = "2026, the seatruth developers"
version = release = installed("seatruth")

extensions = ["myst_nb", "sphinx_copybutton"]
exclude_patterns = ["figures/README.md"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 4

nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_merge_streams = True

html_theme = "furo"
html_title = f"seatruth {release}"
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

# Where the network is not to be had, `make docs` still checks every link inside the site.
linkcheck_timeout = 20
linkcheck_retries = 2
