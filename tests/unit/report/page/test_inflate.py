"""What deflate wrote comes back in the page, whichever kinds of blocks it chose."""

import json
import re
import zlib
from base64 import b64encode

import numpy as np
import pytest

from tests.browser import needs_browser, visit
from workbench.report.page.html import PAGE

pytestmark = [pytest.mark.browser, needs_browser]


def deflated(given: bytes, *, level: int = 9, strategy: int = zlib.Z_DEFAULT_STRATEGY) -> bytes:
    deflate = zlib.compressobj(level, zlib.DEFLATED, -15, 9, strategy)
    return deflate.compress(given) + deflate.flush()


def test_every_kind_of_block_is_read(tmp_path):
    rng = np.random.default_rng(11)
    noise = rng.integers(256, size=70_000, dtype=np.uint8).tobytes()  # is stored, in more than one block
    smooth = np.cumsum(rng.normal(size=40_000)).astype(np.int8).tobytes()
    far = noise[:30_000] + bytes(2_000) + noise[:30_000]  # long matches from far back
    plain_and_stream = [(one, deflated(one)) for one in (b"", b"a", noise, smooth, far, bytes(100_000))]
    streams = [
        *plain_and_stream,
        (noise, deflated(noise, level=0)),
        (smooth, deflated(smooth, strategy=zlib.Z_FIXED)),
        (smooth, deflated(smooth, strategy=zlib.Z_HUFFMAN_ONLY)),
    ]
    given = json.dumps([[b64encode(one).decode() for one in pair] for pair in streams])
    script = (PAGE / "viewer" / "inflate.js").read_text(encoding="utf-8")
    (tmp_path / "page.html").write_text(f"""<!doctype html><pre id="found"></pre><script>{script}
        const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
        document.getElementById("found").textContent = JSON.stringify({given}.map(([plain, stream]) => {{
            const whole = bytes(plain), back = inflate(bytes(stream), whole.length);
            return back.length === whole.length && back.every((value, i) => value === whole[i]);
        }}));</script>""")
    seen = visit(tmp_path / "page.html")
    assert seen.console == []
    assert json.loads(re.search(r'<pre id="found">(.*?)</pre>', seen.dom, re.S)[1]) == [True] * len(streams)
