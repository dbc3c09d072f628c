"""The validation: rows are read, run, compared and shown, and the committed page is made of the committed results."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from cutsim.cases import built_in_cases
from cutsim.commands.main import app
from cutsim.results.run_files import Column, RunFiles
from cutsim.validation.page import MARK, keyed, page, with_excerpts
from cutsim.validation.peers import OURS, Comparisons, Solution
from cutsim.validation.readings import ReadingError, read_value
from cutsim.validation.results import Findings, Level, judge, observed_order
from cutsim.validation.rows import RowsError, read_rows
from validation.peers import compare

ROOT = Path(__file__).parents[1]
VALIDATION = ROOT / "tests" / "validation"
PROGRAM = """
import json, pathlib, sys
folder = pathlib.Path(sys.argv[-1])
folder.mkdir(parents=True, exist_ok=True)
force = {force} * (1.1 if "--quick" in sys.argv else 1)
found = {{"force": force, "verdict": "trusted", "wall_time": 2.0, "unknowns": 9}}
(folder / "summary.json").write_text(json.dumps(found))
"""
ROWS = """
title = "Loads"
text = "Of a program."
[[run]]
name = "press"
program = "press"
  [[run.row]]
  name = "force"
  what = "Force"
  value = "2*force"
  expected = 10
  unit = "N"
  tolerance = 0.01
  source = "a book"
  quick = { tolerance = 0.2 }
  [[run.row]]
  name = "depth"
  what = "Depth"
  value = "depth"
  expected = 1
  tolerance = 0.01
  source = "another book"
"""
HISTORY = {"x": [0.0, 1.0, 2.0, 3.0], "y": [0.0, 2.0, 4.0, 5.0]}


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder with a program, its rows, and pages."""
    rows = tmp_path / "tests" / "validation" / "rows"
    rows.mkdir(parents=True)
    (rows / "10-loads.toml").write_text(ROWS)
    (rows.parent / "press.py").write_text(PROGRAM.format(force=5.02))
    (tmp_path / "docs" / "validation").mkdir(parents=True)
    (tmp_path / "docs" / "validation.md").write_text(f"# By hand\n\n{MARK}old\n")
    marks = "<!-- validation: press/force -->\n{}<!-- end of validation -->\n"
    (tmp_path / "README.md").write_text(marks.format("old\n"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_row_outside_its_tolerance_is_shown_with_its_reason(checkout):
    result = CliRunner().invoke(app, ["validate"])
    assert result.exit_code == 1 and "1 of 2 rows are within their tolerance" in result.stdout
    data = json.loads((checkout / "docs" / "validation" / "results.json").read_text())
    force, depth = data
    assert force["values"] == [10.04] and force["error"] == pytest.approx(0.004) and force["unknowns"] == 9
    assert force["trusted"] and 0 < force["seconds"] < 10 and "dolfinx" in force["made"]
    assert depth["values"] == [None] and "depth" in depth["reason"]
    text = (checkout / "docs" / "validation.md").read_text()
    assert text.startswith("# By hand") and "old" not in text and "10.04 N" in text and "outside" in text
    readme = (checkout / "README.md").read_text()
    assert "| Force | 10.04 N | 10 N | a book |" in readme and "old" not in readme


def test_a_quick_validation_has_its_own_tolerance_and_leaves_the_page(checkout):
    result = CliRunner().invoke(app, ["validate", "--quick"])
    assert result.exit_code == 0 and "1 of 1 rows" in result.stdout and "11.044" in result.stdout
    assert "old" in (checkout / "docs" / "validation.md").read_text()


def test_pictures_of_a_run_become_figures_of_the_pages(checkout):
    """Those of the level that counts; one that is missing is named."""
    rows = checkout / "tests/validation/rows/10-loads.toml"
    key = 'study = [{ size = 2 }, { size = 1 }]\nfigures = { pressed = "sub/body.png", bent = "bent.png" }'
    rows.write_text(ROWS.replace('program = "press"', f'program = "press"\n{key}'))
    drawn = '(folder / "sub").mkdir(exist_ok=True)\n(folder / "sub" / "body.png").write_text(sys.argv[2])\n'
    (checkout / "tests/validation/press.py").write_text(PROGRAM.format(force=5.0) + drawn)
    result = CliRunner().invoke(app, ["validate"])
    assert (checkout / "docs/figures/pressed.png").read_text() == "1"
    assert "figure bent: press has left no bent.png" in result.stdout


def test_runs_that_there_are_not_are_named(checkout):
    result = CliRunner().invoke(app, ["validate", "--only", "hammer"])
    assert result.exit_code == 2 and "there are press" in result.stderr


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "depth"', 'name = "force"', "the name force is given twice"),
        ('program = "press"', 'program = "press"\ncase = "dcb"', "not both"),
        ("tolerance = 0.01", "tolerance = 0", "run.0.row.0.tolerance"),
        ('unit = "N"', 'units = "N"', "run.0.row.0.units"),
        ('title = "Loads"', "title = ", "10-loads.toml"),
    ],
)
def test_wrong_rows_are_refused_with_their_place(checkout, old, new, words):
    (checkout / "tests/validation/rows/10-loads.toml").write_text(ROWS.replace(old, new, 1))
    with pytest.raises(RowsError, match=words):
        read_rows(checkout / "tests/validation/rows")


