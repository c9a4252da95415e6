"""`Page`: a whole page, a title and its sections."""

from dataclasses import dataclass

from reports.section import Section


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """What `render` lays out.

    Attributes:
        title: of the window and the first heading.
        subtitle: one line below it.
        sections: in order.
        version: of the program, in the footer.
    """

    title: str
    subtitle: str
    sections: tuple[Section, ...]
    version: str
