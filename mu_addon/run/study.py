"""A study is declared once, as a class: its inputs, its stages, and what it shows.

    @attrs.frozen
    class Ring(Study):
        \"\"\"Stiffness of an elastic ring pressed between plates.\"\"\"

        name = "ring"
        files = {"curve.csv": "force against closing"}
        radius_mm: float = setting(described("radius_mm", 12.5, "mean radius", unit="mm", low=1, high=100))

        @stage("bending stiffness", seconds=0.1)
        def stiffness(self, radius_mm: float) -> float: ...

        @section("result", "Result")
        def result(self, stiffness: float) -> Iterator[Part]: ...

Command, inputs' file, node, plan, cache, resume, report and summary follow (`execution`, `cli.studies`,
`report.study_report`, `nodes.studies`). The parameters of a stage name what it needs: inputs, values
derived from them, results of other stages. Nothing else can make its cached result stale. A declaration
imports public faces of packages alone, which load when they are used.
"""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self

import attrs

from ..errors import InputError
from ..generators import value_of
from ..reading import file_bytes, parse_toml
from ..toml_reader import TomlTable
from .folder import RUN, FolderLayout
from .inputs import FORMAT, INPUTS, digest, read_inputs

if TYPE_CHECKING:
    from .context import RunContext
    from .progress import Progress

_INPUT, _STAGE, _DERIVED, _SECTION = "input", "_stage", "_derived", "_section"
_NONE: Mapping[str, Any] = MappingProxyType({})
TELL = "tell"
"""Parameter by which a stage reports its progress: see `Tell`."""
TARGETS = "stages"
"""Key of the table [run] for the targets of this run, where the folder has further ones."""
REPORT_S = 5.0
"""Expected seconds of a report on two cores."""


@attrs.frozen
class Written:
    """An input in files: keys that decide results, keys of the table [run], texts of other files by name."""

    keys: Mapping[str, Any] = attrs.field(factory=dict)
    run: Mapping[str, Any] = attrs.field(factory=dict)
    files: Mapping[str, str] = attrs.field(factory=dict)


@attrs.frozen
class Input:
    """One input of a study. kind: how faces ask for it; "setting" for a plain value.

    descriptions: of the plain values that it is, or is made of (`design.quantity.Description`); none where
    faces ask for it in their own way. decides: False for one that decides no figure, such as a number of
    processes: it is in no key, and in the table [run] of the inputs' file. option: its name in a command, if
    it is not that of the description; argument: what stands for it where it is no option but a word in its
    place; required: no command does without the option; repeated: the option may stand several times, and
    the value is a list; metavar: stands for its value there; many: it takes several words, or so many;
    alone: its value where the option stands without one; path: "file" or "folder" if it names one; group: as
    that of its description, which may say none; target: the first of a study's targets that has it; value:
    makes the input of its plain value, where they differ, and raises InputError. An input of another kind
    overrides `made`, `write` and `read`.
    """

    kind: str
    descriptions: tuple[Any, ...] = ()
    decides: bool = True
    option: str = ""
    argument: str = ""
    required: bool = False
    repeated: bool = False
    metavar: str | tuple[str, ...] | None = None
    many: bool | int = False
    alone: str = ""
    path: str = ""
    group: str = ""
    target: str = ""
    value: Callable[[Any], Any] | None = None

    @property
    def title(self) -> str:
        """Title below which faces fold it; "" for a usual one, which they always show."""
        return self.group or (self.descriptions[0].group if self.descriptions else "")

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> Any:
        """The input of its plain values; given: the inputs before it. Raises InputError."""
        return values[0] if self.value is None else self.value(values[0])

    def write(self, name: str, value: Any) -> Written:
        """The value in the inputs' files; an attrs class is a table."""
        value = attrs.asdict(value) if attrs.has(type(value)) else value
        return Written({name: value}) if self.decides else Written(run={name: value})

    def read(self, name: str, found: Found) -> Any:
        """The value, its keys taken out of what was found; raises InputError.

        Without a method of its own, the key is read as the type of the study's field.
        """
        raise NotImplementedError

    def file_names(self, name: str) -> tuple[str, ...]:
        """Names of the further files that it may have."""
        return ()

    def same(self, value: Any, other: Any) -> bool:
        """Return True if two values give the same results."""
        return bool(value == other)


