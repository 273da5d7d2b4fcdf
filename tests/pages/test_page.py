"""The page that viewer, report and live page share: its data come through whatever they hold, and nothing else runs."""

import json
import re

import pytest

from flexura.pages.viewer import bundle, json_text, page

HOSTILE = [
    "</script><script>throw new Error('ran')</script>",
    "<!--<script>",
    "a & b",
    "\u2028 \u2029",
    "🙂",
    "\"'{{x}}",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_data_of_any_name_come_through(text):
    own = json_text({text: [text]})
    assert "<" not in own and ">" not in own and json.loads(own) == {text: [text]}


def test_numbers_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="JSON"):
        json_text({"x": float("nan")})


def test_the_script_ends_where_it_should():
    whole = page("a </title><b>", "<main>told</main>", "viewer", {"viewer": {}})
    assert whole.count("</script>") == 2 and "</title><b>" not in whole
    assert "</script" not in bundle() and "<!--" not in bundle()


def test_a_browser_reads_what_was_written(opened):
    data = {"viewer": {}, "names": {str(k): text for k, text in enumerate(HOSTILE)}}
    opened.page.set_content(page("ti<t>le", "<main><h1>told</h1></main>", "viewer", data))
    found = opened.page.evaluate("JSON.parse(document.getElementById('flexura-data').textContent)")
    assert found == data
    assert opened.page.title() == "ti<t>le" and opened.page.inner_text("h1") == "told"
    assert opened.outside == [] and opened.errors == []


def test_no_other_script_runs(opened):
    image = "<img src='http://127.0.0.1:9/x.png' onerror='document.title = 1'>"
    body = f"<main><script>document.title = 'ran'</script>{image}</main>"
    opened.page.set_content(page("still", body, "viewer"))
    assert opened.page.title() == "still"
    refused = [text for text in opened.errors if re.search("Content Security Policy", text)]
    assert len(refused) >= 2
