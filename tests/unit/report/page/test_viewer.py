"""The viewer in a browser: what every view holds, members, wheel and keys, a context that is lost."""

import json
import re

import pytest

from tests.browser import needs_browser, visit
from tests.sample_motion import sample_film
from workbench.report.page.content import Content
from workbench.report.page.html import html_text
from workbench.report.sections.motion import motion_section

pytestmark = [pytest.mark.browser, needs_browser]

TABLE = (
    "<table><tbody><tr><td>B1</td><td>belt</td><td>1</td><td>2</td><td>3</td></tr></tbody></table>"  # a bill
)


@pytest.fixture(scope="module")
def page():
    section = motion_section({"motion": sample_film().to_dict()})
    content = Content(
        title="film",
        question="",
        cards=(),
        sections=(section,),
        missing=(),
        version="",
        seed=None,
        study_hash="",
    )
    return html_text(content)


def asked(page, tmp_path, script, before=""):
    """What a script at the end of the page finds, one before all that; the policy is left out."""
    page = page.replace("<head>", f"<head><script>{before}</script>", 1)
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page)
    ask = f"""<pre id="found"></pre><script>
        const V = holdfast.viewer, [canvas, second] = document.querySelectorAll("canvas");
        const tell = (found) => {{ document.getElementById("found").textContent = JSON.stringify(found); }};
        Promise.resolve(({script})()).then(tell);
    </script>"""
    (tmp_path / "page.html").write_text(text.replace("</body>", f"{TABLE}{ask}</body>"))
    seen = visit(tmp_path / "page.html", gl=True)
    assert seen.console == []
    return json.loads(re.search(r'<pre id="found">(.*?)</pre>', seen.dom, re.S)[1])


def test_every_view_holds_the_occupant_in_every_frame(page, tmp_path):
    found = asked(page, tmp_path, "() => V.views.map((name) => [name, V.framed(name)])")
    assert [name for name, _ in found] == ["side", "front", "rear", "top", "corner", "vehicle", "occupant"]
    assert min(share for _, share in found) >= 0.95


def test_cases_and_ghosts_change_what_is_drawn(page, tmp_path):
    script = """() => {
        const first = V.probe(60);
        V.state.case = V.cases[1];
        const other = V.probe(60);
        V.state.ghosts = true;
        return [V.cases, first, other, V.probe(60)];
    }"""
    cases, first, other, ghosts = asked(page, tmp_path, script)
    assert cases == ["the worst case", "the nominal case"]
    assert len({first["drawn"][0]["hash"], other["drawn"][0]["hash"], ghosts["drawn"][0]["hash"]}) == 3


def test_a_member_tells_its_force_and_its_row(page, tmp_path):
    script = """() => {
        canvas.focus();
        const key = (name) => second.dispatchEvent(new KeyboardEvent("keydown", { key: name }));
        key("n");
        const text = document.querySelector(".viewer-member").textContent;
        const row = document.querySelector("tr.viewer-row").cells[0].textContent;
        const charts = document.querySelectorAll(".viewer-member .viewer-plot > svg").length;
        key("n");
        const next = document.querySelector(".viewer-member").textContent;
        key("Escape");
        return [text, row, charts, next, document.querySelectorAll("tr.viewer-row").length];
    }"""
    text, row, charts, second, left = asked(page, tmp_path, script)
    assert text.startswith("B1: belt, density 1, ")
    assert "force of B1, tension positive [N]" in text
    assert (row, charts) == ("B1", 1)
    assert second.startswith("B2: belt, density 0.4")
    assert left == 0


def test_a_click_chooses_the_member_under_it(page, tmp_path):
    script = """() => {
        const box = second.getBoundingClientRect();
        const names = new Set();
        V.probe(0);
        for (let x = 4; x < box.width; x += 12) for (let y = 4; y < box.height; y += 12) {
            for (const kind of ["pointerdown", "pointerup"]) {
                const event = new MouseEvent(kind, { clientX: box.left + x, clientY: box.top + y });
                Object.defineProperty(event, "pointerId", { value: 1 });
                second.setPointerCapture = () => {};
                second.dispatchEvent(event);
            }
            names.add(V.state.member);
        }
        return [...names];
    }"""
    assert {"B1", "A1", "R1", None} <= set(asked(page, tmp_path, script))


