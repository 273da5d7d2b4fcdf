"""What is kept to be used again: for how long, and that it stays out of pickles."""

import pickle

from flexura.records import Kept, Latest


def test_what_was_not_asked_for_for_longest_is_dropped():
    kept, made = Kept(most=2), []

    def ask(key):
        return kept.once(key, lambda: made.append(key) or len(made))

    assert [ask(key) for key in "abacab"] == [1, 2, 1, 3, 1, 4]
    assert made == ["a", "b", "c", "b"]


def test_what_is_not_enough_is_made_anew():
    kept = Kept()
    assert kept.once("a", lambda: 1) == 1
    assert kept.once("a", lambda: 5, lambda found: found > 2) == 5
    assert kept.once("a", lambda: 7) == 5
    kept.clear()
    assert kept.once("a", lambda: 7) == 7


def test_the_latest_is_told_by_equal_values_and_by_the_same_object():
    latest, found = Latest(), iter(range(9))
    same = [1.0]
    keys = [b"1", bytes([49]), frozenset({("t", 1.0)}), frozenset({("t", 1.0)}), frozenset({("t", 2.0)})]
    assert [latest.get(key, found.__next__) for key in [*keys, same, same, [1.0]]] == [0, 0, 1, 1, 2, 3, 3, 4]
    assert latest.get(b"1", found.__next__) == 5
    latest.clear()
    assert latest.get(b"1", found.__next__) == 6


def test_nothing_that_is_kept_is_pickled():
    kept, latest = Kept(most=1), Latest()
    kept.once("a", lambda: 1)
    latest.get(b"a", lambda: 1)
    kept, latest = pickle.loads(pickle.dumps((kept, latest)))
    assert [kept.once(key, lambda: 2) for key in "aba"] == [2, 2, 2]
    assert latest.get(b"a", lambda: 2) == 2
    made = []
    kept.once("b", lambda: made.append(1))
    assert made, "one is kept, as before"