@attrs.frozen
class ReadInput(Input):
    """What is read from files that other inputs name; no face asks for it: `Study.complete` reads it.

    of: reads it, of the study with all other inputs; raises InputError. The result's `hash()` is with the
    inputs, and a folder refuses files of another content, which `what` names. Its field is None by default:
    inputs written so take what the files hold when they are read, such as a recording in progress.
    """

    kind: str = "read"
    of: Callable[[Any], Any] = lambda study: None
    what: str = "data"

    def write(self, name: str, value: Any) -> Written:
        """Its hash."""
        return Written() if value is None else Written({f"{name}_sha256": value.hash()})

    def read(self, name: str, found: Found) -> None:
        """Nothing: its hash is taken out, and compared by `require` once all else is read."""
        found.before[name] = found.keys.pop(f"{name}_sha256", None)

    def require(self, name: str, value: Any, found: Found) -> None:
        """Raise InputError if it is not what it was."""
        if found.before[name] in (None, value.hash()):
            return
        places = [p for named in found.run.values() for p in (named if isinstance(named, list) else [named])]
        raise InputError(
            f"the {self.what} changed since the run was made",
            ", ".join(p for p in places if isinstance(p, str)),
            "restore what was there, or use a separate folder for this",
        )


@attrs.frozen
class Found:
    """Inputs as they are found: their file, its keys, those of its table [run], the inputs read so far.

    text: of the file. before: hashes of what was read from other files (`ReadInput`). replaced: names of
    inputs whose values options of a command replace; target: whose table the keys are of.
    """

    path: Path
    keys: dict[str, Any]
    run: dict[str, Any]
    text: str = ""
    given: dict[str, Any] = attrs.field(factory=dict)
    before: dict[str, Any] = attrs.field(factory=dict)
    replaced: tuple[str, ...] = ()
    target: str = ""

    @property
    def table(self) -> TomlTable:
        """Its keys, with their places."""
        return TomlTable(self.keys, str(self.path), self.text, self.target)

    def take(self, key: str, hint: Any, default: Any = attrs.NOTHING) -> Any:
        """The value of a key as a type, taken out of the keys; raises InputError."""
        found = self.table.take(key, hint, default)
        self.keys.pop(key, None)
        return found


def setting(description: Any, **more: Any) -> Any:
    """attrs field of an input that is a plain value, of the description's name, default and bounds.

    more: of the `Input`.
    """
    given = Input("setting", (description,), **more)
    return attrs.field(
        default=description.default, converter=description.checked, metadata={_INPUT: given}, kw_only=True
    )


def given(one: Input, **more: Any) -> Any:
    """attrs field of an input of another kind."""
    return attrs.field(metadata={_INPUT: one}, kw_only=True, **more)


Growth = Generator[Sequence[Any] | str, Any, Any]
"""Yields members of a set, and is sent their results; or a stage's name, and is sent that stage's result."""


def grown(growth: Growth, results: Mapping[Any, Any]) -> Any:
    """The value of a set's growth (`Over.grows`) with these results by member."""
    return value_of(growth, lambda asked: [results[member] for member in asked])


@attrs.frozen
class Over:
    """The set that a stage is repeated over.

    names: of the stage's parameters that a member gives, one or several; members: the members of a study, in
    order; gives: of a member, the values of these parameters, where they are not the member itself: its
    result depends on them. needs: of a member, by parameter, the one member or the list of members of a
    stage's set that it takes; a parameter that is not there takes the whole set. A stage that names itself
    takes earlier members. grows: of a study, a generator that yields members, new ones among them, and is
    sent their results once all are made; Dropped is raised in it, and ends it, if one has none. It may yield
    the name of a stage before its own: to begin with likely members, and add those that its result asks for.
    Its value is that of `grown`. most: the expected number of members of a set that grows; after: names of
    stages whose results `grows` takes after the study, once they are made. choose: of the members that could
    be made now, those that are worth it, the first one first, from the results so far; what is never chosen
    has no result.
    """

    names: tuple[str, ...]
    members: Callable[[Any], Sequence[Any]]
    needs: Callable[[Any, Any], Mapping[str, Any]] = lambda study, member: {}
    gives: Callable[[Any, Any], Mapping[str, Any]] | None = None
    grows: Callable[..., Growth] | None = None
    most: Callable[[Any], int] = lambda study: 0
    after: tuple[str, ...] = ()
    choose: Callable[[Any, Sequence[Any], Members], Sequence[Any]] | None = None