def files(**summary):
    history = {name: Column(name, "", np.array(values)) for name, values in HISTORY.items()}
    return RunFiles(Path(), summary, history, "", ())


def level(**summary):
    return Level(files(**summary), 0, 1.0)


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("max(y) / given", 2.5),
        ("at(x, 1.5, y)", 3.0),
        ("mean(x, 0, 2, y)", 2.0),
        ("slope(x, 0, 2, y)", 2.0),
        ("work(x, y)", 8.5),
        ("last(y) - first(y) + min(x)", 5.0),
        ("sqrt(sum(x) + 3)", 3.0),
        ("summary('mu 0.3', 'peaks', 1)", 7.0),
    ],
)
def test_values_are_read_from_histories_and_summaries(expression, value):
    assert read_value(expression, files(given=2.0, **{"mu 0.3": {"peaks": [6.0, 7.0]}})) == pytest.approx(
        value, rel=1e-12
    )


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("z", "z"),
        ("summary('given')", "given"),
        ("x", "for each step"),
        ("x[0] / x[1] * 1e400", "not finite"),
        ("at(x, 7, y)", "never reached"),
        ("1/0", "division"),
        ("__import__('os')", "import"),
        ("mean(x, 5, 6, y)", "fewer than two"),
    ],
)
def test_what_cannot_be_read_is_named(expression, words):
    with pytest.raises(ReadingError, match=words):
        read_value(expression, files())


def test_a_study_shows_its_order(checkout):
    text = ROWS.replace('program = "press"', 'case = "dcb"\nstudy = [{ a = 1 }, { a = 2 }]', 1)
    (checkout / "tests/validation/rows/10-loads.toml").write_text(text)
    (run,) = read_rows(checkout / "tests/validation/rows")[0].run
    assert run.levels == [{"a": 1}, {"a": 2}]
    result = judge(run, run.row[0], [level(force=5.4), level(force=5.1)], "today", quick=False)
    assert result.order == pytest.approx(2.0) and result.error == pytest.approx(0.02) and not result.inside
    assert result.values == (10.8, 10.2) and result.seconds == 2.0


@pytest.mark.parametrize(
    ("values", "order"),
    [
        ([1.4, 1.1], 2.0),  # of the errors
        ([0.6, 0.9], 2.0),
        ([1.4, 0.9], None),  # which change their sign
        ([1.08, 1.02], None),  # or are too small
        ([1.9, 1.5, 1.4], 2.0),  # of the differences, to a limit that is not the reference
        ([0.8, 1.4, 1.1], None),  # differences that change their sign
        ([1.1, 1.4, 1.9], None),  # or grow
        ([9.0, 1.9, 1.5, 1.4], 2.0),
        ([1.1, 1.4], None),  # no error that falls
        ([1.1, None], None),
        ([1.2, None, 1.1], None),
        ([1.0, 1.0], None),
    ],
)
def test_an_order_is_that_of_differences_or_errors_that_fall(values, order):
    assert observed_order(values, 1.0, 2.0, 0.05) == (order if order is None else pytest.approx(order))


def test_a_program_makes_a_study_with_its_options(checkout):
    text = ROWS.replace('program = "press"', 'program = "press"\nstudy = [{ coarser = 2 }, {}]', 1)
    text = text.replace('value = "2*force"', 'value = "2*force"\nrefinement = 4', 1)
    (checkout / "tests/validation/rows/10-loads.toml").write_text(text)
    program = PROGRAM.replace("{force} *", '(5 + 0.08 * ("--coarser" in sys.argv) + 0.02) *')
    (checkout / "tests/validation/press.py").write_text(program.replace("{{", "{").replace("}}", "}"))
    CliRunner().invoke(app, ["validate"])
    force, _ = json.loads((checkout / "docs" / "validation" / "results.json").read_text())
    assert force["values"] == [10.2, 10.04] and force["order"] == pytest.approx(np.log(5) / np.log(4))
    result = CliRunner().invoke(app, ["validate", "--quick"])  # on the mesh of the quick program alone
    assert result.exit_code == 0 and "11.044" in result.stdout


def test_a_study_of_a_program_is_a_list_of_values(checkout):
    text = ROWS.replace('value = "2*force"', 'value = ["coarse", "fine"]', 1)
    (checkout / "tests/validation/rows/10-loads.toml").write_text(text)
    (run,) = read_rows(checkout / "tests/validation/rows")[0].run
    result = judge(run, run.row[0], [level(coarse=10.2, fine=10.05)], "today", quick=False)
    assert result.values == (10.2, 10.05) and result.order == pytest.approx(2.0)
    result = judge(run, run.row[0], [level(coarse=10.2)], "today", quick=True)
    assert result.values == (10.2,) and result.inside and not result.reason, (
        "a quick program makes the coarse mesh only"
    )
    result = judge(run, run.row[0], [level(coarse=10.2)], "today", quick=False)
    assert not result.inside and "fine" in result.reason


