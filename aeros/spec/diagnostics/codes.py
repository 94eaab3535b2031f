"""Diagnostics as data: a registered code, a headline, the places concerned, and what to do.

Renderers only read them. Code that finds a problem reports it to a `Diagnostics` and continues, so that one
run shows every problem.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final

from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.diagnostics.source import SourceSpan


class Severity(Enum):
    """Severity of a diagnostic. Only an ERROR refuses; a WARNING and a NOTE inform."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class DiagnosticCode:
    """One kind of problem.

    Attributes:
        id: its stable id, such as `AE104`.
        slug: readable name, such as `missing-value`.
        group: group of claims that it belongs to, such as `form`.
        summary: the problem in a clause.
    """

    id: str
    slug: str
    group: str
    summary: str


_TABLE: Final = (
    # AE0xx: bytes, characters and YAML
    DiagnosticCode("AE001", "duplicate-key", "form", "a mapping has the same key twice"),
    DiagnosticCode("AE002", "unreadable-file", "form", "a path is missing, unreadable or not a regular file"),
    DiagnosticCode("AE003", "too-large", "form", "a file is larger than any manifest may be"),
    DiagnosticCode("AE004", "not-utf8", "form", "a file is not UTF-8"),
    DiagnosticCode(
        "AE005", "forbidden-character", "form", "a character is invisible or changes how text is shown"
    ),
    DiagnosticCode("AE006", "empty-document", "form", "a file declares nothing"),
    DiagnosticCode("AE007", "yaml-syntax", "form", "a file is not well-formed YAML"),
    DiagnosticCode("AE008", "tab-indentation", "form", "a tab stands where YAML needs spaces"),
    DiagnosticCode("AE009", "unclosed-quote", "form", "a quoted text has no closing quote"),
    DiagnosticCode("AE010", "too-deep", "form", "values are nested deeper than any manifest needs"),
    DiagnosticCode(
        "AE011", "anchor-or-alias", "form", "a value is written by reference instead of written out"
    ),
    DiagnosticCode("AE012", "explicit-tag", "form", "a value has a YAML tag; types come from the schema"),
    DiagnosticCode("AE013", "several-documents", "form", "a file holds more than one document"),
    DiagnosticCode("AE014", "complex-key", "form", "a key is not text"),
    DiagnosticCode("AE015", "merge-key", "form", "a mapping is merged into another by `<<`"),
    DiagnosticCode("AE016", "directive", "form", "a file begins with a YAML directive"),
    DiagnosticCode("AE017", "too-many-values", "form", "a file holds more values than any manifest needs"),
    # AE1xx: schema, names, form
    DiagnosticCode("AE101", "unknown-field", "form", "a mapping has a field its schema does not know"),
    DiagnosticCode("AE102", "missing-field", "form", "a mapping lacks a required field"),
    DiagnosticCode(
        "AE103", "wrong-kind", "form", "a value has the wrong kind: mapping, list or single value"
    ),
    DiagnosticCode("AE104", "missing-value", "form", "a field is written without a value"),
    DiagnosticCode("AE105", "malformed-name", "form", "a name does not have the required form"),
    DiagnosticCode("AE106", "malformed-boolean", "form", "a truth value is not `true` or `false`"),
    DiagnosticCode("AE107", "malformed-integer", "form", "an integer is not written in plain decimal digits"),
    DiagnosticCode("AE108", "malformed-number", "form", "a number is not a finite decimal"),
    DiagnosticCode("AE109", "quoted-value", "form", "a number or truth value is in quotes"),
    DiagnosticCode("AE110", "unknown-choice", "form", "a value is not one of the allowed words"),
    DiagnosticCode("AE111", "out-of-bounds", "form", "a number is outside its declared bounds"),
    DiagnosticCode("AE112", "wrong-length", "form", "a list or mapping has too few or too many entries"),
    DiagnosticCode(
        "AE114", "format-version", "form", "a file has a format version that this AEROS does not read"
    ),
    DiagnosticCode("AE120", "duplicate-id", "form", "two declarations have the same name"),
    DiagnosticCode("AE121", "name-clash", "form", "a name already means something else"),
    DiagnosticCode("AE122", "unknown-reference", "form", "a name refers to nothing that is declared"),
    DiagnosticCode(
        "AE123", "missing-entry-point", "form", "a skill's or perceiver's function does not exist"
    ),
    DiagnosticCode(
        "AE124", "not-a-generator", "form", "a skill's function yields no action, or a perceiver's no values"
    ),
    DiagnosticCode("AE125", "malformed-version", "form", "a version or version range cannot be read"),
    DiagnosticCode(
        "AE127", "probability", "form", "the probabilities of a skill's outcomes do not form a distribution"
    ),
    DiagnosticCode("AE128", "no-success", "form", "a skill has no outcome that is a success"),
    DiagnosticCode(
        "AE129", "beyond-limits", "form", "a timeout or retry budget exceeds what the site allows"
    ),
    DiagnosticCode("AE130", "no-module", "form", "a path holds no module"),
    DiagnosticCode("AE131", "missing-file", "form", "a file that the manifest names is not in the module"),
    DiagnosticCode("AE132", "malformed-license", "form", "a licence is not an SPDX expression"),
    DiagnosticCode(
        "AE133", "undeclared-action", "form", "skill code asks for an action that is not in its envelope"
    ),
    DiagnosticCode(
        "AE134",
        "reaching-code",
        "form",
        "module code uses more than actions, observations and pure computation",
    ),
    DiagnosticCode(
        "AE135",
        "shared-otherwise",
        "form",
        "a module declares a variable otherwise than the site shares it",
    ),
    DiagnosticCode(
        "AE136", "not-configured", "form", "a need of a module is not bound, or a parameter has no value"
    ),
    DiagnosticCode("AE137", "unusable-tool", "form", "a site declares a tool that it could not rely on"),
    DiagnosticCode(
        "AE138", "other-meaning", "form", "an action kind has other parameters than the action that it means"
    ),
    DiagnosticCode("AE139", "not-python", "form", "a file of module code is not plain Python"),
    DiagnosticCode("AE140", "overlapping-bodies", "form", "two bodies of a scene overlap"),
    DiagnosticCode("AE141", "unusable-model", "form", "a model file does not describe a body"),
    DiagnosticCode("AE142", "model-interface", "form", "a model's file lacks the interface that is declared"),
    DiagnosticCode(
        "AE143", "missing-neighbour", "form", "code imports a file or a name that the module does not have"
    ),
    DiagnosticCode("AE144", "import-cycle", "form", "files of a module import each other in a circle"),
    DiagnosticCode("AE145", "shared-memory", "form", "a value that comes from memory is public or shared"),
    DiagnosticCode("AE146", "lost-action", "form", "skill code makes an action and does not ask for it"),
    DiagnosticCode(
        "AE147",
        "unknown-key",
        "form",
        "code uses a name that its observation, inputs, pictures, models or results lack",
    ),
    DiagnosticCode("AE148", "always-denied", "form", "skill code asks for an action outside of its envelope"),
    DiagnosticCode(
        "AE149", "missing-parameter", "form", "skill code asks for an action without one of its parameters"
    ),
    # AE2xx: the expression language
    DiagnosticCode("AE201", "expression-syntax", "form", "an expression cannot be parsed"),
    DiagnosticCode("AE202", "unknown-name", "form", "an expression uses a name that is not declared"),
    DiagnosticCode(
        "AE203", "type-mismatch", "form", "an expression combines values of types that do not fit"
    ),
    DiagnosticCode("AE204", "unit-mismatch", "form", "an expression combines values of different dimensions"),
    DiagnosticCode(
        "AE205", "wrong-arguments", "form", "a function is called with the wrong number of arguments"
    ),
    DiagnosticCode("AE206", "division", "form", "an expression divides by something other than a constant"),
    DiagnosticCode("AE207", "malformed-quantity", "form", "a value with a unit cannot be read"),
    DiagnosticCode(
        "AE208", "malformed-declaration", "form", "a variable or volume is declared inconsistently"
    ),
    DiagnosticCode(
        "AE209", "past-time", "form", "a condition uses a past-time operator where none is allowed"
    ),
    # AE3xx: dependencies
    DiagnosticCode("AE301", "missing-dependency", "dependencies", "a required module is missing"),
    DiagnosticCode("AE302", "dependency-version", "dependencies", "a required module has another version"),
    DiagnosticCode("AE303", "dependency-cycle", "dependencies", "modules depend on each other in a cycle"),
    DiagnosticCode(
        "AE304", "incompatible-runtime", "dependencies", "a module does not work with this runtime"
    ),
    DiagnosticCode("AE305", "missing-capability", "dependencies", "no module provides a required capability"),
    DiagnosticCode(
        "AE306", "capability-version", "dependencies", "a required capability has another version"
    ),
    DiagnosticCode(
        "AE307",
        "interface-not-kept",
        "dependencies",
        "an alternative does not keep the interface of the capability that it provides",
    ),
    # AE4xx: permission
    DiagnosticCode(
        "AE401",
        "kind-not-permitted",
        "permission",
        "a skill may ask for an action kind that its module has no permission for",
    ),
    DiagnosticCode(
        "AE402", "actuator-not-declared", "permission", "an action moves an actuator that is not declared"
    ),
    DiagnosticCode(
        "AE403", "permission-exceeded", "permission", "an envelope reaches beyond the module's permission"
    ),
    DiagnosticCode(
        "AE404", "access-not-granted", "permission", "a module asks for access that the site does not grant"
    ),
    DiagnosticCode(
        "AE405",
        "sensor-not-permitted",
        "permission",
        "a condition or perceiver reads a sensor the module may not use",
    ),
    DiagnosticCode("AE406", "risk-above-ceiling", "permission", "a skill's risk is above the site's ceiling"),
    DiagnosticCode(
        "AE407", "risk-understated", "permission", "a skill declares less risk than its actions carry"
    ),
    DiagnosticCode(
        "AE408", "blocked", "permission", "an operator override blocks the module, a skill or an action"
    ),
    DiagnosticCode("AE409", "empty-permission", "permission", "a permission allows no action at all"),
    DiagnosticCode(
        "AE410",
        "actuator-not-held",
        "permission",
        "a skill moves an actuator that it does not hold as a resource",
    ),
    DiagnosticCode(
        "AE411", "channel-not-permitted", "permission", "an action uses a channel that is not permitted"
    ),
    # AE5xx: safety
    DiagnosticCode(
        "AE501", "invariant-violated", "safety", "a skill may ask for an action that breaks an invariant"
    ),
    DiagnosticCode(
        "AE502", "dead-action", "safety", "a skill asks for an action kind of which no action is ever allowed"
    ),
    DiagnosticCode(
        "AE503", "empty-envelope", "safety", "an envelope contains no action, so proofs about it say nothing"
    ),
    DiagnosticCode("AE504", "precondition-never-holds", "safety", "a skill could never start"),
    DiagnosticCode(
        "AE505",
        "needless-runtime-check",
        "safety",
        "an invariant is listed under `gated` although it is proved",
    ),
    DiagnosticCode(
        "AE506", "state-independent-rule", "safety", "a rule under `gated` does not depend on the state"
    ),
    DiagnosticCode("AE507", "goal-never-holds", "safety", "a task could never reach its goal"),
    DiagnosticCode("AE508", "goal-always-holds", "safety", "a task's goal is reached by doing nothing"),
    DiagnosticCode("AE509", "undecided", "safety", "the solver ran out of its budget or its time"),
    DiagnosticCode(
        "AE510",
        "hold-contradiction",
        "safety",
        "a skill's hold-condition contradicts its start or its success",
    ),
    DiagnosticCode(
        "AE511", "model-bound-violated", "safety", "a model's output can leave a bound that is declared"
    ),
    DiagnosticCode(
        "AE512", "increment-out-of-range", "safety", "an outcome can count a number beyond its range"
    ),
    DiagnosticCode(
        "AE513",
        "effect-contradicts-definition",
        "safety",
        "an outcome changes a quantity and not the predicates that are defined by it",
    ),
    # AE6xx: policy
    DiagnosticCode("AE601", "unsatisfiable-policy", "policy", "no action of a kind is ever allowed"),
    DiagnosticCode(
        "AE602", "stop-not-always-allowed", "policy", "the protective stop is denied in some state"
    ),
    DiagnosticCode("AE603", "vacuous-rule", "policy", "a rule can never deny anything"),
    DiagnosticCode("AE604", "shadowed-rule", "policy", "a rule denies only what other rules already deny"),
    DiagnosticCode(
        "AE605", "attenuation-not-allowed", "policy", "an attenuated action would still be denied"
    ),
    DiagnosticCode(
        "AE606", "attenuation-enlarges", "policy", "an attenuation can enlarge an action or reverse its sign"
    ),
    DiagnosticCode(
        "AE607", "no-protective-stop", "policy", "a site does not have exactly one protective stop"
    ),
    DiagnosticCode("AE608", "infeasible-quota", "policy", "a quota can never be kept"),
    DiagnosticCode("AE609", "idle-quota", "policy", "a quota counts actions that are never allowed"),
    DiagnosticCode("AE610", "redundant-quota", "policy", "a quota never runs out before another one does"),
    DiagnosticCode(
        "AE611",
        "tracking-beyond-clearance",
        "policy",
        "the robot may be farther from its commands than the clearance of whole motions allows for",
    ),
    DiagnosticCode(
        "AE612",
        "contact-too-fast",
        "policy",
        "the robot may touch a person faster than the transient force of a contact permits",
    ),
    # AE7xx: decisions
    DiagnosticCode("AE701", "malformed-request", "decision", "a request is malformed"),
    DiagnosticCode(
        "AE702", "unknown-field", "decision", "a request holds a name that is not in the vocabulary"
    ),
    DiagnosticCode("AE703", "missing-value", "decision", "a value that a rule needs is missing"),
    DiagnosticCode("AE704", "wrong-type", "decision", "a value has the wrong type or is not finite"),
    DiagnosticCode("AE705", "out-of-range", "decision", "a value is outside its declared range"),
    DiagnosticCode("AE706", "stale", "decision", "a measured value is too old"),
    DiagnosticCode("AE707", "from-the-future", "decision", "a measured value has a time in the future"),
    DiagnosticCode("AE710", "operator-block", "decision", "an operator override forbids the action"),
    DiagnosticCode("AE720", "not-active", "decision", "the module or skill is not active"),
    DiagnosticCode("AE730", "outside-envelope", "decision", "the action is outside the skill's envelope"),
    DiagnosticCode(
        "AE731", "outside-permission", "decision", "the action is outside the module's permission"
    ),
    DiagnosticCode(
        "AE740",
        "no-access",
        "decision",
        "the action moves an actuator, or uses a channel, that the module or skill may not use",
    ),
    DiagnosticCode("AE741", "risk-above-ceiling", "decision", "the action carries more risk than is allowed"),
    DiagnosticCode("AE742", "quota-exhausted", "decision", "a quota has run out"),
    DiagnosticCode("AE750", "invariant", "decision", "the action breaks an invariant"),
    DiagnosticCode(
        "AE751",
        "joint-invariant",
        "decision",
        "the action breaks a joint invariant together with an action under way",
    ),
    DiagnosticCode(
        "AE752", "actuator-in-use", "decision", "the action moves an actuator that is already moving"
    ),
    DiagnosticCode(
        "AE760", "malformed-motion", "decision", "the planned motion is incomplete, malformed or not smooth"
    ),
    DiagnosticCode(
        "AE761",
        "misplaced-motion",
        "decision",
        "a motion does not start where the robot is or end where asked",
    ),
    DiagnosticCode(
        "AE762", "motion-beyond-limits", "decision", "a motion may exceed a limit of joints, tool or base"
    ),
    DiagnosticCode(
        "AE763",
        "motion-meets-barrier",
        "decision",
        "a link may enter a volume that it must avoid, or leave the one it must stay in",
    ),
    DiagnosticCode(
        "AE764",
        "second-motion",
        "decision",
        "a second motion cannot be decided together with the one under way",
    ),
    DiagnosticCode(
        "AE765", "links-meet", "decision", "a link may come too near to another link of the robot"
    ),
    DiagnosticCode(
        "AE766",
        "obstacle-in-the-way",
        "decision",
        "a link may come too near to something that a picture shows and nobody declared",
    ),
    DiagnosticCode("AE790", "undecided", "decision", "the solver could not decide"),
    # AE8xx: the closed loop
    DiagnosticCode(
        "AE801", "precondition-not-met", "closed-loop", "a planning rule calls a skill that may not start"
    ),
    DiagnosticCode(
        "AE802",
        "dead-end",
        "closed-loop",
        "planning rules can lead to a state from which the goal is out of reach",
    ),
    DiagnosticCode(
        "AE803",
        "not-analysed",
        "closed-loop",
        "a task's rules compare quantities in a way that is not analysed, or its loop is too large",
    ),
    DiagnosticCode(
        "AE804", "invariant-not-kept", "closed-loop", "a task can reach a state that violates its invariant"
    ),
    DiagnosticCode("AE805", "nothing-to-do", "closed-loop", "a task's goal already holds at its start"),
    DiagnosticCode(
        "AE806",
        "impossible-start",
        "closed-loop",
        "a task's start states a predicate and other values that its definition excludes",
    ),
    # AE85x: compositions
    DiagnosticCode(
        "AE851", "step-not-ready", "composition", "a step may start where its precondition does not hold"
    ),
    DiagnosticCode("AE852", "flow-mismatch", "composition", "an output does not fit the input that takes it"),
    DiagnosticCode(
        "AE853",
        "output-not-there",
        "composition",
        "an input takes the output of a step that may not have run",
    ),
    DiagnosticCode(
        "AE854",
        "unhandled-failure",
        "composition",
        "a step may fail, and the composition does not say how to continue",
    ),
    DiagnosticCode(
        "AE855", "unreachable-step", "composition", "a step or handler of a composition can never run"
    ),
    DiagnosticCode("AE856", "handler-cycle", "composition", "failure handlers lead back to each other"),
    DiagnosticCode(
        "AE857",
        "uncovered-case",
        "composition",
        "an `if` without `else` may be reached while its condition is false",
    ),
    DiagnosticCode(
        "AE858", "resource-shared", "composition", "parallel branches need more of a resource than there is"
    ),
    DiagnosticCode("AE859", "actuator-shared", "composition", "parallel branches move the same actuator"),
    DiagnosticCode(
        "AE860", "interference", "composition", "a parallel branch writes what another reads or writes"
    ),
    DiagnosticCode(
        "AE861", "joint-invariant-violated", "composition", "two parallel actions together break an invariant"
    ),
    DiagnosticCode(
        "AE862", "too-many-paths", "composition", "a composition has more paths than AEROS explores"
    ),
    DiagnosticCode(
        "AE863", "part-never-succeeds", "composition", "a part under `hold` or `timeout` fails in every run"
    ),
    DiagnosticCode("AE864", "plan-too-large", "composition", "a composition is larger than the agent runs"),
    # AE88x: configurations
    DiagnosticCode("AE881", "same-module-twice", "configuration", "two modules have the same name"),
    DiagnosticCode("AE882", "ambiguous-word", "configuration", "one word leads to tasks of two modules"),
    DiagnosticCode("AE883", "capability-twice", "configuration", "two modules provide the same capability"),
    DiagnosticCode(
        "AE884",
        "inconsistent-dependency",
        "configuration",
        "a configuration lacks a version that all its modules accept",
    ),
    DiagnosticCode(
        "AE885", "opposed-effects", "configuration", "two modules always set a variable to different values"
    ),
    DiagnosticCode(
        "AE886",
        "absent-module",
        "configuration",
        "the policy or a setting names a module or skill that is not in the configuration",
    ),
    # AE9xx: certificates
    DiagnosticCode("AE901", "certificate-missing", "certificate", "a module has no certificate"),
    DiagnosticCode(
        "AE902",
        "certificate-stale",
        "certificate",
        "a certificate does not match the module, site, verifier or solver",
    ),
    DiagnosticCode(
        "AE903", "certificate-tampered", "certificate", "a certificate's contents do not match its digest"
    ),
    DiagnosticCode("AE904", "certificate-unwritable", "certificate", "a certificate could not be written"),
    # AE95x: differences
    DiagnosticCode("AE951", "newly-allowed", "difference", "a change allows something that was denied"),
    DiagnosticCode("AE952", "newly-denied", "difference", "a change denies something that was allowed"),
    DiagnosticCode(
        "AE953",
        "not-comparable",
        "difference",
        "two versions have different parameters, inputs or measurements",
    ),
    DiagnosticCode("AE954", "otherwise-changed", "difference", "a change is not compared by what it allows"),
    # AE96x: what is installed on a robot
    DiagnosticCode("AE960", "not-now", "registry", "a command does not fit the state of a module or block"),
    DiagnosticCode("AE961", "bundle-unusable", "registry", "a module's files cannot be stored"),
    DiagnosticCode(
        "AE962",
        "same-version",
        "registry",
        "a module has the version of an installed one and different contents",
    ),
    DiagnosticCode("AE963", "not-as-pinned", "registry", "a module's files do not have the pinned digest"),
    DiagnosticCode(
        "AE964", "inactive-dependency", "registry", "an active module needs one that is not active"
    ),
    DiagnosticCode(
        "AE965", "registry-unusable", "registry", "the registry or a stored file is damaged or was changed"
    ),
    DiagnosticCode(
        "AE966", "still-moving", "registry", "an action of the old configuration did not end in time"
    ),
    DiagnosticCode("AE967", "downgrade", "registry", "a module is older than the installed version"),
)

