"""Reads a page as a browser would: what it fetches, its words, tags that were never closed."""

from html.parser import HTMLParser

FETCHING = ("src", "href", "srcset", "poster", "data", "action", "xlink:href")


class Reader(HTMLParser):
    """Collects what a browser would fetch, the words of the page, and tags that were never closed."""

    def __init__(self):
        super().__init__()
        self.fetched, self.words, self.open = [], [], []

    def handle_starttag(self, tag, attrs):
        self.fetched += [value for name, value in attrs if name in FETCHING]
        if tag not in ("meta", "img", "br", "link", "input"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.fetched += [value for name, value in attrs if name in FETCHING]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open):
            self.words.append(data)


def words_of(path):
    """Return the words of a page, each two with one space between."""
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    return " ".join(" ".join(reader.words).split())