def test_the_committed_page_is_made_of_the_committed_results():
    groups = read_rows(ROOT / "tests" / "validation" / "rows")
    found = Findings.read(ROOT / "docs" / "validation" / "results.json")
    keys = [key for key, _ in keyed(groups)]
    assert list(found.results) == [key for key in keys if key in found.results], "results of rows that are gone"
    text = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    peers = Comparisons.read(VALIDATION / "peers" / "problems.toml", VALIDATION / "peers.json")
    assert text == page(text, groups, found, peers), "run: cutsim validate --page"
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert readme == with_excerpts(readme, groups, found), "run: cutsim validate --page"


def test_what_the_rows_run_is_there():
    runs = [run for group in read_rows(ROOT / "tests" / "validation" / "rows") for run in group.run]
    programs = {run.program for run in runs if run.program}
    assert programs <= {path.stem for path in (ROOT / "tests" / "validation").glob("[a-z]*.py")}
    assert {run.case for run in runs if run.case} <= {*built_in_cases(), *map(str, ROOT.glob("tests/**/*.toml"))}
    assert sum(len(run.row) for run in runs) >= 80


PROBLEMS = """
[[problem]]
name = "beam"
what = "**Beam.**"
unit = { "force" = "N", "ratio" = "" }
program = [{ name = "cutsim", script = "ours.py" }, { name = "theirs", script = "theirs.py", module = "json" },
  { name = "absent", script = "absent.py", module = "no_such_module_anywhere" },
  { name = "mute", script = "mute.py", command = "no-such-command-anywhere" }]
"""
SOLVED = 'print(\'log\')\nprint(\'{{"values": {{"force": {}, "ratio": 1}}, {}}}\')\n'


@pytest.fixture
def peers(tmp_path):
    """A problem that two programs solve, and two that are not installed."""
    numbers = '"iterations": 3, "seconds": 1.5, "unknowns": 8'
    (tmp_path / "problems.toml").write_text(PROBLEMS)
    (tmp_path / "ours.py").write_text(SOLVED.format(2.0, numbers))
    (tmp_path / "theirs.py").write_text(SOLVED.format(2.02, numbers + ', "version": "7.1"'))
    return tmp_path


def test_programs_are_compared_and_what_is_not_installed_keeps_its_results(peers, capsys):
    data = peers / "peers.json"
    old = Solution("beam", "mute", {"force": 3.0, "ratio": 1.0}, None, 9.0, 8, "long ago")
    short = SOLVED.replace(', "ratio": 1', "")
    (peers / "theirs.py").write_text(
        short.format(2.02, '"iterations": 3, "seconds": 1.5, "unknowns": 8, "version": "7.1"')
    )
    gone = Solution("plate", "cutsim", {}, 1, 1.0, 1, "long ago")
    Comparisons([], {("beam", "mute"): old, ("plate", "cutsim"): gone}).write(data)
    compare.main(folder=peers, data=data)
    said = capsys.readouterr().out
    assert "beam, absent: not installed" in said and "No module named 'no_such_module_anywhere'" in said
    assert "beam, mute: not installed (there is no command no-such-command-anywhere)" in said
    found = Comparisons.read(peers / "problems.toml", data)
    assert [program for _, program in found.solutions] == ["cutsim", "theirs", "mute"]
    assert found.solutions["beam", "mute"] == old and "theirs 7.1" in found.solutions["beam", "theirs"].made
    section = found.section()
    assert section.startswith("**Beam.**") and "| program | force [N] | ratio |" in section
    assert "| theirs | 2.02 | not reached | 1 % | 8 | 3 | 1.5 |" in section and "| absent | not run |" in section
    assert "| mute | 3 | 1 | 50 % | 8 |  | 9.0 | long ago |" in section


def test_a_script_that_fails_says_why(peers):
    (peers / "ours.py").write_text("raise ValueError('no such beam')")
    with pytest.raises(RuntimeError, match="no such beam"):
        compare.main(folder=peers, data=peers / "peers.json")


def test_scripts_of_all_peers_are_there_and_have_values_of_the_page():
    comparisons = Comparisons.read(VALIDATION / "peers" / "problems.toml", VALIDATION / "peers.json")
    assert len(comparisons.problems) >= 3
    for problem in comparisons.problems:
        assert problem.program[0].name == OURS
        assert all((VALIDATION / "peers" / program.script).exists() for program in problem.program)
    for (name, _), solution in comparisons.solutions.items():
        (problem,) = (p for p in comparisons.problems if p.name == name)
        assert solution.values and set(solution.values) <= set(problem.unit)
