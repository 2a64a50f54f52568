"""Records in the bytes of a file, written again as they were read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .validation import IntArray


@dataclass(frozen=True)
class ByteRecords:
    r"""Where each record begins and ends in the bytes of a file.

    Attributes
    ----------
    body : bytes
    starts, ends : numpy.ndarray, shape (N,), int64
        Record i is ``body[starts[i]:ends[i]]``.

    Examples
    --------
    >>> records = ByteRecords.of_lines(b"first\n\nsecond\nthird")
    >>> len(records), records.take(np.array([0, 2]))
    (3, b'first\nthird')
    """

    body: bytes
    starts: IntArray
    ends: IntArray

    @classmethod
    def of_lines(cls, body: bytes, *, newline: bytes = b"\n") -> ByteRecords:
        """Find the lines, each with its line break, leaving out blank ones."""
        data = np.frombuffer(body, dtype=np.uint8)
        ends = np.flatnonzero(data == newline[-1]) + 1
        if not len(ends) or ends[-1] != len(data):
            ends = np.append(ends, len(data))
        starts = np.concatenate([[0], ends[:-1]])
        # Bytes up to the space are white space or control characters; a line of them is blank.
        printed = np.concatenate([[0], np.cumsum(data > ord(" "))])
        filled = printed[ends] > printed[starts]
        return cls(body, starts[filled], ends[filled])

    def __len__(self) -> int:
        return len(self.starts)

    def __getitem__(self, index: int) -> bytes:
        return self.body[self.starts[index] : self.ends[index]]

    def rows(self) -> npt.NDArray[np.void] | None:
        """Return the records as one array, shape (N,), of raw bytes.

        None if they are not equally long and one right after the other.
        """
        sizes = self.ends - self.starts
        if not len(sizes) or not sizes[0]:
            return None
        size, first = int(sizes[0]), int(self.starts[0])
        if (sizes != size).any() or (np.diff(self.starts) != size).any():
            return None
        return np.frombuffer(self.body, f"V{size}", count=len(sizes), offset=first)

    def only(self, indices: IntArray) -> ByteRecords:
        """Return some of the records, in that order."""
        return ByteRecords(self.body, self.starts[indices], self.ends[indices])

    def take(self, indices: IntArray) -> bytes:
        """Return the bytes of some of the records, one after the other."""
        rows = self.rows()
        if rows is not None:
            return rows[indices].tobytes()
        starts, ends = self.starts[indices].tolist(), self.ends[indices].tolist()
        return b"".join([self.body[start:end] for start, end in zip(starts, ends)])
