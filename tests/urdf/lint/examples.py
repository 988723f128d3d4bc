"""Whole documents from the examples of pages."""


def document(example: str) -> str:
    """Return an example as a URDF; see `urdfkin.urdf.lint.pages.Page`."""
    text = example.strip("\n")
    if not text.startswith(("<joint", "<link", "<material", "<!--")):
        return example
    links = '<link name="base"/>\n<link name="tip"/>\n' if text.startswith(("<joint", "<!--")) else ""
    return f'<robot name="example">\n{links}{text}\n</robot>\n'
