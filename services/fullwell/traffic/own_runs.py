"""The user's own SUMO configuration, made fit to run anywhere: its inputs collected, what would write files taken out."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from fullwell.core.hashing import digest_of, sha256_hex
from fullwell.traffic.networks import read_road_file
from fullwell.traffic.sumo import TrafficError
from fullwell.traffic.trajectories import MoverType, mover_type

__all__ = ["OwnRun", "read_configuration"]

Finder = Callable[[str], Path]
"""Returns the file of a reference that is relative to the configuration's folder; raises where it may not be read."""

_MOST_BYTES: Final = 128 << 20
_MOST_FILES: Final = 100

_SYNONYMS: Final[Mapping[str, str]] = {
    "n": "net-file", "net": "net-file", "r": "route-files", "routes": "route-files", "a": "additional-files",
    "additional": "additional-files", "w": "weight-files", "weights": "weight-files", "x": "weight-attribute",
    "measure": "weight-attribute", "b": "begin", "e": "end", "s": "route-steps", "srand": "seed", "abs-rand": "random",
    "railsignal.moving-block": "railsignal-moving-block", "carfollow.model": "default.carfollowmodel",
    "c": "configuration-file",
}  # fmt: skip

_FILES: Final = ("route-files", "additional-files", "weight-files")
_KEPT: Final = re.compile(
    r"weight-attribute|junction-taz|begin|step-length|step-method\.ballistic|extrapolate-departpos|lateral-resolution|route-steps|"
    r"no-internal-links|ignore-[a-z-]+|(intermodal-)?collision\.[a-z.-]+|keep-after-arrival|max-[a-z-]+|scale|scale-suffix|"
    r"time-to-[a-z.-]+|waiting-time-memory|startup-wait-threshold|(sloppy|eager|emergency)-insert|insertion-checks|"
    r"random-depart-offset|lanechange\.[a-z-]+|tls\.[a-z_.-]+|railsignal[a-z.-]+|slope-centered|default\.[a-z-]+|"
    r"emergencydecel\.warning-threshold|parking\.maneuver|use-stop-(ended|started)|"
    r"pedestrian\.(model|timegap-crossing|striping\.[a-z.-]+)|ride\.stop-tolerance|mapmatch\.[a-z]+|weights\.[a-z.-]+|"
    r"routing-algorithm|persontrip\.[a-z.-]+|railway\.max-train-length|replay-rerouting|seed|"
    r"(person-)?device\.(rerouting|bluelight|driverstate|glosa|friction|battery|stationfinder|taxi|toc)\.[A-Za-z.-]+"
)
"""Options that decide how traffic moves."""
_NEVER_KEPT: Final = re.compile(r".*(output|\.file|threads|show-detectors)")
_REFUSED: Final[Mapping[str, str]] = {
    "remote-port": "is driven by a program over a port; run it yourself, and give its fcd-output",
    "load-state": "starts from a saved state; run it yourself, and give its fcd-output",
    "mesosim": "is mesoscopic: its vehicles have no places in a lane. Run it microscopically",
    "device.fcd-replay.files": "replays an fcd-output; give that file instead",
    "configuration-file": "names another configuration; give that one",
}
_TRUE: Final = frozenset({"1", "yes", "true", "on", "x", "t"})
_SILENT: Final = re.compile(
    r"end|.*output.*|save-.*|netstate-dump.*|(message-|error-)?log.*|duration-log.*|(no-)?step-log.*|xml-validation.*|verbose|"
    r"(no|aggregate)-warnings|language|write-.*|precision.*|print-options|human-readable-time|version|help|"
    r"(person-)?device\.(fcd|tripinfo|vehroute|ssm|emissions|example|btreceiver|btsender)\..*|emissions\..*|phemlight-.*|"
    r"gui-.*|quit-on-end|start|delay|game.*|breakpoints|window-.*|registry-viewport|tracker-interval|selection-file|osg-view|"
    r"edgedata-files|alternative-net-file|disable-textures|demo|(.*\.)?threads|thread-rngs|num-clients|.*\.file|.*show-detectors"
)
"""Options about reports and windows: nobody misses them here."""