CODES: Final[dict[str, DiagnosticCode]] = {code.id: code for code in _TABLE}
"""Every registered code by id, in order."""


@dataclass(frozen=True, slots=True)
class SpanLabel:
    """Place to show, with a text next to it.

    Attributes:
        span: the place.
        text: the text; may be empty.
    """

    span: SourceSpan
    text: str = ""


@dataclass(frozen=True, slots=True)
class Fix:
    """Replacement of a text.

    Attributes:
        span: the text to replace.
        text: the new text.
    """

    span: SourceSpan
    text: str


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One complete problem: the error, its place and its remedy.

    Attributes:
        code: code, as `AE014`.
        primary: label of the main place; None if the problem has no place in a file.
        secondary: labels of related places.
        severity: only an ERROR refuses.
        headline: lower case, one sentence, the user's names in backticks.
        notes: one paragraph each; a line break inside is kept.
        help: likewise, each with something to do.
        fix: the text to write instead, if it is known to solve the problem.
    """

    code: str
    headline: str
    primary: SpanLabel | None = None
    secondary: tuple[SpanLabel, ...] = ()
    notes: tuple[str, ...] = ()
    help: tuple[str, ...] = ()
    severity: Severity = Severity.ERROR
    fix: Fix | None = None

    def __post_init__(self) -> None:
        if self.code not in CODES:
            raise MisuseError(f"diagnostic code {self.code!r} is not in the registry")

    @property
    def sort_key(self) -> tuple[str, int, int, str, str]:
        """Key that sorts by file, then position; a problem without a place comes first."""
        if self.primary is None:
            return ("", -1, -1, self.code, self.headline)
        span = self.primary.span
        return (span.source.path, span.start, span.end, self.code, self.headline)


class Diagnostics:
    """Collection of problems, each once; iterates in the order of files and positions.

    A hostile file can hold a problem per character, so only the first `limit` of each severity are kept; the
    rest is counted in `dropped`.
    """

    def __init__(self, limit: int = 200) -> None:
        self._limit = limit
        self._kept: dict[Diagnostic, None] = {}
        self._counts: Counter[Severity] = Counter()
        self.dropped = 0

    def report(self, diagnostic: Diagnostic) -> None:
        """Keep a diagnostic, unless it is known already or its severity has reached the limit.

        Args:
            diagnostic: the problem.
        """
        if diagnostic in self._kept:
            return
        if self._counts[diagnostic.severity] >= self._limit:
            self.dropped += 1
            return
        self._counts[diagnostic.severity] += 1
        self._kept[diagnostic] = None

    def error(
        self,
        code: str,
        headline: str,
        at: SourceSpan | None = None,
        label: str = "",
        *,
        secondary: Iterable[SpanLabel] = (),
        notes: Iterable[str] = (),
        help: Iterable[str] = (),  # noqa: A002  the name a reader of diagnostics expects
    ) -> None:
        """Report an ERROR at one place.

        Args:
            code: registered id, as `AE101`.
            headline: the problem, in one sentence.
            at: its place; None if it has none.
            label: text shown next to that place.
            secondary: further places.
            notes: explanations.
            help: remedies.

        Raises:
            MisuseError: the code is not registered.
        """
        primary = None if at is None else SpanLabel(at, label)
        self.report(Diagnostic(code, headline, primary, tuple(secondary), tuple(notes), tuple(help)))

    def extend(self, others: Diagnostics) -> None:
        """Report all problems of another collection, and count those that it dropped.

        Args:
            others: the other collection.
        """
        for diagnostic in others._kept:
            self.report(diagnostic)
        self.dropped += others.dropped

    @property
    def has_errors(self) -> bool:
        """True if anything is refused."""
        return self._counts[Severity.ERROR] > 0

    @property
    def is_full(self) -> bool:
        """True if further errors would only be counted, so that looking on is pointless."""
        return self._counts[Severity.ERROR] >= self._limit

    def raise_if_errors(self) -> None:
        """Refuse if there is an error.

        Raises:
            UserError: with all diagnostics, if any of them is an ERROR.
        """
        if self.has_errors:
            raise UserError(self)

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(sorted(self._kept, key=lambda diagnostic: diagnostic.sort_key))

    def __len__(self) -> int:
        return len(self._kept)


_LONGEST_NAME = 64  # difflib is quadratic, and no name of ours is longer


def did_you_mean(name: str, candidates: Iterable[str]) -> str | None:
    """Suggest the candidate that a misspelt name probably stands for.

    Args:
        name: unknown name.
        candidates: known names.

    Returns:
        The nearest candidate; None if none is near, or if the name has more than 64 characters.
    """
    if len(name) > _LONGEST_NAME:
        return None
    import difflib

    nearest = difflib.get_close_matches(name, sorted(candidates), n=1, cutoff=0.6)
    return nearest[0] if nearest else None


def quoted(text: str, longest: int = 60) -> str:
    """Quote text of the user in backticks, shortened so that it does not swamp the sentence around it.

    Args:
        text: any text.
        longest: greatest number of characters.

    Returns:
        The quoted text, with `…` at its end if it was shortened.
    """
    return f"`{text}`" if len(text) <= longest else f"`{text[: longest - 1]}…`"