def test_the_wheel_scrolls_the_page_until_the_picture_has_the_focus(page, tmp_path):
    script = """() => {
        const turned = () => {
            const event = new WheelEvent("wheel", { deltaY: 100, cancelable: true });
            canvas.dispatchEvent(event);
            return [event.defaultPrevented, V.state.zoom];
        };
        const before = turned();
        canvas.focus();
        return [before, turned()];
    }"""
    before, after = asked(page, tmp_path, script)
    assert before == [False, 1]
    assert after[0] is True
    assert after[1] < 1


def test_forces_are_shown_as_colours_and_arrows(page, tmp_path):
    script = """() => {
        const plain = V.probe(70);
        V.state.colouring = "force";
        const coloured = V.probe(70);
        V.state.arrows = true;
        return [plain, coloured, V.probe(70)];
    }"""
    plain, coloured, arrows = asked(page, tmp_path, script)
    assert plain["draws"] == coloured["draws"] < arrows["draws"]
    assert plain["drawn"][1]["hash"] != coloured["drawn"][1]["hash"]
    assert plain["drawn"][0] == coloured["drawn"][0]  # the run without members


def test_a_lost_context_is_made_anew(page, tmp_path):
    script = """async () => {
        const later = (ms) => new Promise((done) => setTimeout(done, ms));
        const before = V.probe(30);
        V.lose();
        await later(200);
        const lost = [V.lost(), V.probe(30).draws];
        V.restore();
        for (let i = 0; i < 40 && V.lost(); i++) await later(50);
        return [before, lost, V.lost(), V.probe(30)];
    }"""
    before, lost, still_lost, after = asked(page, tmp_path, script)
    assert lost == [True, 0]
    assert still_lost is False
    assert after == before


# the browser's clock does not wait for pictures where its processor is busy: here pictures wait for the clock
CLOCK = """window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);
    window.cancelAnimationFrame = clearTimeout;"""
PACE = """async () => {
    const later = (ms) => new Promise((done) => setTimeout(done, ms));
    const sizes = () => [canvas, second].map((one) => one.width / one.clientWidth);
    const play = document.querySelector(".viewer-controls button");
    const before = sizes(), picture = V.probe(20);
    V.state.frame = 10;
    play.click();
    for (let i = 0; i < 40 && V.state.frame === 10; i++) await later(20);
    const playing = sizes();
    if (V.state.playing) play.click();                       // else the end has come
    await later(600);
    const { antialias } = canvas.getContext("webgl2").getContextAttributes();
    return [before, playing, sizes(), picture, V.probe(20), antialias];
}"""


def test_without_a_graphics_card_pictures_that_move_have_one_sample_a_pixel(page, tmp_path):
    before, playing, after, picture, again, blended = asked(page, tmp_path, PACE, CLOCK)
    assert (before, playing, after) == ([2, 2], [1, 1], [2, 2])
    assert blended is False
    assert again == picture


def test_with_a_graphics_card_every_picture_is_antialiased(page, tmp_path):
    card = """const gl = WebGL2RenderingContext.prototype, get = gl.getParameter, NAME = 0x9246;
        gl.getParameter = function (what) { return what === NAME ? "A card" : get.call(this, what); };"""
    before, playing, after, picture, again, blended = asked(page, tmp_path, PACE, CLOCK + card)
    assert (before, playing, after) == ([1, 1], [1, 1], [1, 1])
    assert blended is True
    assert again == picture


def test_a_picture_takes_few_draw_calls_and_no_more_memory_of_forms_that_stay(page, tmp_path):
    script = """() => {
        const calls = { drawElements: 0, bufferData: 0 }, gl = WebGL2RenderingContext.prototype;
        V.probe(30);
        for (const name of Object.keys(calls)) {
            const kept = gl[name];
            gl[name] = function (...given) { calls[name] += 1; return kept.apply(this, given); };
        }
        V.probe(30);
        return calls;
    }"""
    calls = asked(page, tmp_path, script)
    pictures = 4  # a probe draws both canvases twice
    assert 0 < calls["drawElements"] <= 7 * pictures
    assert calls["bufferData"] == pictures  # corners; triangles stand as they were
