"""PDDL texts, written anew in the one form that every reader takes.

unified-planning's reader (1.3) wants the sections of a file in a certain order, an action's `:parameters` even if it
has none, and takes two parameters of a predicate for one if they have the same name, as in `(in ?obj ?obj)`.
"""

import re

__all__ = ["regular"]

ORDER = (
    *(":domain", ":requirements", ":types", ":constants", ":predicates", ":functions"),
    *(":objects", ":init", ":goal", ":constraints", ":metric"),
)
DEEPEST = 200  # parentheses within one another
_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();]+")

Form = str | list["Form"]


def regular(text: str) -> str | None:
    """The same definition in regular form, lower-cased; ``None`` if its parentheses do not match, or go too deep.

    >>> regular("(define (domain d) (:predicates (in ?x ?x)) (:types t) ; a comment")
    >>> regular("(define (domain d) (:predicates (in ?x ?x)) (:types t))")
    '(define (domain d) (:types t) (:predicates (in ?x1 ?x2)))'
    """
    forms = _parsed(text)
    if forms is None or len(forms) != 1 or not isinstance(forms[0], list):
        return None
    head, sections = forms[0][:2], [form for form in forms[0][2:] if isinstance(form, list) and form]
    sections.sort(key=lambda section: ORDER.index(str(section[0])) if section[0] in ORDER else len(ORDER))
    return _written([*head, *map(_regular_section, sections)])


def _parsed(text: str) -> list[Form] | None:
    open_: list[list[Form]] = [[]]
    for token in _TOKEN.findall(text):
        if token == "(":
            open_.append([])
            if len(open_) > DEEPEST:
                return None
        elif token == ")":
            form = open_.pop()
            if not open_:
                return None
            open_[-1].append(form)
        elif not token.startswith(";"):
            open_[-1].append(token.lower())
    return open_[0] if len(open_) == 1 else None


def _regular_section(section: list[Form]) -> list[Form]:
    if section[0] in (":predicates", ":functions"):
        return [_distinct(form) if isinstance(form, list) else form for form in section]
    if section[0] == ":action" and ":parameters" not in section:
        return [*section[:2], ":parameters", [], *section[2:]]
    return section


def _distinct(signature: list[Form]) -> list[Form]:
    """The signature with its variables numbered: no two have one name then."""
    numbered: list[Form] = []
    for form in signature:
        numbered.append(f"?x{len(numbered)}" if isinstance(form, str) and form.startswith("?") else form)
    return numbered


def _written(form: Form) -> str:
    if isinstance(form, str):
        return form
    return f"({' '.join(map(_written, form))})"
