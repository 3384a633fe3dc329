"""Which state of which map an answer speaks of."""

from dataclasses import dataclass, field

from ._fields import Fields, reading
from ._transport.request import Answer


@dataclass(frozen=True)
class Version:
    """A map's revision, one more with each change, and the uuid of the map, another one where it was deleted and made again.

    `content_hash` is a hash of the finest voxels: equal for maps with equal voxels. It is None in an answer that was given again
    after the map has moved on. `state_hash` is a hash of keep-outs and viewpoints too, which a watch alone tells; it does not count
    where versions are compared.
    """

    revision: int
    map_uuid: str
    content_hash: int | None = None
    state_hash: int | None = field(default=None, compare=False)

    @classmethod
    def of(cls, fields: Fields) -> "Version":
        """The version that an answer in JSON names."""
        with reading("the version"):
            hash_text = fields.optional("content_hash", fields.text)
            return cls(fields.whole("revision"), fields.text("map_uuid"), _hash_of(hash_text))

    @classmethod
    def of_headers(cls, answer: Answer) -> "Version":
        """The version that the headers of an answer name."""
        with reading("the headers of the answer"):
            uuid = answer.header("mrol-map-uuid")
            if uuid is None:
                raise KeyError("mrol-map-uuid")
            revision = whole_header(answer, "mrol-revision")
            return cls(revision, uuid, _hash_of(answer.header("mrol-content-hash")))


@dataclass(frozen=True, eq=False)
class Versioned:
    """What all answers about a map have."""

    version: Version
    """The state of the map that was asked, or that a change made."""

    @property
    def revision(self) -> int:
        """The map's revision."""
        return self.version.revision

    @property
    def map_uuid(self) -> str:
        """The map's uuid."""
        return self.version.map_uuid


@dataclass(frozen=True, eq=False)
class InParts(Versioned):
    """What answers about any number of elements have.

    More than a server takes at once are asked about in several requests. Where the map changes between them their answers are of
    different revisions: `version` is that of the last one.
    """

    version_of_first: Version | None = field(default=None, kw_only=True, repr=False)

    @property
    def first_version(self) -> Version:
        """The version of the first part: that of all, where the map did not change meanwhile."""
        return self.version if self.version_of_first is None else self.version_of_first


def whole_header(answer: Answer, name: str) -> int:
    """A header that is a whole number."""
    value = answer.header(name)
    if value is None or not value.isascii() or not value.isdigit() or len(value) > 20:
        raise ValueError(f"{name}: {value!r}")
    return int(value)


def _hash_of(text: str | None) -> int | None:
    return None if text is None else int(text, 16)
