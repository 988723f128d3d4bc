"""Reports of a validation, and their comparison: HTML, JUnit XML, Markdown, terminal text.

Every report is made from the JSON document. A report can be made later, on another machine.
"""
