"""The elements, the text and the scripts of an HTML page."""

from html.parser import HTMLParser


class Page(HTMLParser):
    """The content of an HTML page, in file order.

    Attributes:
        elements: Tags with their attributes.
        skeleton: Tags with the names of their attributes, end tags, comments, declarations and instructions.
        words: Pieces of text outside scripts and styles.
        prose: Text outside scripts, styles and code.
        scripts: Texts of scripts and styles.
    """

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.skeleton: list[tuple[str, tuple[str, ...]]] = []
        self.words, self.scripts, self.prose = list[str](), list[str](), ""
        self._inside, self._code = "", False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self.skeleton.append((tag, tuple(name for name, _ in attrs)))
        self._inside, self._code = tag, self._code or tag == "code"

    def handle_endtag(self, tag: str) -> None:
        self.skeleton.append((f"/{tag}", ()))
        self._inside, self._code = "", self._code and tag != "code"

    def handle_data(self, data: str) -> None:
        if self._inside in ("script", "style"):
            self.scripts.append(data)
            return
        self.words.append(data)
        self.prose += data * (not self._code)

    def handle_comment(self, data: str) -> None:
        self.skeleton.append(("comment", ()))

    def handle_decl(self, decl: str) -> None:
        self.skeleton.append(("declaration", ()))

    def handle_pi(self, data: str) -> None:
        self.skeleton.append(("instruction", ()))

    def unknown_decl(self, data: str) -> None:
        self.skeleton.append(("declaration", ()))

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())

    def all(self, tag: str) -> list[dict[str, str | None]]:
        """Return the attributes of every element with a tag."""
        return [attributes for name, attributes in self.elements if name == tag]