@attrs.frozen
class Stage:
    """A stage of a study, one result or one for each member of a set.

    title: of its progress, with a set's names in braces; members of one title are one stage to a user.
    seconds: expected on two cores, of the study and a title; of a set, for all members of one title.
    revision: raise it when a change of the code changes the result. over: the set. wanted: False of a study
    that does without it. kept: in the cache, which needs a result of the type that the method declares, of
    arrays, numbers, texts and attrs classes of these; else it is made in each run. failing: words for a
    warning; an error of the stage then does not end the run, and what needs it is left out. parallel:
    `execution.py` may hand members to processes of their own, the study's `workers`, side by side with all
    other parallel stages, the first ones first, or to the workers of its `scheduler`. again: True of a study
    and a result that an earlier run kept and this one makes anew. says: a few words on a result, for its
    progress. doing: words, of a study and a member, on what is made, for a progress that waits for it.
    """

    name: str
    method: Callable[..., Any]
    title: str
    seconds: Callable[[Any, str], float]
    revision: int = 1
    over: Over | None = None
    wanted: Callable[[Any], bool] = lambda study: True
    kept: bool = True
    failing: str = ""
    parallel: bool = False
    again: Callable[[Any, Any], bool] | None = None
    says: Callable[[Any], str] | None = None
    doing: Callable[[Any, Any], str] | None = None

    def __attrs_post_init__(self) -> None:
        if self.parallel and not self.kept:
            raise TypeError(f"stage {self.title!r}: what another process makes must be kept")

    @property
    def needs(self) -> tuple[str, ...]:
        """Names of what it takes, without those that a member gives."""
        own = self.over.names if self.over else ()
        return tuple(p for p in parameters_of(self.method) if p not in own and p != TELL)

    def may_lack(self, name: str) -> bool:
        """Return True if it is made without the result of another stage too: a parameter None by default."""
        return not parameters_of(self.method)[name]

    def of_member(self, member: Any) -> dict[str, Any]:
        """The parameters that a member of its set is."""
        if self.over is None:
            return {}
        if self.over.gives:
            return {"member": member}
        return dict(zip(self.over.names, member if len(self.over.names) > 1 else (member,), strict=True))

    def given_by(self, study: Any, member: Any) -> Mapping[str, Any]:
        """The parameters that a member of its set gives."""
        gives = self.over.gives if self.over else None
        return gives(study, member) if gives else self.of_member(member)

    def title_of(self, member: Any) -> str:
        """Its title, for a member of its set."""
        return self.title.format(**self.of_member(member))

    @property
    def result_type(self) -> Any:
        """The type of its result, as the method declares it."""
        return typing.get_type_hints(self.method)["return"]


def stage(
    title: str, seconds: float | Mapping[str, float] | Callable[[Any], float] = 0.1, **more: Any
) -> Callable[[Any], Any]:
    """A method that makes one result, or one for each member of a set; its `self` is None.

    seconds: one number, of the study, or by title; more: of the `Stage`.
    """

    def mark(method: Any) -> Any:
        def in_time(study: Any, of: str) -> float:
            known = seconds[of] if isinstance(seconds, Mapping) else seconds
            return known(study) if callable(known) else known

        setattr(method, _STAGE, Stage(method.__name__, method, title, in_time, **more))
        return method

    return mark


def intermediate(over: Over | None = None, **more: Any) -> Callable[[Any], Any]:
    """A method that makes something in memory, such as a model, whenever a stage takes it; it is not kept."""
    return stage("", kept=False, over=over, **more)


def derived(method: Any) -> Any:
    """A method that gives a part of an input, in milliseconds: a stage that takes it depends on that part."""
    setattr(method, _DERIVED, True)
    return method


