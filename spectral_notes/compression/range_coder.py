"""An integer range coder with adaptive tables: exact on every machine because no floating point takes part.

A message of symbols with probabilities p_i becomes a number of about sum(-log2 p_i) bits (Martin 1979). One class reads
and writes, so that each part of a file is described once: every method takes the value to write and returns the value
written or read. Where a carry could still run through bytes already written, the interval is cut short instead.
"""

from __future__ import annotations

MASK, TOP, BOTTOM = (1 << 32) - 1, 1 << 24, 1 << 16
LIMIT, STEP = 1 << 13, 24  # the total count at which a table forgets half; what one occurrence adds to a count
MAX_BITS = 62  # longest integer; a hostile stream cannot ask for more


class CorruptStreamError(ValueError):
    """Say that coded data are not what any encoder writes."""


class Coder:
    """Write symbols, or read them from the bytes it is made with, of which the end may be cut off."""

    def __init__(self, data: bytes | None = None, *, cut: bool = False) -> None:
        self.reading, self.cut, self._data, self._at = data is not None, cut, data or b"", 4
        self._low, self._range, self._out = 0, MASK, bytearray()
        self._code = int.from_bytes(self._data[:4].ljust(4, b"\0"), "big")

    @property
    def ended(self) -> bool:
        """Whether a symbol already read may depend on a byte that was cut off."""
        return self.cut and self._at > len(self._data)

    def place(self, total: int) -> int:
        """Where in 0 .. total - 1 the next symbol lies, when reading."""
        place = (self._code - self._low & MASK) // (self._range // total)
        return place if place < total else total - 1

    def narrow(self, start: int, count: int, total: int) -> None:
        """Code the symbol that owns start .. start + count - 1 of `total`, at most 2^16."""
        step = self._range // total
        low, size = self._low + step * start, step * count
        while low ^ (low + size) < TOP or size < BOTTOM:
            if low ^ (low + size) >= TOP:
                size = -low & (BOTTOM - 1)
            if self.reading:
                if self._at >= len(self._data) + 8:  # four ahead, four that `finish` may drop
                    raise CorruptStreamError("the data end too early")
                self._code = self._code << 8 & MASK | (self._data[self._at] if self._at < len(self._data) else 0)
                self._at += 1
            else:
                self._out.append(low >> 24)
            low, size = low << 8 & MASK, size << 8
        self._low, self._range = low, size

    def bits(self, width: int, value: int = 0) -> int:
        """Code the low `width` bits of a value, each with probability one half."""
        if width > 16:
            return self.bits(16, value) | self.bits(width - 16, value >> 16) << 16
        total = 1 << width
        part = self.place(total) if self.reading else value & total - 1
        self.narrow(part, 1, total)
        return part

    def unsigned(self, value: int = 0) -> int:
        """Code an integer >= 0 in about 2 log2(value + 1) + 1 bits (Elias gamma)."""
        width, wanted = 0, (value + 1).bit_length() - 1
        while self.bits(1, width < wanted):
            width += 1
            if width > MAX_BITS:
                raise CorruptStreamError("a coded integer is longer than any encoder writes")
        return (1 << width | self.bits(width, value + 1)) - 1

    def signed(self, value: int = 0) -> int:
        """Code an integer of either sign."""
        code = self.unsigned(2 * value - 1 if value > 0 else -2 * value)
        return (code + 1) // 2 if code % 2 else -(code // 2)

    def symbol(self, counts: list[int], symbol: int = 0) -> int:
        """Code a symbol 0 .. m-1 by the counts (m,) of those before, whose total follows them, and count it."""
        total = counts[-1]
        if self.reading:
            place, start, symbol = self.place(total), 0, 0
            while place >= start + (count := counts[symbol]):
                start, symbol = start + count, symbol + 1
        else:
            start = sum(counts[:symbol])
        self.narrow(start, counts[symbol], total)
        counts[symbol] += STEP
        counts[-1] += STEP
        if counts[-1] > LIMIT:
            counts[:-1] = [(count + 1) >> 1 for count in counts[:-1]]
            counts[-1] = sum(counts[:-1])
        return symbol

    def finish(self) -> bytes:
        """The bytes written; zeros at the end of the last four are dropped, the reader supplies them."""
        return bytes(self._out) + self._low.to_bytes(4, "big").rstrip(b"\0")
