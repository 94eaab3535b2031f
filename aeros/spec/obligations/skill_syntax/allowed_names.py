"""Names that skill code may use: modules and their members, builtins, and attributes of plain values.

Every name is listed, so a new version of Python adds nothing by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final


def split_names(names: str) -> frozenset[str]:
    """Split a list of names, as in `acos asin`.

    Args:
        names: names with blanks between them.

    Returns:
        The names.
    """
    return frozenset(names.split())


@dataclass(frozen=True)
class AllowedNames:
    """Names that one kind of module code may use.

    Attributes:
        kind: the kind of code, as in `skill`.
        members: members that it may import, by module.
        attributes: attributes that it may read, next to the members of its own classes.
        task: sentence about the only things that such code does.
        advice: advice on what to import.
    """

    kind: str
    members: Mapping[str, frozenset[str]]
    attributes: frozenset[str]
    task: str
    advice: str

    @cached_property
    def modules(self) -> frozenset[str]:
        """Modules that may be imported as a whole; a module with an interface to AEROS may not."""
        return frozenset(module for module in self.members if not module.startswith("aeros."))


SKILL_INTERFACE: Final = "aeros.skill"

_ABSTRACT_TYPES: Final = "Callable Collection Generator Iterable Iterator Mapping Sequence"

ALLOWED_MEMBERS: Final[Mapping[str, frozenset[str]]] = {
    SKILL_INTERFACE: split_names(
        "Action ActionDenied Inputs Model ModelError Models Observation SkillBody Way act first_allowed"
    ),
    "__future__": split_names("annotations"),
    "bisect": split_names("bisect bisect_left bisect_right insort insort_left insort_right"),
    "cmath": split_names(
        "acos acosh asin asinh atan atanh cos cosh e exp inf infj isclose isfinite isinf isnan log log10 nan "
        "nanj phase pi polar rect sin sinh sqrt tan tanh tau"
    ),
    "collections.abc": split_names(
        f"{_ABSTRACT_TYPES} Container Hashable ItemsView KeysView MutableMapping MutableSequence MutableSet "
        "Reversible Set Sized ValuesView"
    ),
    "dataclasses": split_names("asdict astuple dataclass field replace"),
    "decimal": split_names("Decimal"),
    "enum": split_names("Enum Flag IntEnum IntFlag StrEnum auto unique"),
    "fractions": split_names("Fraction"),
    "functools": split_names("cache cmp_to_key lru_cache partial reduce"),
    "heapq": split_names("heapify heappop heappush heappushpop heapreplace merge nlargest nsmallest"),
    "itertools": split_names(
        "accumulate batched chain combinations combinations_with_replacement compress count cycle dropwhile "
        "filterfalse groupby islice pairwise permutations product repeat starmap takewhile tee zip_longest"
    ),
    "math": split_names(
        "acos acosh asin asinh atan atan2 atanh cbrt ceil comb copysign cos cosh degrees dist e erf "
        "erfc exp exp2 expm1 fabs factorial floor fma fmod frexp fsum gamma gcd hypot inf isclose "
        "isfinite isinf isnan isqrt lcm ldexp lgamma log log10 log1p log2 modf nan nextafter perm pi "
        "pow prod radians remainder sin sinh sqrt sumprod tan tanh tau trunc ulp"
    ),
    "statistics": split_names(
        "StatisticsError correlation covariance fmean geometric_mean harmonic_mean linear_regression "
        "mean median median_grouped median_high median_low mode multimode pstdev pvariance quantiles "
        "stdev variance"
    ),
    "typing": split_names(
        f"{_ABSTRACT_TYPES} Any ClassVar Final Literal NamedTuple Never NoReturn Optional Self "
        "TypeAlias Union assert_never cast"
    ),
}
"""Members that skill code may import, by module.  They compute; none runs code or changes what is shared."""

ALLOWED_MODULES: Final = frozenset(ALLOWED_MEMBERS) - {SKILL_INTERFACE}
"""Standard modules that skill code may import."""

ALLOWED_BUILTINS: Final = split_names(
    "ArithmeticError AssertionError AttributeError Ellipsis Exception IndexError KeyError LookupError "
    "NameError NotImplemented NotImplementedError OverflowError RuntimeError StopIteration TypeError "
    "ValueError ZeroDivisionError abs all any ascii bin bool callable chr classmethod complex dict "
    "divmod enumerate filter float format frozenset hash hex int isinstance issubclass iter len list "
    "map max min next object oct ord pow property range repr reversed round set slice sorted "
    "staticmethod str sum tuple zip"
)
"""Builtins that skill code may use; none reaches attributes by computed names, files or the interpreter."""

GENERIC_TYPES: Final = split_names(f"dict frozenset list set tuple {_ABSTRACT_TYPES}")
"""Types that take element types in brackets and, called, make no element.

`Union[X]` and `Annotated[X, ...]` are not among them: they are `X`, or make one.
"""

BASE_CLASSES: Final = frozenset(
    ("enum.Enum", "enum.Flag", "enum.IntEnum", "enum.IntFlag", "enum.StrEnum", "typing.NamedTuple")
)
"""Members that are only base classes: called, they make classes from names that nobody can read."""

FUNCTION_DECORATORS: Final = frozenset(("functools.cache", "functools.lru_cache"))
METHOD_DECORATORS: Final = FUNCTION_DECORATORS | {"classmethod", "property", "staticmethod"}
CLASS_DECORATORS: Final = frozenset(("dataclasses.dataclass", "enum.unique"))

ALLOWED_ATTRIBUTES: Final = split_names(
    # text
    "capitalize casefold center count encode endswith expandtabs find index isalnum isalpha isascii "
    "isdecimal isdigit isidentifier islower isnumeric isprintable isspace istitle isupper join ljust "
    "lower lstrip maketrans partition removeprefix removesuffix replace rfind rindex rjust rpartition "
    "rsplit rstrip split splitlines startswith strip swapcase title translate upper zfill "
    # lists, mappings and sets
    "add append clear copy difference difference_update discard extend fromkeys get insert "
    "intersection intersection_update isdisjoint issubset issuperset items keys pop popitem remove "
    "reverse setdefault sort symmetric_difference symmetric_difference_update union update values "
    # numbers
    "as_integer_ratio bit_count bit_length conjugate denominator from_decimal from_float imag "
    "is_finite is_infinite is_integer is_nan limit_denominator numerator quantize real "
    # generators, exceptions, enumerations, slices, iterators, actions and their denials
    "args close from_iterable kind name observed send start step stop value "
    # models
    "content run"
)
"""Attributes of plain values that skill code may read, next to the members of its own classes."""

FORBIDDEN_ATTRIBUTES: Final = split_names("format format_map func mro obj parameters register type")
"""Attributes that reach further, so that no class of the code may have a member of that name.

`format` reads attributes that its text names, `type` is the annotation of a field, and `parameters` would
change an action once it is made.
"""

INTROSPECTION_PREFIXES: Final = ("_", "ag_", "co_", "cr_", "f_", "func_", "gi_", "im_", "tb_")
"""Prefixes of attributes that are private, or expose frames, code and generators."""

SKILL_NAMES: Final = AllowedNames(
    "skill",
    ALLOWED_MEMBERS,
    ALLOWED_ATTRIBUTES,
    "a skill only yields actions and receives observations",
    "import only from `aeros.skill` and modules such as `math`; yield actions for the rest",
)
"""Names that skill code may use."""
