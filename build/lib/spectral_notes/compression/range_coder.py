"""An integer range coder with adaptive tables: exact on every machine because no floating point takes part.

A message of symbols with probabilities p_i becomes a number of about sum(-log2 p_i) bits (Martin 1979). Forty lines of
integers are the whole coder, so the format depends on no library's rounding.
"""

from __future__ import annotations

TOP = 1 << 24
MASK = (1 << 32) - 1
LIMIT = 1 << 13  # total count at which a table forgets half
STEP = 24  # what one occurrence adds to a count
MAX_BITS = 40  # longest escape; a hostile stream cannot ask for more


class CorruptStreamError(ValueError):
    """Say that coded data are not what any encoder writes."""


class RangeEncoder:
    """Turn symbols into bytes; `finish` returns them."""

    def __init__(self) -> None:
        self._low, self._range, self._cache, self._pending = 0, MASK, 0, 0
        self._out = bytearray()
        self._first = True

    def put(self, start: int, count: int, total: int) -> None:
        """Code a symbol that owns start .. start + count - 1 of `total`."""
        r = self._range // total
        self._low += r * start
        self._range = r * count
        while self._range < TOP:
            self._range <<= 8
            self._shift()

    def put_bits(self, value: int, width: int) -> None:
        """Code the low `width` bits of a value, each with probability one half."""
        while width > 16:
            width -= 16
            self.put(value >> width & 0xFFFF, 1, 1 << 16)
        self.put(value & ((1 << width) - 1), 1, 1 << width)

    def put_unsigned(self, value: int) -> None:
        """Code an integer >= 0 in about 2 log2(value + 1) + 1 bits (Elias gamma)."""
        width = (value + 1).bit_length() - 1
        for _ in range(width):
            self.put(1, 1, 2)
        self.put(0, 1, 2)
        if width:
            self.put_bits(value + 1, width)

    def _shift(self) -> None:
        """Move the top byte out, carrying into the bytes that wait."""
        if self._low < 0xFF000000 or self._low > MASK:
            carry = self._low >> 32
            if not self._first:
                self._out.append((self._cache + carry) & 0xFF)
            self._first = False
            self._out.extend(bytes([(0xFF + carry) & 0xFF]) * self._pending)
            self._pending = 0
            self._cache = self._low >> 24 & 0xFF
        else:
            self._pending += 1
        self._low = self._low << 8 & MASK

    def finish(self) -> bytes:
        """Return the bytes; zeros at the end are dropped, the decoder supplies them."""
        for _ in range(5):
            self._shift()
        return bytes(self._out).rstrip(b"\0")


class RangeDecoder:
    """Turn bytes back into symbols; past the end it reads zeros and says so in `exhausted`."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at, self._range, self._code = data, 0, MASK, 0
        for _ in range(4):
            self._code = self._code << 8 | self._next()

    @property
    def exhausted(self) -> bool:
        """Whether a symbol already read may depend on a byte that is not there."""
        return self._at > len(self._data)

    @property
    def overrun(self) -> bool:
        """Whether more was read than any encoder means: four bytes ahead, and the few zeros it drops."""
        return self._at > len(self._data) + 9

    def _next(self) -> int:
        at = self._at
        self._at = at + 1
        return self._data[at] if at < len(self._data) else 0

    def target(self, total: int) -> int:
        """The place in 0 .. total - 1 that the next symbol owns; follow with `take`."""
        self._range //= total
        return min(self._code // self._range, total - 1)

    def take(self, start: int, count: int) -> None:
        """Remove the symbol that owns start .. start + count - 1 of the total given to `target`."""
        self._code -= self._range * start
        self._range *= count
        while self._range < TOP:
            self._code = (self._code << 8 | self._next()) & MASK
            self._range <<= 8

    def get_bits(self, width: int) -> int:
        """Read what `put_bits` wrote."""
        value = 0
        while width > 16:
            width -= 16
            value = value << 16 | self.get_bits(16)
        part = self.target(1 << width)
        self.take(part, 1)
        return value << width | part

    def get_unsigned(self) -> int:
        """Read what `put_unsigned` wrote."""
        width = 0
        while self.get_bits(1):
            width += 1
            if width > MAX_BITS:
                raise CorruptStreamError("a coded integer is longer than any encoder writes")
        return (1 << width | self.get_bits(width)) - 1 if width else 0


class Table:
    """Counts of the symbols 0 .. m-1 that follow what has been coded."""

    def __init__(self, counts: list[int]) -> None:
        self._counts, self._total = list(counts), sum(counts)

    def encode(self, coder: RangeEncoder, symbol: int) -> None:
        """Code a symbol and count it."""
        counts = self._counts
        coder.put(sum(counts[:symbol]), counts[symbol], self._total)
        self._saw(symbol)

    def decode(self, coder: RangeDecoder) -> int:
        """Read a symbol and count it."""
        place, start, symbol = coder.target(self._total), 0, 0
        for count in self._counts:
            if place < start + count:
                break
            start += count
            symbol += 1
        coder.take(start, self._counts[symbol])
        self._saw(symbol)
        return symbol

    def _saw(self, symbol: int) -> None:
        self._counts[symbol] += STEP
        self._total += STEP
        if self._total > LIMIT:
            self._counts = [(count + 1) >> 1 for count in self._counts]
            self._total = sum(self._counts)
