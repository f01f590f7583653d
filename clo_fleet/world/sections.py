"""What map and world files share: the types of their values, and faults in plain words.

pydantic checks the sections; its errors end here. A faulty key is taken out and the rest checked again, so that
the checks of the setting can judge what is sound and every fault of a file is told at once.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Generic, Literal, TypeVar, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, JsonValue, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from clo_fleet.clo.task import FactSyntaxError, parse_fact
from clo_fleet.world.faults import Fault, FileFaultsError, Finding, KeyPath, did_you_mean, value_text
from clo_fleet.world.yaml_file import Value, YamlFile

__all__ = [
    "Coordinate",
    "FactText",
    "Fraction",
    "Id",
    "NonNegative",
    "Outline",
    "Parsed",
    "PointM",
    "Positive",
    "Section",
    "Text",
    "Variable",
    "is_id",
    "json_schema",
    "parse",
]

ID_PATTERN = "^[a-z][a-z0-9_-]*$"
VARIABLE_PATTERN = r"^\??[a-z][a-z0-9_-]*$"  # YAML wants quotes about ?r between braces, so r will do
TEXT_PATTERN = r"^[^\x00-\x1f\x7f-\x9f]+$"
UNITS = re.compile(r"_(m|mm|cm|km|s|ms|min|h|rad|deg|m_s|km_h|m_s2|kg|g|mb|kb|gb|hz)$")
SEPARATE = frozenset({"goals", "disturbances", "facts"})  # lists whose items stand for themselves: one may be taken out

EXPECTED = {
    "missing": "a value: this key is required",
    "bool_type": "true or false",
    "dict_type": "names with values below them",
    "float_type": "a number",
    "finite_number": "a finite number",
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "int_type": "a whole number",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "literal_error": "{expected}",
    "model_attributes_type": "keys with values below them",
    "model_type": "keys with values below them",
    "string_too_long": "at most {max_length} characters",
    "string_type": "text",
    "string_unicode": "text",
    "too_long": "at most {max_length} entries",
    "too_short": "at least {min_length} entries",
    "tuple_type": "a list",
    "union_tag_invalid": "one of {expected_tags}",
    "union_tag_not_found": "a value: this key is required",
}
PATTERNS = {
    ID_PATTERN: "a name of lower-case letters, digits, '_' and '-' that starts with a letter",
    VARIABLE_PATTERN: "the name of a parameter, such as r",
    TEXT_PATTERN: "text without control characters",
}


def _two(point: tuple[float, ...]) -> tuple[float, ...]:
    if len(point) != 2:
        raise PydanticCustomError("point", "a point [x, y] in metres")
    return point


def _fact(text: str) -> str:
    try:
        parse_fact(text)
    except FactSyntaxError:
        raise PydanticCustomError("fact", "one fact, such as '(holding r1 o2)'") from None
    return text


Id = Annotated[str, Field(pattern=ID_PATTERN, max_length=64)]
Variable = Annotated[str, Field(pattern=VARIABLE_PATTERN, max_length=64)]
FactText = Annotated[str, Field(max_length=300), AfterValidator(_fact)]
Text = Annotated[str, Field(pattern=TEXT_PATTERN, max_length=200)]
Positive = Annotated[float, Field(gt=0, le=1e9)]
NonNegative = Annotated[float, Field(ge=0, le=1e9)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]  # larger than any building; beyond it doubles lose millimetres
PAIR: dict[str, JsonValue] = {"minItems": 2, "maxItems": 2}
PointM = Annotated[tuple[Coordinate, ...], AfterValidator(_two), Field(json_schema_extra=PAIR)]
Outline = Annotated[tuple[PointM, ...], Field(min_length=3, max_length=10_000)]


class Section(BaseModel):
    """Keys with values in a file: no others, no conversions, no infinite numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


S = TypeVar("S", bound=Section)


