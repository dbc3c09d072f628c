"""Rows of the validation, as files describe them: what is run, what is read from it, and what is expected."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

_Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9-]*$")]
_FileName = Annotated[str, Field(pattern=r"^[a-z0-9_]+$")]
_Text = Annotated[str, Field(min_length=1)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Quick(_Table):
    """What is another in a quick validation.

    Attributes:
        tolerance: Allowed relative error [–], or absolute one where zero is expected.
        expected: Expected value, if the quick problem is another one.
        value: What is read, if it has another name there.
    """

    tolerance: Annotated[float, Field(gt=0)]
    expected: float | None = None
    value: _Text | None = None


class Row(_Table):
    """A value that is compared.

    Attributes:
        name: Its name within the run.
        what: What it is, for a reader of the page.
        value: What is read from the run, see `cutsim.validation.readings`; a list if a program has made a study, from
            the coarsest mesh or step to the finest, which counts.
        expected: The reference.
        tolerance: Allowed relative error [–], or absolute one where zero is expected.
        refinement: Ratio of the sizes of neighbours in a study.
        unit: Unit of both; empty for a pure number.
        source: Where the reference comes from, with equation, table or doi.
        note: What a reader should know of it, such as the cause of a deviation.
        quick: What is another in a quick validation; a row without it is left out there.
    """

    name: _Name
    what: _Text
    value: _Text | Annotated[list[_Text], Field(min_length=2)]
    expected: float
    tolerance: Annotated[float, Field(gt=0)]
    refinement: Annotated[float, Field(gt=1)] = 2.0
    unit: str = ""
    source: _Text
    note: str = ""
    quick: Quick | None = None


class Run(_Table):
    """A run, and the rows that are read from it.

    Attributes:
        name: Its name.
        case: Case file, or name of a built-in case; or else ...
        program: name of a validation program.
        set: Keys of the case that are changed.
        arguments: Arguments of the program.
        study: Further changes of the case or options of the program, one table for each mesh or step, from the coarsest
            to the finest, which counts; a quick program has its own mesh and leaves them out.
        figures: Names of figures of the pages, and the pictures of the level that counts which they are copies of.
        row: The rows.
    """

    name: _Name
    case: str = ""
    program: str = ""
    set: dict[str, Any] = {}
    arguments: list[str] = []
    study: list[dict[str, Any]] = []
    figures: dict[_FileName, _Text] = {}
    row: Annotated[list[Row], Field(min_length=1)]

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if bool(self.case) == bool(self.program):
            raise ValueError("give a case or a program, and not both")
        if self.case and self.arguments:
            raise ValueError("arguments are those of a program; a case has set")
        if self.program and self.set:
            raise ValueError("set is that of a case; a program has arguments")
        if self.case and any(isinstance(row.value, list) for row in self.row):
            raise ValueError("a case has one value a run; its study makes several")
        return self

    @property
    def levels(self) -> list[dict[str, Any]]:
        """Changes of the case, or options of the program, for each of its runs, the one that counts last."""
        return [{**self.set, **further} for further in self.study or [{}]]


class Group(_Table):
    """A group of runs, which has a section of the page.

    Attributes:
        title: Its heading.
        text: What a reader should know before its table.
        run: The runs.
    """

    title: _Text
    text: str = ""
    run: Annotated[list[Run], Field(min_length=1)]


class RowsError(ValueError):
    """Raised where files of rows are wrong; says all that is wrong, with its place."""


def read_rows(folder: Path) -> list[Group]:
    """Read the files of rows in a folder, in the order of their names.

    Args:
        folder: The folder, with files such as ``10-fracture.toml``.

    Raises:
        RowsError: There is no such file, one cannot be read, a table is wrong, or two runs share a name.
    """
    paths = sorted(folder.glob("*.toml"))
    if not paths:
        raise RowsError(f"{folder} has no files of rows (*.toml)")
    groups, wrong = list[Group](), list[str]()
    for path in paths:
        try:
            groups.append(Group.model_validate(tomllib.loads(path.read_text(encoding="utf-8"))))
        except tomllib.TOMLDecodeError as error:
            wrong.append(f"{path}: {error}")
        except ValidationError as error:
            wrong += [f"{path}: {'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors()]
    wrong += _repeated([run.name for group in groups for run in group.run])
    wrong += [
        f"{run.name}: {words}"
        for group in groups
        for run in group.run
        for words in _repeated([r.name for r in run.row])
    ]
    if wrong:
        raise RowsError("\n".join(wrong))
    return groups


def _repeated(names: Sequence[str]) -> list[str]:
    return [f"the name {name} is given twice" for name in dict.fromkeys(names) if names.count(name) > 1]
