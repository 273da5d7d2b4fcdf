"""Packages of extras that are not there, or cannot be imported, end in a sentence with the way to get them."""

import pytest

from flexura.errors import OptionError, need


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("import nowhere_at_all", r"this needs the package old_package: pip install 'flexura\[export\]'"),
        ("raise OSError('libnone.so.1 is missing')", "needs a library of the system.*libnone.so.1"),
        ("raise ValueError('size changed')", r"old_package is installed, but cannot be imported \(size changed\)"),
        ("from json import nothing", r"installed, but cannot be imported.*--upgrade 'flexura\[export\]'"),
    ],
)
def test_packages_that_do_not_load(tmp_path, monkeypatch, body, told):
    (tmp_path / "old_package.py").write_text(f"{body}\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(OptionError, match=told):
        need("old_package", "export")
