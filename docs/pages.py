"""What `make docs` adds to the pages of this folder: settings, reference, tutorial, root pages.

A hook of MkDocs (mkdocs.yml). All of it is made from what is elsewhere: the settings from the
sections of a scenario, the reference from docstrings, the tutorial from its notebook, and the
pages for those who carry the project on from CONTRIBUTING.md and CHANGELOG.md.
"""

import importlib
import json
import pkgutil
import re
from itertools import groupby
from pathlib import Path
from typing import Any

import human_gait
from docs.architecture import layers
from human_gait.scenario import Scenario
from human_gait.settings import Setting, all_settings

ROOT = Path(__file__).resolve().parent.parent
EMPTY = re.compile(r'\s\N{EN DASH}\s*<div class="doc-md-description">\s*</div>')
INSIDE = {
    "arguments",
    "cli",
    "console",
    "exits",
    "late",
}  # of the command, which the README explains
WINGS = [name for row in layers() for name in row if name not in INSIDE]


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that are made to those that are written."""
    from mkdocs.structure.files import File  # noqa: PLC0415 - the rest is tested without it

    for path, text in pages().items():
        files.append(File.generated(config, path, content=text))
    return files


def on_config(config: Any) -> Any:
    """List the wings under `Reference`, from top to bottom."""
    for entry in config.nav:
        if "Reference" in entry:
            entry["Reference"] = ["reference/index.md"] + [
                {name: f"reference/{name}.md"} for name in WINGS
            ]
    return config


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Lead links out of docs/ to the pages that stand for their targets."""
    del page, config, files
    return markdown.replace("](tutorial.ipynb)", "](tutorial.md)")


def on_page_content(html: str, page: Any, config: Any, files: Any) -> str:
    """Let long names in tables break, and leave out dashes with nothing behind them."""
    del page, config, files
    html = EMPTY.sub("", html)
    return re.sub(r"<td.*?</td>", lambda cell: breakable(cell.group()), html, flags=re.DOTALL)


def breakable(cell: str) -> str:
    """Return a cell of a table whose long names may break after ``_``, ``.`` and ``::``."""

    def broken(code: re.Match[str]) -> str:
        return "<code>" + re.sub(r"(_|::|[.](?=[a-z]))", r"\1<wbr>", code.group(1)) + "</code>"

    return re.sub(r"<code>([^<]{25,})</code>", broken, cell)


def on_post_build(config: Any) -> None:
    """Refuse a site that asks a server for a script, a font or a picture: it is read offline.

    Raises
    ------
    ValueError
        With the first page that does, and what it asks for.
    """
    for page in sorted(Path(config.site_dir).rglob("*.html")):
        asked = foreign(page.read_text(encoding="utf-8"))
        if asked:
            message = f"{page}: asks a server for {asked[0]}"
            raise ValueError(message)


def foreign(html: str) -> list[str]:
    """Return the scripts, styles and pictures that a page would fetch from a server."""
    tags = re.findall(r"<(?:script|link|img|iframe)\b[^>]*>", html)
    links = (re.search(r"(?:src|href)=[\"']?((?:https?:)?//[^\"' >]+)", tag) for tag in tags)
    return [link.group(1) for link in links if link]


def pages() -> dict[str, str]:
    """Return the text of every page that is made, by its path under docs/."""
    wings = {f"reference/{name}.md": wing_page(name) for name in WINGS}
    return {
        "settings.md": settings_page(),
        "tutorial.md": tutorial_page(),
        "own-costs.md": own_costs_page(),
        "contributing.md": root_page("CONTRIBUTING.md"),
        "changelog.md": root_page("CHANGELOG.md"),
        "reference/index.md": public_page(),
        **wings,
    }


def root_page(name: str) -> str:
    """Return a page of the project's root with its links as they are seen from docs/."""
    text = (ROOT / name).read_text(encoding="utf-8").replace("](docs/", "](")
    return text.replace("](README.md)", "](index.md)").replace(
        "](CONTRIBUTING.md", "](contributing.md"
    )


def own_costs_page() -> str:
    """Return what the README says of own costs and constraints, and the examples in full."""
    title = "Own costs and constraints"
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    text = readme.split(f"### {title}\n")[1].split("\n## ")[0]
    parts = [f"# {title}\n", text.replace("[docs/examples/](docs/examples/)", "`docs/examples/`")]
    for example in sorted((ROOT / "docs" / "examples").glob("*.py")):
        code = example.read_text(encoding="utf-8")
        parts.append(f"\n## {example.name}\n\n```python\n{code}```\n")
    return "".join(parts)


