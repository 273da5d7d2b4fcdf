"""Damaged files end in an answer or a FlexuraError, within memory and processor time, whatever is wrong with them."""

from __future__ import annotations

from itertools import islice
from random import Random, SystemRandom

import pytest

from helpers.fuzzer import KINDS, Case, Reader, Tally, cases, corpus, fuzz, kept
from helpers.mutations import mutated

SEED = 20261122
WITHOUT_DATA = {"pyuff_testlab_geometry.uff"}
"""Files of the corpus that hold nothing that is asked for."""


def nothing_fails(found: Tally, folder, seed: int) -> None:
    print(f"seed {seed}: {found.read} read, {found.refused} refused")  # the seed of a failure is in its report
    assert not found.failures, f"seed {seed}\n" + "\n".join(kept(found.failures, folder))
    assert found.read and found.refused


@pytest.fixture(scope="module")
def reader():
    with Reader() as own:
        yield own


@pytest.mark.slow
def test_the_corpus_is_read_but_for_what_has_crashed_a_reader(reader):
    found = {(k, name): reader.outcome(Case(k, name, content)) for k in KINDS for name, content in corpus(k)}
    assert not {key: what for key, what in found.items() if what not in ("read", "refused")}
    refused = {name for (_, name), what in found.items() if what == "refused"}
    assert {name for name in refused if not name.startswith("crash")} == WITHOUT_DATA


@pytest.mark.parametrize("kind", KINDS)
def test_a_few_damaged_files(tmp_path, reader, kind):
    first = len(corpus(kind))
    found = [reader.fails(case) for case in islice(cases(kind, SEED), first, first + 25)]
    assert not any(found), "\n".join(kept([failure for failure in found if failure], tmp_path))


@pytest.mark.slow
def test_half_a_minute_of_damaged_files(tmp_path):
    seed = SystemRandom().randrange(10**6)
    nothing_fails(fuzz(30.0, seed), tmp_path, seed)


def test_the_same_seed_makes_the_same_files():
    for kind in KINDS:
        one, other = cases(kind, 1), cases(kind, 1)
        assert all(next(one) == next(other) for _ in range(len(corpus(kind)) + 5))


def test_mutations_change_what_they_are_given():
    content = corpus("matrix")[0][1]
    made = {mutated(content, "x.mtx", Random(k)) for k in range(50)}
    assert len(made) > 40


CULPRITS = {
    "dies": ("os.kill(os.getpid(), 11)", "died: SIGSEGV"),
    "raises": ("{}['x']", "KeyError: 'x'"),
    "grows": ("bytearray(8 << 30)", "more memory than"),
    "works": ("[0 for _ in range(10**7)]", "of processor time, more than 0.1 s"),
}


@pytest.mark.parametrize("how", CULPRITS)
def test_what_a_reader_does_wrong_is_seen(tmp_path, how):
    """The fuzzer itself: a reader that dies, raises, needs memory or time."""
    does, said = CULPRITS[how]
    code = f"import os\ndef read(kind, file):\n    if kind == 'model': {does}\n    return 'read'\n"
    (tmp_path / "readers.py").write_text(code)
    with Reader(seconds=0.1, readers=tmp_path / "readers.py") as reader:
        failure = reader.fails(Case("model", "x.yaml", b""))
        assert failure is not None and said in failure.what
        assert reader.outcome(Case("other", "x.yaml", b"")) == "read"
