"""Built-in cases: the lessons and common specimens, as files to run, to change and to extend."""

import tomllib
from pathlib import Path

#: Folder of their files.
FOLDER = Path(__file__).parent / "library"


def built_in_cases() -> dict[str, tuple[str, Path]]:
    """Title and file of each built-in case by its name, in alphabetical order."""
    return {path.stem: (_title(path), path) for path in sorted(FOLDER.glob("*.toml"))}


def _title(path: Path) -> str:
    with path.open("rb") as file:
        return str(tomllib.load(file)["title"])
