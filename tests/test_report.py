"""The report of a run is one page that says first what is to be thought of it, and needs nothing else."""

import json
import re
from html.parser import HTMLParser

import pytest

from cutsim.results import report
from cutsim.results.presentation import plot_run, present
from cutsim.results.report import write_report, write_sweep_report
from cutsim.results.run_files import RunFiles
from cutsim.results.web_plots import energy_json, heat_json
from helpers.stages import HEADER, write_run

CASE = """title = "A cut </script> & more"
[units]
length = "mm"
[material]
young = "0.8 MPa"
[loads.press]
value = "0.1*t"
"""


class Page(HTMLParser):
    """Text of a page without scripts and styles, and the addresses that it loads."""

    def __init__(self, path):
        super().__init__()
        self.words, self.loaded, self.scripts, self._inside = [], [], [], ""
        self.feed(path.read_text(encoding="utf-8"))
        self.text = " ".join(" ".join(self.words).split())

    def handle_starttag(self, tag, attributes):
        self._inside = tag
        self.loaded += [value for name, value in attributes if name in ("src", "href", "poster", "srcset", "data")]

    def handle_endtag(self, tag):
        self._inside = ""

    def handle_data(self, data):
        if self._inside == "script":
            self.scripts.append(data)
        elif self._inside != "style":
            self.words.append(data)

    def value(self, name):
        """What a script of the page calls by a name."""
        (found,) = re.findall(rf"const {name} = (\{{.*\}});", "\n".join(self.scripts[1:]))
        return json.loads(found)


def test_page_has_the_numbers_and_needs_nothing_else(tmp_path):
    write_run(
        tmp_path, until=1.0, verdict="trusted", versions={"cutsim": "9.9"}, ranks=2, mesh={"cells": 77}, gain=0.25
    )
    (tmp_path / "case.toml").write_text(CASE)
    titles = [
        f"{name}{of} [{unit}]"
        for name, unit in zip(("residual", "displacement", "energy"), ("N", "mm", "mJ"), strict=True)
        for of in ("_initial", "", "_required")
    ]
    rows = [
        "1,0.5,1,2,1,0.1,3,4,inf,5,6,inf",
        "2,0.7,1,2,1.5,0.1,3,4,inf,5,6,inf",
        "2,0.7,2,2,0.05,0.1,3,7e-9,inf,5,6,inf",
    ]
    (tmp_path / "iterations.csv").write_text("\n".join([",".join(["step,time [s],iteration", *titles]), *rows, ""]))
    for name in ("setup.png", "animation.mp4"):
        (tmp_path / name).write_bytes(b"a picture")
    page = Page(present(tmp_path, animation=False))
    words = page.text
    start = words.index("A cut </script> & more trusted The run is complete")  # behind the title of the window
    assert start < 60 and "largest force 3 N" in words and "at depth 1 mm" in words and "0.01 %" in words
    assert "Numbers without a unit are in mm, N, s, K" in words and "young 0.8 MPa" in words and "0.1*t" in words
    assert "cells 77" in words and "gain 0.25" in words and "cutsim run case.toml -n 2 with cutsim 9.9 and" in words
    assert "hardest step, 2 at 0.7 s iteration norm initial current required 1 energy [mJ] 5.000000e+00" in words
    assert "2 displacement [mm] 3.000000e+00 7.000000e-09 – 2 residual [N]" in words
    assert "Not in this report" not in words
    assert {address.partition(":")[0] for address in page.loaded} == {"data"}
    kinds = [address[5:].partition(";")[0] for address in page.loaded]
    assert kinds.count("video/mp4") == 1 and kinds.count("image/png") == 1 + 3
    assert page.value("columns")["force"] == {"label": "force [N]", "values": [0.6, 1.2, 1.8, 2.4, 3.0]}
    view = page.value("view")
    assert [stage["label"] for stage in view["stages"]] == ["time 0 s", "time 0.5 s", "time 1 s"][
        -len(view["stages"]) :
    ]
    assert "</script" not in "".join(page.scripts[1:])
    assert {path.name for path in tmp_path.glob("*.pdf")} == {"force.pdf", "energy.pdf"}


