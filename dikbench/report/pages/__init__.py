"""The pages of a report, HTML and Markdown, and what they say of formulations and families."""
