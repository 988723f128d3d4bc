"""The examples of the pages, as whole documents."""


def document(example: str) -> str:
    """An example as a URDF; see `urdfkin.urdf.lint.pages.Page`."""
    text = example.strip("\n")
    if not text.startswith(("<joint", "<link", "<material", "<!--")):
        return example
    links = '<link name="base"/>\n<link name="tip"/>\n' if text.startswith(("<joint", "<!--")) else ""
    return f'<robot name="example">\n{links}{text}\n</robot>\n'
