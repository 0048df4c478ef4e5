"""Plug-ins: found through entry points or files, built from selectors."""
