"""Reports of a validation as HTML, JUnit XML, Markdown and terminal text, and the comparison of two reports.

Every report is made from the JSON document, so it can also be made later and on another machine.
"""
