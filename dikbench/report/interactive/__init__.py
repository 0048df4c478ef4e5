"""The part of the page that one plays: its rows, its controls, its charts, its runs."""