def tutorial_page() -> str:
    """Return the cells of the tutorial: text as it is, code as code."""
    notebook = json.loads((ROOT / "docs" / "tutorial.ipynb").read_text(encoding="utf-8"))
    parts = []
    for cell in notebook["cells"]:
        text = "".join(cell["source"])
        parts.append(text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```")
    return "\n\n".join(parts) + "\n"


# The settings of a scenario


def settings_page() -> str:
    """Return a table for each section of a scenario: key, meaning, unit, range, default, source."""
    text = (
        "# Settings of a scenario\n\n"
        "A scenario is a TOML file. `human-gait init` writes one in which every setting is\n"
        "explained, `human-gait settings KEY` explains one. Only `walk.speed` and\n"
        "`walk.step_length` have to be given. Numbers are in the unit of the table; a text may\n"
        'have another one (`"40 lb"`, `"5 ft 9 in"`, `"4 km/h"`). This page is made from the\n'
        "code that reads a scenario.\n"
    )
    documented = {name: kind.__doc__ or "" for name, kind in Scenario.sections().items()}
    for section, settings in groupby(all_settings(), lambda one: one.section):
        if section:
            text += f"\n## [{section}]\n\n{_plain(documented[section])}\n"
        text += "\n| setting | what it does | unit | range | default | source |\n"
        text += "|---" * 6 + "|\n"
        text += "".join(f"| {' | '.join(_row(one))} |\n" for one in settings)
    return text


def _row(one: Setting) -> tuple[str, ...]:
    allowed = one.allowed
    if one.low is not None:
        kind = "whole, " if one.whole else f"{one.count} numbers, " if one.count > 1 else ""
        allowed = f"{kind}{one.low:g} to {one.high:g}".replace(" ", "\N{NO-BREAK SPACE}")
    elif one.choices:
        allowed = ", ".join(f'`"{choice}"`' for choice in one.choices)
    cells = (f"`{one.key}`", one.meaning, one.unit, allowed, one.default_words, one.source)
    return tuple(cell.replace("|", "\\|") for cell in cells)


def _plain(docstring: str) -> str:
    """Return a docstring as Markdown: paragraphs of one line each, ``code`` as `code`."""
    paragraphs = re.split(r"\n\s*\n", docstring.strip())
    return "\n\n".join(" ".join(p.split()) for p in paragraphs).replace("``", "`")


# The reference


def public_page() -> str:
    """Return the page of the names of `import human_gait as hg`."""
    text = (
        "# Reference\n\n```python\nimport human_gait as hg\n```\n\n"
        "These names are the package's face: they stay as they are from release to release. The\n"
        "pages beside this one go through the wings, whose names may change.\n"
    )
    groups: dict[str, str] = {"Functions": "", "Values": "", "Errors": ""}
    for name, path in public_names().items():
        options = f"      heading: {name}\n      heading_level: 3\n"
        groups[_group(name)] += f"\n::: {path}\n    options:\n{options}"
    return text + "".join(f"\n## {group}\n{entries}" for group, entries in groups.items())


def _group(name: str) -> str:
    value = getattr(human_gait, name)
    if not isinstance(value, type):
        return "Functions"
    return "Errors" if issubclass(value, Exception) else "Values"


def public_names() -> dict[str, str]:
    """Return where each class and function of `human_gait.__all__` is defined, as a dotted path."""
    values = {name: getattr(human_gait, name) for name in human_gait.__all__}
    return {
        name: f"{value.__module__}.{value.__qualname__}"
        for name, value in values.items()
        if hasattr(value, "__qualname__")
    }


def wing_page(wing: str) -> str:
    """Return the page of one wing: what it is for, then each module with its public names."""
    package = importlib.import_module(f"human_gait.{wing}")
    if not hasattr(package, "__path__"):
        return f"# {wing}\n" + module_entry(package.__name__)
    names = (f"{package.__name__}.{one.name}" for one in pkgutil.iter_modules(package.__path__))
    return f"# {wing}\n\n{_plain(package.__doc__ or '')}\n" + "".join(map(module_entry, names))


def module_entry(module: str) -> str:
    """Return the entry of a module, which leaves what the first page documents to that page."""
    shown = {path: name for name, path in public_names().items() if path.startswith(f"{module}.")}
    text = f"\n::: {module}\n"
    if shown:
        filters = ["!^_", *(f"!^{path.rpartition('.')[2]}$" for path in shown)]
        text += f"    options:\n      filters: {json.dumps(filters)}\n"
        links = ", ".join(f"[`{name}`][{path}]" for path, name in shown.items())
        text += f"\nOf this module, too: {links}.\n"
    return text


if __name__ == "__main__":
    for path, text in pages().items():
        print(f"<!-- {path} -->\n{text}")
