"""PDDL texts as nested forms that know their places: what the readers of domains and of problems have in common.

Names come out lower-cased, as PDDL reads them. Nothing is evaluated; nesting is bounded, so that no text can exhaust
the stack.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from clo_fleet.clo.task import Condition
from clo_fleet.errors import CloFleetError
from clo_fleet.world.schemas import OBJECT, Atom, Typed

__all__ = ["Form", "PddlError", "PddlFault", "atom", "conjuncts", "literal", "parse", "sections", "typed", "whole"]

DEEPEST = 100  # parentheses within one another
_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();]+")


@dataclass(frozen=True, slots=True, order=True)
class PddlFault:
    """One thing wrong in a PDDL text. Lines and columns count from 1."""

    line: int
    column: int
    what: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.what}"


class PddlError(CloFleetError):
    """A PDDL text cannot be used.

    Attributes:
        faults: what is wrong, each with its place in the text.
    """

    def __init__(self, faults: Iterable[PddlFault]) -> None:
        self.faults = tuple(faults)
        super().__init__("unusable PDDL:\n" + "\n".join(f"  {fault}" for fault in self.faults))


@dataclass(frozen=True, slots=True)
class Form:
    """A word, or (``word`` empty) a parenthesised list, with the line and column where it starts."""

    line: int
    column: int
    word: str = ""
    items: tuple["Form", ...] = ()

    @property
    def head(self) -> str:
        """The first word of a list."""
        return self.items[0].word if self.items else ""

    @property
    def name(self) -> str:
        """The word.

        Raises:
            PddlError: if this is a list.
        """
        if not self.word:
            raise self.error(f"expected a name, got ({self.head} ...)")
        return self.word

    def fault(self, what: str) -> PddlFault:
        """Something wrong here."""
        return PddlFault(self.line, self.column, what)

    def error(self, what: str) -> PddlError:
        """The error that something is wrong here."""
        return PddlError([self.fault(what)])


def parse(text: str, kind: str) -> Form:
    """The form ``(define (kind NAME) ...)`` that the text consists of.

    Raises:
        PddlError: if it consists of something else.
    """
    open_: list[tuple[Form, list[Form]]] = [(Form(1, 1), [])]
    line, start = 1, 0
    for match in _TOKEN.finditer(text):
        breaks = text.count("\n", start, match.start())
        line, start = line + breaks, text.rfind("\n", start, match.start()) + 1 if breaks else start
        token = match.group().lower()
        here = Form(line, match.start() - start + 1, "" if token in "()" else token)
        if token == "(":
            open_.append((here, []))
            if len(open_) > DEEPEST:
                raise here.error(f"more than {DEEPEST} parentheses within one another")
        elif token == ")":
            begin, items = open_.pop()
            if not open_:
                raise here.error("a parenthesis is closed that was never opened")
            open_[-1][1].append(Form(begin.line, begin.column, items=tuple(items)))
        elif not token.startswith(";"):
            open_[-1][1].append(here)
    if len(open_) > 1:
        raise open_[-1][0].error("this parenthesis is never closed")
    forms = open_[0][1]
    if len(forms) != 1:
        raise Form(line, 1).error(f"expected one form (define ...), got {len(forms)}")
    form = forms[0]
    if form.head != "define" or len(form.items) < 2 or form.items[1].head != kind or len(form.items[1].items) != 2:
        raise form.error(f"expected (define ({kind} NAME) ...)")
    return form


def sections(form: Form, known: set[str]) -> dict[str, Form]:
    """The parts of a definition by their keyword.

    Raises:
        PddlError: if one is none of the ``known``.
    """
    for section in form.items[2:]:
        if section.head not in known:
            raise section.error(f"{section.head or section.word or '()'} is not supported")
    return {section.head: section for section in form.items[2:]}


def conjuncts(form: Form) -> Iterator[Form]:
    """The parts of a conjunction, or the one form that is none; nothing of ``()``."""
    if form.head == "and":
        for part in form.items[1:]:
            yield from conjuncts(part)
    elif form.items or form.word:
        yield form


def literal(form: Form) -> Condition:
    """The atom, or its negation."""
    positive = form.head != "not"
    if not positive and len(form.items) != 2:
        raise form.error("expected (not (NAME TERM ...))")
    inner = form if positive else form.items[-1]
    if inner.head in ("or", "imply", "exists", "forall", "when", "not", "and"):
        raise inner.error(f"({inner.head} ...) is not supported here")
    return Condition(atom(inner), positive)


def atom(form: Form) -> Atom:
    """A predicate with its terms."""
    if not form.items:
        raise form.error(f"expected (NAME TERM ...), got {form.word or '()'}")
    return tuple(item.name for item in form.items)


def whole(form: Form) -> int:
    """A whole number."""
    if not form.word.isdecimal() or len(form.word) > 9:
        raise form.error(f"expected a whole number, got {form.word or '(...)'}")
    return int(form.word)


def typed(forms: Iterable[Form]) -> Typed:
    """The typed list ``a b - t c`` as ``((a, t), (b, t), (c, object))``."""
    result: list[tuple[str, str]] = []
    waiting: list[str] = []
    words = iter([form.name for form in forms])
    for word in words:
        type_ = next(words, "") if word == "-" else ""
        if type_:
            result += [(name, type_) for name in waiting]
            waiting = []
        else:
            waiting.append(word)
    return (*result, *((name, OBJECT) for name in waiting))
