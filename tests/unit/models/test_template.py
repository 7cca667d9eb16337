"""Decks with parameters: what templates write, and what they refuse."""

import pytest

from workbench.errors import EvaluationFailed, StudyError
from workbench.models.template import compiled, format_value

ROW = {"k": 0.1 + 0.2, "n": 3, "road": "flat"}


@pytest.mark.parametrize(
    ("text", "style", "deck"),
    [
        ("K = {{ k }}\n", "jinja", "K = 0.30000000000000004\n"),
        ("{{ k|fmt('%10.3e') }}|{{ n }}|{{ road }}", "jinja", " 3.000e-01|3|flat"),
        ("{% if n > 2 %}{{ 2 * k + 1 }}{% else %}no{% endif %}", "jinja", "1.6"),
        ("{{ (-k)|abs }} { untouched }", "jinja", "0.30000000000000004 { untouched }"),
        (
            "K = {k} {n} {road} \\{k} {not a name} {}",
            "dakota",
            "K = 0.30000000000000004 3 flat {k} {not a name} {}",
        ),
    ],
)
def test_decks(text, style, deck):
    assert compiled(text, list(ROW), style=style, what="deck")(ROW) == deck


@pytest.mark.parametrize(
    ("text", "style", "words"),
    [
        ("{{ kk }}", "jinja", r"deck names 'kk', which is no parameter. Did you mean 'k'\?"),
        (
            "{% if z %}{% endif %}",
            "jinja",
            "deck names 'z', which is no parameter; the parameters are k, n, road",
        ),
        ("a\n{{ k ", "jinja", "deck, line 2: unexpected end of template"),
        ("{kk}", "dakota", r"deck names 'kk', which is no parameter. Did you mean 'k'"),
    ],
)
def test_what_templates_refuse(text, style, words):
    with pytest.raises(StudyError, match=words):
        compiled(text, list(ROW), style=style, what="deck")


def test_formats():
    assert format_value(1234567.0) == "1234567.0"
    with pytest.raises(EvaluationFailed, match=r"format '%s%s' is not of the form '%12.6g'"):
        format_value(1.0, "%s%s")
    with pytest.raises(EvaluationFailed, match="format '%d' does not fit 'flat'"):
        format_value("flat", "%d")
    with pytest.raises(EvaluationFailed, match="deck: ZeroDivisionError"):
        compiled("{{ 1 / (n - 3) }}", list(ROW), style="jinja", what="deck")(ROW)
