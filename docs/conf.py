"""How the site is built: `sphinx-build -W docs build/site`. It executes the gallery, and needs no network."""

import ast
import inspect
import os
import shutil
import textwrap
from importlib.metadata import version as installed
from pathlib import Path

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx_gallery.scrapers import figure_rst
from typer.main import get_command

from curvematch_jax.cli._app import app as command_line

os.environ["MPLBACKEND"] = "agg"

project = "curvematch_jax"
author = "The curvematch_jax authors"
copyright = f"2026, {author}"
version = release = installed("curvematch_jax")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["gallery"]
html_theme = "furo"
html_title = f"curvematch_jax {release}"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
suppress_warnings = ["config.cache"]  # the scraper below is a function

# Docstrings have Markdown's backticks: a name that is in the reference becomes a link, anything else is code.
default_role = "py:obj"
autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_inherit_docstrings = False
python_maximum_signature_line_length = 90
toc_object_entries_show_parents = "hide"
# Attributes of a class are its fields, and shown as parameters are.
napoleon_custom_sections = [("Attributes", "params_style")]
napoleon_use_rtype = False


def pictures_written(block, block_vars, gallery_conf):
    """The PNG files that a piece of an example has written, as its pictures; HTML files as frames."""
    folder, moved = Path(block_vars["src_file"]).parent, []
    for picture in sorted(folder.glob("*.png"), key=lambda path: path.stat().st_mtime_ns):
        moved.append(next(block_vars["image_path_iterator"]))
        shutil.move(picture, moved[-1])
    frames = [framed(page, Path(block_vars["target_file"]).parent) for page in folder.glob("*.html")]
    return figure_rst(moved, gallery_conf["src_dir"]) + "".join(frames)


def framed(page, folder):
    """An HTML file that is moved to a folder, in a frame of the example's page, as reStructuredText."""
    shutil.move(page, folder / page.name)
    return f'\n.. raw:: html\n\n    <iframe class="written" title="{page.name}" src="{page.name}"></iframe>\n'


sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "examples",
    "image_scrapers": (pictures_written,),
    "reset_modules": (),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "reference_url": {"curvematch_jax": None},
    "doc_module": ("curvematch_jax",),
}


def source_signature(app, what, name, thing, options, signature, returned):
    """Signatures as they are written, with the shapes of arrays, and with defaults by name instead of by value."""
    if what not in ("class", "function", "method") or not signature:
        return None
    node = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(thing)))).body[0]
    if isinstance(node, ast.FunctionDef):
        node.args.args = [argument for argument in node.args.args if argument.arg not in ("self", "cls")]
        return f"({ast.unparse(node.args)})", node.returns and ast.unparse(node.returns)
    fields = [ast.unparse(made_now(field)) for field in node.body if isinstance(field, ast.AnnAssign)]
    fields = [field for field in fields if "ClassVar" not in field and not field.startswith("_")]
    return (f"({', '.join(fields)})", None) if fields else None


def made_now(field):
    """A field of a dataclass with its default in place of the function that makes it."""
    match field.value:
        case ast.Call(ast.Name("field"), keywords=[ast.keyword("default_factory", ast.Lambda(body=default))]):
            field.value = default
        case ast.Call(ast.Name("field"), keywords=[ast.keyword("default_factory", factory)]):
            field.value = ast.Call(factory, [], [])
    return field


def skip_fields(app, what, name, thing, skip, options):
    """Fields are listed once, under the attributes of their class, and what scikit-learn adds is in its own docs."""
    if what != "class" or isinstance(thing, property):
        return None
    function = getattr(thing, "__func__", thing)
    return None if getattr(function, "__module__", "").startswith("curvematch_jax") else True


def write_commands(app):
    """The help of every command, as one page."""
    command = get_command(command_line)
    text = ["# Command line\n\n`curvematch` has these commands. `curvematch COMMAND --help` prints the same.\n"]
    for name, one in command.commands.items():
        context = one.make_context(f"curvematch {name}", [], resilient_parsing=True, max_content_width=100)
        text.append(f"## {name}\n\n```text\n{one.get_help(context)}\n```\n")
    page = Path(app.srcdir) / "reference" / "command_line.md"
    page.write_text("\n".join(text), encoding="utf-8")


def copy_framed(app, error):
    """The HTML files that examples have written, beside their pages: Sphinx copies only files that it knows."""
    for page in [] if error else (Path(app.srcdir) / "examples").glob("*.html"):
        shutil.copy(page, Path(app.outdir) / "examples")


def _mathml(self, node):
    self.body.append(tex2mathml(node.astext(), as_block=isinstance(node, nodes.math_block)))
    raise nodes.SkipNode


def setup(app):
    app.connect("builder-inited", write_commands, priority=100)
    app.connect("build-finished", copy_framed)
    app.connect("autodoc-process-signature", source_signature)
    app.connect("autodoc-skip-member", skip_fields)
    app.add_html_math_renderer("mathml", (_mathml, None), (_mathml, None))