@attrs.frozen
class Section:
    """A section of what a study shows. needed: parameters without which it is left out."""

    key: str
    title: str
    method: Callable[..., Iterator[Any]]
    order: int = 0

    @property
    def parameters(self) -> dict[str, bool]:
        """Names of what it shows, and whether it cannot do without."""
        return parameters_of(self.method)


def section(key: str = "", title: str = "", order: int = 0) -> Callable[[Any], Any]:
    """A method that yields parts; its parameters name what it shows, None by default where it may lack.

    key, title: of the report's section; without, it leads. Sections of one key are one. order: sections of a
    lower number come first, those of one as they are declared. It is called whenever one of them is new: it
    takes milliseconds.
    """

    def mark(method: Any) -> Any:
        setattr(method, _SECTION, Section(key, title, method, order))
        return method

    return mark


@attrs.frozen
class Node:
    """The node of a study: menu, text, outputs as (name, type, text); remark: on a finished run's summary.

    label: in menus, if not the name of the class; read: its outputs by name, of a finished run (folder,
    summary and study) and the node's call, where they are not that run; answers: a verdict in the summary is
    a result, even if the run ends with an error because of it; hidden: inputs that the node leaves at their
    defaults; shown: the inputs that it asks for, if not all others; settings: of the node alone; no_body:
    names the study in the error of a unit with a body of its own, which it does not take. continues: socket
    of a finished run of the same study, whose other inputs and cache it takes. passes: socket that a muted
    node passes on as its output, and what that does, as text.
    """

    category: str
    text: str
    outputs: tuple[tuple[str, str, str], ...]
    remark: Callable[[Mapping[str, Any]], str]
    label: str = ""
    read: Callable[[Any, Any], Mapping[str, Any]] | None = None
    answers: bool = False
    hidden: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    settings: tuple[Any, ...] = ()
    no_body: str = ""
    continues: str = ""
    passes: tuple[str, str] = ("", "")


@attrs.frozen
class Tell:
    """How a stage reports its progress: call it with the share done, 0 to 1.

    cache: the run's folder for what core functions keep by keys of their own.
    """

    progress: Progress
    cache: Path

    def __call__(self, share: float, detail: str = "") -> None:
        """Report the share done, and a few words on the last step."""
        self.progress.update(share, detail)

    def made(self, size: str) -> None:
        """Report the size of the result, such as "6210 nodes", at the stage's end."""
        self.progress.made(size)


class Dropped(Exception):
    """Raised by a stage: this member of a set has no result, without fault. What needs it is left out."""


class Members(dict[Any, Any]):
    """Results of a set by member; complete: none is missing."""

    complete = True