@pytest.mark.parametrize(
    ("summary", "grade", "sentence"),
    [
        ({"verdict": "questionable", "reasons": ["a hole"], "until": 1.0}, "questionable", "but one reason speaks"),
        ({"verdict": "questionable", "reasons": ["no step succeeds"]}, "failed", "ended at time 1 of 2 s, 50%"),
        ({"verdict": "questionable", "kinds": ["interrupted"]}, "interrupted", "50%"),
        ({}, "unknown", "no verdict"),
    ],
)
def test_what_speaks_against_a_run_is_said_first(tmp_path, summary, grade, sentence):
    write_run(tmp_path, **summary)
    (tmp_path / "checkpoint").mkdir()
    (tmp_path / "checkpoint" / "one.h5").touch()
    words = Page(write_report(tmp_path)).text
    assert (f"cutsim resume {tmp_path.name}" in words) == (grade != "questionable")
    assert words.startswith(f"{grade}: {tmp_path.name} {tmp_path.name} {grade} ")
    assert sentence in words[:300] and all(reason in words[:400] for reason in summary.get("reasons", ()))
    assert "Not in this report" in words and "case.toml is not there" in words and "no animation" in words


def test_report_of_nothing_names_what_is_missing(tmp_path):
    words = Page(write_report(tmp_path / "none")).text
    assert "no verdict" in words and "history.csv is not there" in words and "no stage was recorded" in words
    for history in ("", HEADER + "\n", HEADER + "\n1,0.5,"):
        (tmp_path / "history.csv").write_text(history)
        (tmp_path / "summary.json").write_text('{"verdict": ')
        words = Page(write_report(tmp_path)).text
        assert "summary.json cannot be read" in words and "there is no curve" in words
        assert plot_run(RunFiles.read(tmp_path)) == []


def test_audits_are_stacks_beside_what_they_add_up_to(tmp_path):
    write_run(tmp_path)
    names = ["friction", "inflow", "stored", "outflow", "closure"]
    rows = ["time [s]," + ",".join(f"heat_{name} [mJ]" for name in names), "1,2,1,3,0,0", "2,4,1,4.5,0,0.1"]
    history = RunFiles.read(tmp_path).history
    assert heat_json(history) is None
    energies = {trace["name"] for trace in json.loads(energy_json(history))["data"]}
    assert energies == {"strain", "fracture", "external work", "closure"}  # what vanishes is left out
    (tmp_path / "history.csv").write_text("\n".join(rows) + "\n")
    history = RunFiles.read(tmp_path).history
    assert energy_json(history) is None
    traces = json.loads(heat_json(history))["data"]
    assert [trace["name"] for trace in traces] == ["stored", "gained", "closure"]
    text = Page(write_report(tmp_path)).text
    assert "there is no energy audit" in text and "What is stored as heat" in text


@pytest.mark.parametrize("odd", [None, 1, "x", True, [[1], 2], {"a": None}], ids=str)
def test_report_is_written_whatever_a_summary_holds(tmp_path, odd, monkeypatch):
    monkeypatch.setattr(report, "get_plotlyjs", lambda: "")
    write_run(tmp_path, verdict="trusted")
    (tmp_path / "case.toml").write_text("units = 3\nlayers = [{name = 'a'}, {name = 'b'}]\n")
    whole = json.loads((tmp_path / "summary.json").read_text())
    for name in ("verdict", "reasons", "time", "until", "versions", "ranks", "wall_time", "mesh", "curve", "other"):
        (tmp_path / "summary.json").write_text(json.dumps(whole | {name: odd}))
        write_sweep_report(tmp_path / "sweep", {tmp_path: {"a": 1}})
        assert "largest force 3 N" in Page(write_report(tmp_path)).text
    (tmp_path / "summary.json").write_text(json.dumps(odd))
    assert ("summary.json cannot be read" in Page(write_report(tmp_path)).text) != isinstance(odd, dict)


def test_report_of_a_sweep_has_a_row_and_a_curve_for_each_run(tmp_path):
    for i, summary in enumerate(
        [{"verdict": "trusted", "until": 1.0}, {"verdict": "questionable", "reasons": ["late"]}]
    ):
        write_run(tmp_path / "runs" / str(i), **summary)
    runs = {tmp_path / "runs" / str(i): {"tool.friction": i / 10} for i in range(3)}
    path = write_sweep_report(tmp_path, runs)
    page = Page(path)
    assert "3 runs: 1 trusted , 1 failed , 1 unknown" in page.text
    assert "tool.friction" in page.text and "0.2 unknown" in page.text and "late" in page.text
    assert page.loaded[1:] == [f"runs/{i}/report.html" for i in range(3)]
    (overlay,) = re.findall(r'draw\("overlay", (\{.*\})\);', page.scripts[-1])
    names = [trace.get("name") for trace in json.loads(overlay)["data"]]
    assert names == ["tool.friction = 0.0", "tool.friction = 0.1 (ends early)", None]
