"""Records in the bytes of a file, written again as they were read."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from meshlab_filter.records import ByteRecords

LINES = st.lists(st.sampled_from([b"a", b"bb", b"cc", b"", b" "]), min_size=1, max_size=8)


@given(lines=LINES, data=st.data())
def test_records_are_taken_as_they_are(lines, data):
    """Equally long or not, with blank lines between or not, the bytes are those of the lines."""
    records = ByteRecords.of_lines(b"".join(line + b"\n" for line in lines))
    filled = [line + b"\n" for line in lines if line.strip()]
    assert [records[row] for row in range(len(records))] == filled
    if not filled:
        return
    chosen = data.draw(st.lists(st.integers(0, len(filled) - 1)))
    indices = np.array(chosen, dtype=np.int64)
    expected = b"".join(filled[row] for row in chosen)
    assert records.take(indices) == expected
    assert records.only(indices).take(np.arange(len(chosen))) == expected


def test_rows_of_equal_records():
    """Records of one length in a row are an array; others are not."""
    assert ByteRecords.of_lines(b"aa\nbb\ncc\n").rows().tolist() == [b"aa\n", b"bb\n", b"cc\n"]
    for body in (b"aa\nb\n\ncc\n", b"aa\n\nbb\n", b"aa\nbb", b"a\nbb\n"):
        assert ByteRecords.of_lines(body).rows() is None, body
