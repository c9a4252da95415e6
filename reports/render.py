"""Pages as HTML: one file each, nothing fetched, no script."""

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined

from reports.page import Page


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def render(page: Page) -> str:
    """A complete HTML document; all text in it is escaped, drawings stand as `plots` made them."""
    return _environment().get_template("page.html").render(page=page)