@dataclass(frozen=True, slots=True, kw_only=True)
class Parsed(Generic[S]):
    """The sound part of a file.

    Attributes:
        file: the file with its places.
        sections: what could be read; faulty keys are at their defaults, entries that need them are missing.
        unsound: entries, as ``("rooms", "l1")``, that lack something or are missing; also faulty keys of the top level.
        kept: of each list from which items were taken out: the indices in the file of the items that remain.
        faults: everything found so far, in the order of lines.
    """

    file: YamlFile
    sections: S
    unsound: frozenset[KeyPath]
    kept: Mapping[KeyPath, tuple[int, ...]]
    faults: tuple[Fault, ...]

    def located(self, findings: Iterable[Finding]) -> tuple[Fault, ...]:
        """All faults of the file: those found so far and the findings with their places."""
        faults = {*self.faults}
        for finding in findings:
            key: KeyPath = ()
            for part in finding.key:
                key = (*key, self.kept[key][part] if isinstance(part, int) and key in self.kept else part)
            faults.add(self.file.fault(Finding(key, finding.expected, finding.value)))
        return tuple(sorted(faults))


def parse(file: YamlFile, schema: type[S], stand_ins: Mapping[str, Value]) -> Parsed[S]:
    """The file's sections as the schema describes them.

    Args:
        file: the file as YAML.
        schema: its top level.
        stand_ins: values for required keys of the top level, for the case that they are missing or faulty;
            ``format`` is the only format that is read.

    Raises:
        FileFaultsError: if the file says that it has another format: its keys may then mean anything.
    """
    stated = file.content.get("format")
    if stated is not None and stated != stand_ins["format"]:
        expected = f"{stand_ins['format']}, the only format read here"
        raise FileFaultsError([file.fault(Finding(("format",), expected))])
    content = _copy(file.content)
    found: list[Fault] = list(file.faults)
    known = {(fault.line, fault.column, fault.key) for fault in file.faults}
    unsound: set[KeyPath] = set()
    kept: dict[KeyPath, list[int]] = {}
    first = True
    while True:
        try:
            sections = schema.model_validate(_frozen(content))
            break
        except ValidationError as error:
            details = error.errors(include_url=False)
        if first:
            faults = [file.fault(_finding(schema, content, detail)) for detail in details]
            found += [fault for fault in faults if (fault.line, fault.column, fault.key) not in known]
            first = False
        paths = {_removable(_path(content, detail), detail["type"] == "missing") for detail in details}
        for path in sorted(paths, key=_order, reverse=True):  # from the back, so that indices stay right
            unsound.add(path[:2])
            if not any(path[:depth] in paths for depth in range(1, len(path))):
                _remove(content, path, kept, stand_ins)
    return Parsed(
        file=file,
        sections=sections,
        unsound=frozenset(unsound),
        kept={path: tuple(indices) for path, indices in kept.items()},
        faults=tuple(sorted(set(found))),
    )


def is_id(value: object) -> bool:
    """Whether the value is a name as the keys of robots, objects and rooms are."""
    return isinstance(value, str) and len(value) <= 64 and re.fullmatch(ID_PATTERN, value) is not None


def json_schema(schema: type[Section], title: str) -> dict[str, object]:
    """The JSON schema by which editors check and complete files as they are written."""
    body = schema.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **body, "title": title}


def _finding(schema: type[Section], content: Any, detail: ErrorDetails) -> Finding:
    """The pydantic error in plain words, at its key path."""
    kind, context = detail["type"], detail.get("ctx", {})
    path = _path(content, detail)
    if kind == "extra_forbidden":
        return Finding(path, _known_key(str(path[-1]), _keys(schema, detail["loc"][:-1])))
    if kind.startswith("union_tag"):
        path = (*path, str(context["discriminator"]).strip("'"))
    expected = PATTERNS.get(str(context.get("pattern")))
    if expected is None:
        expected = EXPECTED[kind].format(**context) if kind in EXPECTED else detail["msg"]
    if kind in ("float_type", "int_type") and _is_number(detail["input"]):
        expected += ", without quotes"
    return Finding(path, expected, value_text(path[-1]) if detail["loc"][-1:] == ("[key]",) else None)


