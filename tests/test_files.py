"""Files that are written in one step."""

import os
import stat

from flexura.files import complete_file


def test_a_pipe_is_written_to_and_stays_one(tmp_path):
    pipe = tmp_path / "pipe.html"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    with complete_file(pipe) as scratch:
        scratch.write_bytes(b"page")
    assert os.read(reader, 9) == b"page"
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    os.close(reader)
