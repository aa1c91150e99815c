"""The identification methods: one per file, found by being here.

A new method is one new module with a constant ``METHOD`` (:class:`fric.identification.result.Method`), and its test. Nothing
has to be registered anywhere else.
"""