def _known_key(key: str, known: Iterable[str]) -> str:
    keys = sorted(known)
    for candidate in keys:
        bare = UNITS.sub("", candidate)
        if bare != candidate and UNITS.sub("", key) == bare:
            return f"a known key; did you mean {candidate}? keys carry their unit"
    return f"a known key{did_you_mean(key, keys) or ': one of ' + ', '.join(keys)}"


def _keys(annotation: Any, loc: tuple[int | str, ...]) -> tuple[str, ...]:
    """The keys of the section at pydantic's path ``loc`` below a type."""
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    members = get_args(annotation)
    if isinstance(annotation, type) and issubclass(annotation, Section):
        fields = {field.alias or name: field.annotation for name, field in annotation.model_fields.items()}
        return _keys(fields[str(loc[0])], loc[1:]) if loc else tuple(fields)
    if get_origin(annotation) in (Union, UnionType):
        tagged = [member for member in members if loc and loc[0] in _tags(member)]
        return _keys(tagged[0], loc[1:]) if tagged else _keys(members[0], loc)
    return _keys(members[-1] if get_origin(annotation) is dict else members[0], loc[1:])


def _tags(member: Any) -> tuple[object, ...]:
    """What tells a member of a union from the others: the values of the first key that has but certain ones."""
    annotations = (field.annotation for field in getattr(member, "model_fields", {}).values())
    return next((get_args(annotation) for annotation in annotations if get_origin(annotation) is Literal), ())


def _path(content: Any, detail: ErrorDetails) -> KeyPath:
    """The key path in the file; pydantic's own path also names members of unions and marks faulty keys."""
    path: KeyPath = ()
    for part in detail["loc"]:
        is_index = isinstance(content, list) and isinstance(part, int) and part < len(content)
        if is_index or (isinstance(content, dict) and part in content):
            content = content[part]
            path = (*path, part)
    return (*path, detail["loc"][-1]) if detail["type"] == "missing" else path


def _removable(path: KeyPath, missing: bool) -> KeyPath:
    """The path of what can be taken out whole: of a missing key the section, of a point the outline.

    A missing key of the top level stays itself: a stand-in takes its place.
    """
    path = path[:-1] if missing and len(path) > 1 else path
    for depth, part in enumerate(path):
        if isinstance(part, int) and path[depth - 1] not in SEPARATE:
            return path[:depth]
    return path


def _remove(content: Any, path: KeyPath, kept: dict[KeyPath, list[int]], stand_ins: Mapping[str, Value]) -> None:
    """Take the value at the path out of the content, or put the stand-in there if there is none."""
    *way, last = path
    parent = content
    for part in way:
        parent = parent[part]
    if isinstance(parent, list) and isinstance(last, int):
        del kept.setdefault(tuple(way), list(range(len(parent))))[last]
        del parent[last]
    elif last in parent:
        del parent[last]
    else:
        parent[last] = _copy(stand_ins[str(last)])


def _order(path: KeyPath) -> list[tuple[bool, int, str]]:
    """A key to sort paths by that hold names and indices."""
    return [(isinstance(part, str), part if isinstance(part, int) else 0, str(part)) for part in path]


def _copy(value: Value) -> Any:
    """The value with lists in place of tuples, to take parts out."""
    if isinstance(value, dict):
        return {key: _copy(entry) for key, entry in value.items()}
    return [_copy(item) for item in value] if isinstance(value, tuple) else value


def _frozen(value: Any) -> Any:
    """The value with tuples in place of lists, as the schema wants them."""
    if isinstance(value, dict):
        return {key: _frozen(entry) for key, entry in value.items()}
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


def _is_number(value: object) -> bool:
    return isinstance(value, str) and re.fullmatch(r"\s*[-+]?[0-9.]+(e[-+]?[0-9]+)?\s*", value, re.I) is not None
