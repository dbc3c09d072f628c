"""Contacts and ties of Abaqus as pairs of surfaces."""

from collections.abc import Iterator
from typing import Any

from cutsim.cases.importing.abaqus_file import AbaqusFile, Located
from cutsim.cases.importing.counterparts import STIFF, tie
from cutsim.cases.importing.draft import Untranslatable
from cutsim.cases.importing.surfaces import height_behind
from cutsim.readers.abaqus_cards import Card

_OPTIONS = ("FRICTION", "SURFACE BEHAVIOR")


def translate_contacts(file: AbaqusFile, young: float) -> None:
    """Translate contact pairs and ties.

    Args:
        file: The file.
        young: Young's modulus of the softest body [stress].
    """
    interactions = _interactions(file)
    for located in file.take("CONTACT PAIR"):
        with file.attempt(located.card):
            card = located.card
            if "TIED" in card.parameters:
                raise Untranslatable("TIED", card.line)
            name = card.needed("INTERACTION").upper()
            if name not in interactions:
                with card.at():
                    raise ValueError(f"there is no *SURFACE INTERACTION {name!r}")
            small = {"small_sliding": True} if "SMALL SLIDING" in card.parameters else {}
            for label, surfaces in _rows(file, located):
                values = surfaces | _law(file, interactions[name]) | small
                file.draft.add("pairs", label, values, f"line {card.line}")
    for located in file.take("TIE"):
        with file.attempt(located.card):
            for label, surfaces in _rows(file, located):
                _tie(file, located.card, label, surfaces, young)


def _interactions(file: AbaqusFile) -> dict[str, dict[str, Card]]:
    """Friction and behaviour of each surface interaction by its name in capitals."""
    found: dict[str, dict[str, Card]] = {}
    current: dict[str, Card] = {}
    for located in file.cards:
        card = located.card
        if card.keyword == "SURFACE INTERACTION":
            file.read(card)
            current = found.setdefault(card.needed("NAME").upper(), {})
        elif card.keyword in _OPTIONS and located.step == 0:
            file.read(card)
            current[card.keyword] = card
    return found


def _rows(file: AbaqusFile, located: Located) -> Iterator[tuple[str, dict[str, Any]]]:
    """Label and surfaces of each pair; the slave comes first."""
    for line, entries in located.card.rows():
        with located.card.at(line):
            if len(entries) < 2:
                raise ValueError("must have two surfaces")
            found = [file.find(file.mesh.facet_sets, entry, located.part) for entry in entries[:2]]
            if not all(len(names) == 1 for names in found):
                raise Untranslatable(f"{entries[0]} or {entries[1]} is no surface of elements", line)
            label = located.card.get("NAME") or f"{found[0][0]}_{found[1][0]}"
            yield label, {"slave": found[0][0], "master": found[1][0]}


def _law(file: AbaqusFile, options: dict[str, Card]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    if (friction := options.get("FRICTION")) is not None:
        mu = next(iter(file.numbers(friction)), 0.0)
        if "ROUGH" in friction.parameters or len(friction.data) > 1:
            raise Untranslatable("friction other than a coefficient", friction.line)
        values |= {"friction": mu} if mu else {}
    if (behaviour := options.get("SURFACE BEHAVIOR")) is not None:
        kind = behaviour.get("PRESSURE-OVERCLOSURE").upper() or "HARD"
        if kind not in ("HARD", "LINEAR") or "NO SEPARATION" in behaviour.parameters:
            raise Untranslatable(f"*SURFACE BEHAVIOR with {', '.join(behaviour.parameters)}", behaviour.line)
        if kind == "LINEAR":
            values["contact"] = {"stiffness": file.numbers(behaviour, 1)[0]}
    return values


def _tie(file: AbaqusFile, card: Card, label: str, surfaces: dict[str, Any], young: float) -> None:
    penalty = STIFF * young / height_behind(file.mesh, surfaces["slave"])
    values = surfaces | {"law": tie(penalty, young), "small_sliding": True}
    file.draft.add("pairs", label, values, f"line {card.line}")
    file.draft.difference(card.line, "*TIE: tied by a stiff bond that does not break")
