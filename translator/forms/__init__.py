"""Forms of values: how the values of a keyword are written, and what they are in the document.

One class for each form: `LineForm` for values on one line, `Form` for anything else. An instance
stands in the row of the keyword and reads, prints and describes its values.
"""
