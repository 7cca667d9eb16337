"""A page as HTML: it loads nothing from anywhere, and the same content gives the same bytes."""

import hashlib
from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from workbench.report.page.blocks import Figure, Html, Note, Section, Table
from workbench.report.page.compact_svg import glyph_sheet
from workbench.report.page.content import Content
from workbench.report.page.drawing import draw_svg

__all__ = ["html_text"]

PAGE = Path(__file__).parent  # where template, style and scripts stand
TEMPLATE = "page.html.j2"
VIEWER = (
    "inflate",
    "data",
    "camera",
    "shapes",
    "meshes",
    "stage",
    "charts",
    "controls",
)  # in this order, each on those before it
VIEWER_HEAD = """// The motion of some runs in WebGL2, from <script type="application/json" id="viewer-data">
// (the document of workbench/motion/frames.py). Nothing is loaded; without WebGL2 a sentence says so.
const source = document.getElementById("viewer-data"), root = document.getElementById("viewer-panel");
if (!source || !root) return;
"""


def html_text(content: Content) -> str:
    """The page as one HTML file: figures inline, styles and scripts allowed by their hashes."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(PAGE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["code"] = _code
    environment.tests["figure"] = lambda block: isinstance(block, Figure)
    environment.tests["table"] = lambda block: isinstance(block, Table)
    environment.tests["note"] = lambda block: isinstance(block, Note)
    style = (PAGE / "page.css").read_text(encoding="utf-8")
    scripts = _scripts(content.sections)
    glyphs: dict[str, str] = {}  # filled while the figures are drawn
    return environment.get_template(TEMPLATE).render(
        title=content.title,
        question=content.question,
        cards=content.cards,
        poor=[card for card in content.cards if card.level == "poor"],
        sections=content.sections,
        missing=content.missing,
        running=content.running,
        outdated=content.outdated,
        svg=lambda figure: [_svg(figure, k, glyphs) for k in range(len(figure.panels))],
        glyphs=lambda: Markup(glyph_sheet(glyphs)),
        markup=lambda block: Markup(block.markup),
        policy=_policy(style, scripts),
        style=Markup(style),
        scripts=[Markup(script) for script in scripts],
        version=content.version,
        seed=content.seed,
        hash=content.study_hash,
    )


def _scripts(sections: Sequence[Section]) -> list[str]:
    """The scripts that the blocks of the page need."""
    wanted = {block.id for section in sections for block in section.blocks if isinstance(block, Html)}
    given = {"profiler": lambda: _script("profiler.js"), "viewer": _viewer}
    return [make() for name, make in given.items() if name in wanted]


def _script(name: str) -> str:
    return (PAGE / name).read_text(encoding="utf-8")


def _viewer() -> str:
    """The parts of the viewer as one function, which ends at once on a page without a motion."""
    parts = "".join(_script(f"viewer/{name}.js") for name in VIEWER)
    return f'"use strict";\n(() => {{\n{VIEWER_HEAD}{parts}}})();\n'


def _policy(style: str, scripts: Sequence[str]) -> str:
    """The content policy: nothing from anywhere, this style and these scripts, images inside the page."""
    allowed = " ".join(_digest(script) for script in scripts) or "'none'"
    return (
        f"default-src 'none'; style-src {_digest(style)}; script-src {allowed}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _digest(text: str) -> str:
    return f"'sha256-{b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _svg(figure: Figure, k: int, glyphs: dict[str, str]) -> Any:
    from markupsafe import Markup

    panel = figure.panels[k]
    name = f"{figure.id}-{k}"
    return Markup(draw_svg(panel.draw, width=panel.width, height=panel.height, name=name, glyphs=glyphs))


def _code(text: str) -> Any:
    """Text with `code` between backquotes."""
    from markupsafe import Markup, escape

    parts = text.split("`")
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if k % 2 else escape(part) for k, part in enumerate(parts)
    )
