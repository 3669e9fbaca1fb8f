"""Write the generated pages of the reference:

    python -m docs.generators.reference docs

writes `docs/reference/options.md`, `api.md` and `plugins.md`.
"""

from __future__ import annotations

import sys
from pathlib import Path

from docs.generators.reference import api, options, plugins
from polycube.io.atomic import atomic_write

PAGES = {"options.md": options.page, "api.md": api.page, "plugins.md": plugins.page}


def write(folder: Path) -> None:
    """Write all pages into `folder/reference`."""
    for name, page in PAGES.items():
        with atomic_write(folder / "reference" / name) as temporary:
            temporary.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