_WRITERS: Final = frozenset({"timedEvent", "edgeData", "laneData", "meandata", "vTypeProbe"})
_READERS: Final = frozenset({"rerouter", "variableSpeedSign"})
_NOWHERE: Final = "NUL"
"""SUMO opens the system's null device for it."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnRun:
    """A SUMO configuration as texts, which names no file but its own.

    Attributes
    ----------
    network
        Its .net.xml.
    files
        {name in the run's folder: text} of all other inputs.
    options
        {option: value}; network, end and outputs are not among them.
    types
        What the run's types of vehicles are.
    left_out
        Options that were not taken over though they may change the traffic.
    """

    network: Path
    files: Mapping[str, bytes]
    options: Mapping[str, str]
    types: Mapping[str, MoverType] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    @property
    def digest(self) -> str:
        """SHA-256 of all but the network."""
        return digest_of([{name: sha256_hex(text) for name, text in self.files.items()}, dict(self.options)])


def read_configuration(file: Path, find: Finder, *, path: str = "scene.traffic.run.file") -> OwnRun:
    """Return what a .sumocfg runs.

    Inputs are read through `find`. Elements and parameters that write files are taken out or write nowhere; options that
    neither name inputs nor decide how traffic moves are left out.

    Raises
    ------
    TrafficError
        It is damaged, has no network or no traffic, needs something that is not at hand here (a control program, a saved
        state), or an input is missing, damaged or too large.
    """
    options = dict(_options(_tree(file, file.name, path), path))
    for name, reason in _REFUSED.items():
        if options.get(name, "").casefold() not in ("", "false", "0", "-1", "no", "off"):
            raise TrafficError(f"{path} is {file.name!r}, which {reason} (its option {name}).", path, file.name)
    if not options.get("net-file"):
        raise TrafficError(f"{path} is {file.name!r}, which names no net-file. Add it to its <input>.", path, file.name)
    if not options.get("route-files") and not options.get("additional-files"):
        raise TrafficError(f"{path} is {file.name!r}, which names no route-files. Add them to its <input>.", path, file.name)
    inputs = _Inputs(find, path)
    kept: dict[str, str] = {}
    for name in _FILES:
        references = [part.strip() for part in options.get(name, "").split(",") if part.strip()]
        if references:
            kept[name] = ",".join(inputs.add(reference) for reference in references)
    behaviour = {name: value for name, value in options.items() if _KEPT.fullmatch(name) and not _NEVER_KEPT.fullmatch(name)}
    told = ("net-file", *_FILES, *_REFUSED, *behaviour)
    left_out = tuple(name for name in options if name not in told and not _SILENT.fullmatch(name))
    return OwnRun(find(options["net-file"]), inputs.files, kept | behaviour, inputs.types, left_out)


def _tree(file: Path, name: str, path: str) -> ElementTree.Element:
    text = read_road_file(file, path=path, most_bytes=_MOST_BYTES)
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise TrafficError(f"{path}: {name!r} is no readable file of SUMO: {error}.", path, name) from error


def _options(root: ElementTree.Element, path: str) -> Iterator[tuple[str, str]]:
    if root.tag not in ("configuration", "sumoConfiguration"):
        raise TrafficError(f"{path} is no configuration of SUMO: it begins with <{root.tag}>. Give a .sumocfg file.", path)
    for element in root.iter():
        value = element.get("value", element.get("v"))
        if value is not None:
            name = str(element.tag)
            yield _SYNONYMS.get(name, name), value


class _Inputs:
    """Inputs under names of their own, rewritten so that they name each other and write nothing."""

    def __init__(self, find: Finder, path: str) -> None:
        self._find, self._path = find, path
        self._names: dict[Path, str] = {}
        self.files: dict[str, bytes] = {}
        self.types: dict[str, MoverType] = {}

    def add(self, reference: str, *, within: str = "") -> str:
        """Take an input in, with what it includes, and return its name; `within` is the folder of the file that names it."""
        where = reference if not within or reference.startswith("/") else f"{within}/{reference}"
        file = self._find(where)
        if file in self._names:
            return self._names[file]
        if len(self._names) >= _MOST_FILES:
            raise TrafficError(f"{self._path} takes in more than {_MOST_FILES} files. Join them.", self._path)
        name = self._names[file] = f"input_{len(self._names)}.xml"
        root = _tree(file, reference, self._path)
        self._make_safe(root, where.rpartition("/")[0])
        self.files[name] = ElementTree.tostring(root)
        if sum(map(len, self.files.values())) > _MOST_BYTES:
            raise TrafficError(f"{self._path} takes in more than {_MOST_BYTES >> 20} MiB. Shorten the run.", self._path)
        return name

    def _make_safe(self, element: ElementTree.Element, folder: str) -> None:
        self._rewrite(element, folder)
        for child in list(element):
            if child.tag in _WRITERS:
                element.remove(child)
            else:
                self._make_safe(child, folder)

    def _rewrite(self, element: ElementTree.Element, folder: str) -> None:
        values = element.attrib
        for name in [name for name in values if name.startswith("{")] + ["imgFile", "osgFile"]:
            values.pop(name, None)
        if element.tag == "include" and "href" in values:
            values["href"] = self.add(values["href"], within=folder)
        elif element.tag in _READERS and values.get("file"):
            values["file"] = self.add(values["file"], within=folder)
        else:
            values.update({name: _NOWHERE for name in ("file", "output", "dest") if name in values})
        key = values.get("key", "") if element.tag == "param" else ""
        if re.fullmatch(r"(.*\.)?(file|output)", key):
            values["value"] = _NOWHERE
        if element.tag == "vType" and "id" in values:
            self._note_type(values)

    def _note_type(self, values: Mapping[str, str]) -> None:
        length = values.get("length", "")
        length_m = float(length) if re.fullmatch(r"\d+(\.\d+)?", length) else None
        named = values["id"] if not values.get("guiShape") else values["guiShape"]
        found = mover_type(named, vclass=values.get("vClass", ""), length_m=length_m)
        if found is not None:
            self.types[values["id"]] = found
