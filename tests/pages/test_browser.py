"""The browser of the tests draws WebGL and sees colours: what is found of pages later means something."""

import numpy as np

from helpers.browser import pixels

RED = """<body style="margin:0;background:#fff"><canvas width="200" height="100"></canvas><script>
const gl = document.querySelector("canvas").getContext("webgl2", {preserveDrawingBuffer: true});
gl.enable(gl.SCISSOR_TEST); gl.scissor(0, 0, 100, 100); gl.clearColor(1, 0, 0, 1); gl.clear(gl.COLOR_BUFFER_BIT);
</script>"""


def test_webgl_is_drawn(opened):
    opened.page.set_content(RED)
    seen = pixels(opened.page.screenshot())
    assert (seen[50, 50] == [255, 0, 0]).all() and (seen[400, 600] == 255).all()
    assert opened.errors == []


def test_requests_and_errors_are_seen(opened):
    opened.page.set_content("<img src='http://127.0.0.1:9/x.png'><script>throw new Error('told')</script>")
    assert opened.outside == ["http://127.0.0.1:9/x.png"] and any("told" in text for text in opened.errors)
    assert np.ptp(pixels(opened.page.screenshot())) > 0
