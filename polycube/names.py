"""Names of sets: of letters, digits and underscores, and unique without regard to case."""

import re
import unicodedata
from collections.abc import Iterable

# the last word of a letter's name in Unicode: GREEK SMALL LETTER ALPHA, HANGUL SYLLABLE GA
LETTER = re.compile(r"(SMALL |CAPITAL |HANGUL |HIRAGANA |KATAKANA ).*?(\w+)(?: WITH .*)?$")


def plain(name: str) -> str:
    """A name with letters and digits of any language; all other characters become one `_`."""
    return re.sub(r"[\W_]+", "_", unicodedata.normalize("NFC", name)).strip("_")


def in_ascii(name: str) -> str:
    """A name of ASCII letters, digits, `_` and `-`, with other letters transliterated.

    A letter without a transliteration becomes `u` and its number: 面 is `u9762`.
    """
    letters = unicodedata.normalize("NFKD", name)
    return re.sub(r"[^0-9A-Za-z_-]+", "_", "".join(map(_ascii, letters)))


def _ascii(letter: str) -> str:
    if unicodedata.combining(letter):
        return ""
    if letter.isascii() or letter.casefold().isascii():  # ss for ß
        return letter if letter.isascii() else letter.casefold()
    found = LETTER.search(unicodedata.name(letter, ""))
    if found is None:
        return f"u{ord(letter):04x}"
    return found[2] if found[1] == "CAPITAL " else found[2].lower()


def unique(wanted: Iterable[str], length: int | None = None) -> list[str]:
    """The names, the second and later ones that are equal without case with `__2` etc.

    length : largest number of bytes of a name; longer ones are cut
    """
    taken: set[str] = set()
    count: dict[str, int] = {}
    found = []
    for name in wanted:
        short = new = _cut(name, length)
        while new.casefold() in taken:
            count[short.casefold()] = count.get(short.casefold(), 1) + 1
            end = f"__{count[short.casefold()]}"
            new = _cut(name, None if length is None else length - len(end)) + end
        taken.add(new.casefold())
        found.append(new)
    return found


def _cut(name: str, length: int | None) -> str:
    return name if length is None else name.encode()[:length].decode(errors="ignore")