class Study:
    """Base of all studies; see the module.

    name: of its command; its inputs are in `name`.toml. from_file: of a command that reads such a file, and
    whose options replace values in it: help on the file, and what to do where it cannot be read. files:
    content of each file of the run's folder, by name or pattern; to_fill: files that are filled in by hand,
    which no run removes. example: a command line, "" of a study that is no command. node: None of a study
    that is no node; nodes: in its place by target, of those that are. streams: it has no stages, but does its
    work by itself (`work`), and gives its sections what they show. joins: its folder is one that several
    studies add to, such as one of measured data: it keeps no inputs and no results there, is not resumed, and
    begins to use it with its first file.
    page: name of its report, "" without one.

    commands: of a study of several, its targets, each with help and example by its name, in order of need.
    They share a folder: each has the inputs and stages of those before it, and a table of its own in the
    file of inputs; what a further one made stays valid. file: the name of that file, if it is not that of
    the study; version: the number of its format; header: its first line.
    """

    name: ClassVar[str]
    files: ClassVar[Mapping[str, str]]
    to_fill: ClassVar[tuple[str, ...]] = ()
    from_file: ClassVar[tuple[str, str]] = ("", "")
    example: ClassVar[str] = ""
    node: ClassVar[Node | None] = None
    nodes: ClassVar[Mapping[str, Node]] = _NONE
    streams: ClassVar[bool] = False
    commands: ClassVar[Mapping[str, tuple[str, str]]] = _NONE
    file: ClassVar[str] = ""
    version: ClassVar[int] = FORMAT
    header: ClassVar[str] = ""
    joins: ClassVar[bool] = False
    page: ClassVar[str] = "report.html"

    @property
    def wanted_targets(self) -> tuple[str, ...]:
        """Its targets up to the one that it is run for: its input `stages`; "" alone for a study without."""
        return tuple(getattr(self, "stages", ("",))) if self.commands else ("",)

    @property
    def command(self) -> str:
        """Name of the command that runs it: that of its last target, if it has any."""
        return self.wanted_targets[-1] or self.name

    @property
    def processes(self) -> int:
        """Number of processes for its parallel stages: its input `workers`, if it has one."""
        return int(getattr(self, "workers", 1))

    @property
    def elsewhere(self) -> str:
        """Address of a Dask scheduler for its parallel stages: its input `scheduler`, "" without."""
        return str(getattr(self, "scheduler", None) or "")

    def heading(self) -> tuple[str, str]:
        """Title of the report, and the line below it."""
        raise NotImplementedError

    @classmethod
    def node_of(cls, command: str) -> Node | None:
        """The node that runs a command of the study, if there is one."""
        return cls.nodes.get(command, cls.node)

    def work(self, folder: Path, context: RunContext) -> Any:
        """The work of a study that streams, in its folder; it fills `context.summary`."""
        raise NotImplementedError

    # What the declaration says, for the faces.

    @classmethod
    def inputs(cls) -> dict[str, Input]:
        """Its inputs by name."""
        fields = attrs.fields(cls)  # type: ignore[arg-type]
        return {f.name: f.metadata[_INPUT] for f in fields if _INPUT in f.metadata}

    @classmethod
    def all_stages(cls) -> dict[str, Stage]:
        """Its stages by name, each after those that it needs."""
        # One function may be several stages, which differ by their sets.
        return {name: attrs.evolve(one, name=name) for name, one in _marked(cls, _STAGE).items()}

    @classmethod
    def sections(cls) -> list[Section]:
        """Its sections in order."""
        return sorted(_marked(cls, _SECTION).values(), key=lambda one: one.order)

    @classmethod
    def derived(cls) -> dict[str, Any]:
        """Methods of derived values by name."""
        return _marked(cls, _DERIVED, bare=True)

    @classmethod
    def layout(cls) -> FolderLayout:
        """The files of its folder."""
        optional = tuple(file for name, one in cls.inputs().items() for file in one.file_names(name))
        results = (*cls.files, *([cls.page] if cls.page else []))
        header = cls.header or f"# Inputs of `{cls.name}`."
        return FolderLayout(f"{cls.file or cls.name}.toml", header, results, optional, cls.to_fill)

    # What its inputs decide, before a run.

    def require_possible(self) -> None:
        """Raise InputError for what its stages would find out late."""

    @property
    def report_s(self) -> float:
        """Expected seconds of its report on two cores."""
        return REPORT_S

    def bytes_needed(self) -> int:
        """Room that a run takes on the disk at most."""
        return 0

    def expected(self) -> dict[str, float]:
        """Seconds of each stage on two cores by the title of its progress, in order."""
        found: dict[str, float] = {}
        for one in self.all_stages().values():
            if not (one.title and one.wanted(self)):
                continue
            members = [None] if one.over is None or one.over.grows else one.over.members(self)
            for member in members:
                title = one.title if member is None else one.title_of(member)
                if title not in found:
                    found[title] = one.seconds(self, title)
        return found

    def detail(self) -> str:
        """Its name and its choices, which decide how long its stages take."""
        chosen = (n for n, one in self.inputs().items() if one.descriptions and one.descriptions[0].choices)
        return " ".join([self.name, *(str(getattr(self, name)) for name in chosen)])

    def changed(self, before: Study) -> list[str]:
        """Names of the inputs that make its results others than those of the study before."""
        every = self.inputs().items()
        return [n for n, one in every if one.decides and not one.same(getattr(self, n), getattr(before, n))]

    # Inputs as files.

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; none of a study that joins a folder."""
        if self.joins:
            return {}
        tables, run, files = self._written()
        return {self.layout().inputs: self._text(tables, run), **files}

    @property
    def tables(self) -> dict[str, dict[str, Any]]:
        """Keys of the file of inputs that decide results, by target."""
        return self._written()[0]

    def _written(self) -> tuple[dict[str, dict[str, Any]], dict[str, Any], dict[str, str]]:
        """Keys by target, the table [run], and the texts of the other files by name."""
        tables: dict[str, dict[str, Any]] = {target: {} for target in self.wanted_targets}
        run: dict[str, Any] = {}
        files: dict[str, str] = {}
        for name, one in self.inputs().items():
            if one.target not in tables:
                continue
            written = one.write(name, getattr(self, name))
            tables[one.target] |= written.keys
            if self.commands:
                # So that a table says what its target depends on, and a file that was edited is noticed.
                tables[one.target] |= {f"{name}_sha256": digest(t) for t in written.files.values()}
            run |= written.run
            files |= written.files
        return tables, run, files

    @classmethod
    def _text(cls, tables: Mapping[str, Mapping[str, Any]], run: Mapping[str, Any]) -> str:
        from ..toml_writer import toml_text

        own = tables if cls.commands else tables[""]
        return toml_text({"format": cls.version, **own, **({RUN: run} if run else {})}, cls.layout().header)

    def texts_in(self, folder: Path, asked: bool = False) -> tuple[dict[str, str], tuple[str, ...], bool]:
        """Texts for a folder with the inputs of further targets there, those targets, and if it stays valid.

        It stays valid if all targets that both have are of the same inputs; else the texts are these alone.
        asked: the table [run] names the targets of this study. Raises InputError for a file of inputs that
        cannot be used.
        """
        path = folder / self.layout().inputs
        old = self._tables_in(folder)
        if not old:
            return self.texts(), (), False
        tables, run, files = self._written()
        same = all(old[target].values == tables[target] for target in tables if target in old)
        more = self._named_files(path, old) if same else None
        if more is None:
            return {path.name: self._text(tables, run), **files}, (), False
        further = self.further_in(folder, old)
        merged = tables | {target: dict(old[target].values) for target in further}
        run |= {TARGETS: list(tables)} if asked and further else {}
        return {path.name: self._text(merged, run), **more, **files}, further, True

    def further_in(self, folder: Path, tables: Mapping[str, TomlTable] | None = None) -> tuple[str, ...]:
        """Targets of a folder's file of inputs, or of its tables, that this study is not run for."""
        found = self._tables_in(folder) if tables is None else tables
        return tuple(target for target in found if target not in self.wanted_targets)

    @classmethod
    def _tables_in(cls, folder: Path) -> Mapping[str, TomlTable]:
        path = folder / cls.layout().inputs
        return cls.read_tables(path)[0] if cls.commands and path.is_file() else {}

    @classmethod
    def read_tables(
        cls, path: Path, *words: str
    ) -> tuple[dict[str, TomlTable], dict[str, Any], tuple[str, ...]]:
        """Tables of a file of inputs by target, its table [run], and the targets that it is run for.

        words: as those of `read_inputs`. Raises InputError.
        """
        document, run = read_inputs(path, words or INPUTS, cls.version)
        if not cls.commands:
            return {"": document}, run, ("",)
        known = [*cls.commands][: len(document.values)]
        if set(document.values) != set(known) or not known:
            raise InputError(
                f"the tables [{'], ['.join(document.values)}] are not those of a {cls.file}",
                document.at(),
                f"the tables are [{'], ['.join(cls.commands)}], each with those before it",
            )
        tables = {target: document.inner(target) for target in known}
        asked = run.pop(TARGETS, known)
        return tables, run, tuple(target for target in known if target in asked)

    @classmethod
    def _named_files(cls, path: Path, tables: Mapping[str, TomlTable]) -> dict[str, str] | None:
        """Texts of the files that tables name, by name; None where one is not as it was."""
        found = {}
        for name, one in cls.inputs().items():
            sha256 = tables[one.target].values.get(f"{name}_sha256") if one.target in tables else None
            for file in one.file_names(name) if sha256 else ():
                try:
                    found[file] = file_bytes(path.parent / file).decode("utf-8")
                except (OSError, UnicodeDecodeError):
                    return None
                if digest(found[file]) != sha256:
                    return None
        return found

    @classmethod
    def read(cls, folder: Path) -> Self:
        """The study whose inputs are in a folder; raises InputError."""
        return cls.read_file(folder / cls.layout().inputs)

    @classmethod
    def read_file(cls, path: Path, words: Sequence[str] = (), replaced: Mapping[str, Any] = _NONE) -> Self:
        """The study of a file, and of those that it names in its folder; raises InputError.

        words: as those of `read_inputs`. replaced: values of inputs, in place of the file's.
        """
        from ..toml_writer import toml_text

        tables, run, targets = cls.read_tables(path, *words)
        if cls.commands and cls._named_files(path, tables) is None:
            raise InputError(
                "an input file has changed since this study was made",
                str(path.parent),
                "restore it, or start a new study with it in another folder",
            )
        for name, value in replaced.items():
            one = cls.inputs()[name]
            written = one.write(name, value)
            keys, more = (parse_toml(toml_text(table, ""), name) for table in (written.keys, written.run))
            tables[one.target] = attrs.evolve(
                tables[one.target], values={**tables[one.target].values, **keys}
            )
            run |= more
        return cls.of_tables({target: tables[target] for target in targets}, path, run, tuple(replaced))

    @classmethod
    def of_tables(
        cls,
        tables: Mapping[str, TomlTable],
        path: Path,
        run: Mapping[str, Any] = _NONE,
        replaced: tuple[str, ...] = (),
        **given: Any,
    ) -> Self:
        """The study of the tables of a file of inputs by target; see `Found`, whose path this is.

        given: inputs in place of what tables say of them. Raises InputError.
        """
        made: dict[str, Any] = {"stages": tuple(tables)} | given if cls.commands else dict(given)
        known, kept = dict(made), dict(run)
        before: dict[str, Any] = {}
        hints = typing.get_type_hints(cls)
        for target, table in tables.items():
            found = Found(path, dict(table.values), kept, table.text, known, before, replaced, target)
            for name, one in cls.inputs().items():
                if one.target != target or name in given:
                    continue
                if type(one).read is not Input.read:
                    made[name] = known[name] = one.read(name, found)
                    continue
                if not one.decides and name in kept:
                    found.keys[name] = kept[name]
                known[name] = one.descriptions[0].default if one.descriptions else None
                if name in found.keys:
                    plain = one.kind == "setting"
                    value = (
                        found.table.setting(one.descriptions[0]) if plain else found.take(name, hints[name])
                    )
                    found.keys.pop(name, None)
                    made[name] = known[name] = value
            left = [k for k in found.keys if not (cls.commands and k.endswith("_sha256"))]
            own = [n for n, one in cls.inputs().items() if one.target == target and one.decides]
            attrs.evolve(found.table, values=dict.fromkeys(left)).only(own)
        document = TomlTable({}, str(path), next((table.text for table in tables.values()), ""))
        study = document.made(cls, **made).complete()
        for name in before:
            there = Found(path, {}, kept, before=before)
            study._read()[name].require(name, getattr(study, name), there)
        return study

    def complete(self) -> Self:
        """The study with what its files hold (`ReadInput`), as a run needs it; raises InputError."""
        found = {name: one.of(self) for name, one in self._read().items() if getattr(self, name) is None}
        return attrs.evolve(self, **found) if found else self  # type: ignore[misc]

    @classmethod
    def _read(cls) -> dict[str, ReadInput]:
        return {name: one for name, one in cls.inputs().items() if isinstance(one, ReadInput)}


def _marked(cls: Any, mark: str, bare: bool = False) -> dict[str, Any]:
    found = {}
    for part in reversed(cls.__mro__):
        for name, method in vars(part).items():
            if hasattr(method, mark):
                found[name] = method if bare else getattr(method, mark)
    return found


@cache
def parameters_of(method: Any) -> dict[str, bool]:
    """Names of a method's parameters, and whether it cannot do without."""
    parameters = inspect.signature(method).parameters.items()
    return {name: p.default is inspect.Parameter.empty for name, p in parameters if name != "self"}
