"""The entities and strings of a STEP file, by the rules of ISO 10303-21."""

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

STEP = (".step", ".stp")
SOLIDS = ("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS", "FACETED_BREP")
# a string, in which '' is a quote, or a comment; both may be cut off by the end of the file
QUOTED = re.compile(r"'([^']*(?:''[^']*)*)(?:'|\Z)|/\*.*?(?:\*/|\Z)", re.DOTALL)
DIRECTIVES = re.compile(
    r"(?P<quote>'')|(?P<slash>\\\\)|\\P(?P<page>[A-I])\\|\\S\\(?P<shifted>.)"
    r"|\\X\\(?P<x>[0-9A-F]{2})|\\X2\\(?P<x2>(?:[0-9A-F]{4})+)(?:\\X0\\)?"
    r"|\\X4\\(?P<x4>(?:[0-9A-F]{8})+)(?:\\X0\\)?",
    re.DOTALL | re.IGNORECASE,
)


@dataclass(frozen=True, eq=False)
class Exchange:
    """The data of a STEP file."""

    # body of each entity by its number, in capitals and without spaces; a string is replaced by its
    # index in `strings`, in quotes
    entities: dict[str, str]
    strings: list[str]  # decoded strings
    is_unicode: bool = True  # whether the file is UTF-8, so that names of any language are certain

    def body(self, number: str) -> str:
        """The body of an entity; empty if there is none."""
        return self.entities.get(number, "")

    def word(self, number: str) -> str:
        """The keyword of a simple entity; empty for a complex one."""
        return self.body(number).partition("(")[0]

    def references(self, number: str) -> list[str]:
        """The numbers of the entities to which an entity refers."""
        return re.findall(r"#(\d+)", self.body(number))

    def name(self, number: str) -> str:
        """The first string of an entity: its name; empty if there is none, or NONE."""
        first = re.search(r"'(\d+)'", self.body(number))
        name = self.strings[int(first[1])] if first else ""
        # many programs write NONE in place of a name
        return "" if name.strip() in ("", "NONE") else name


def exchange(path: Path) -> Exchange:
    """Read a STEP file; the last one is kept."""
    about = path.stat()
    return _exchange(path, about.st_size, about.st_mtime_ns)


@lru_cache(maxsize=1)
def _exchange(path: Path, size: int, time: int) -> Exchange:
    data = path.read_bytes().partition(b"END-ISO-10303-21;")[0]
    strings: list[str] = []
    try:
        text, is_unicode = data.decode("utf-8-sig"), True
    except UnicodeDecodeError:  # ISO 8859-1, where every byte is a character
        text, is_unicode = data.decode("latin-1"), False

    def masked(found: re.Match[str]) -> str:
        if found[1] is None:
            return " "
        strings.append(decoded(found[1]))
        return f"'{len(strings) - 1}'"

    statements = re.sub(r"\s+", "", QUOTED.sub(masked, text).upper()).split(";")
    pairs = (each.partition("=") for each in statements if each.startswith("#"))
    return Exchange({number[1:]: body for number, _, body in pairs}, strings, is_unicode)


def decoded(text: str) -> str:
    r"""Decode the inside of a string: doubled quotes, and the directives \X\, \X2\, \X4\, \S\, \P.

    A line break inside a string does not belong to it. An incomplete directive is left as it is.
    """
    page = "A"

    def replaced(found: re.Match[str]) -> str:
        nonlocal page
        kind, value = str(found.lastgroup), found[str(found.lastgroup)]
        if kind == "page":
            page = value.upper()
            return ""
        if kind == "shifted":
            byte = bytes([ord(value) + 128]) if value.isascii() else value.encode()
            return byte.decode(f"iso8859-{ord(page) - ord('A') + 1}", errors="replace")
        if kind in ("quote", "slash"):
            return value[0]
        codes = {"x": "latin-1", "x2": "utf-16-be", "x4": "utf-32-be"}
        return bytes.fromhex(value).decode(codes[kind], errors="replace")

    return DIRECTIVES.sub(replaced, re.sub(r"[\r\n]", "", text))
