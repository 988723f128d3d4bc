"""Reports: the JSON document of a validation as HTML, JUnit XML, Markdown and terminal text; and compared.

Everything here starts from the document, so that a report can be rendered later and elsewhere.
"""
