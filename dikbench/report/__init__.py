"""The report: tables, figures and pages, made from a results folder and nothing else."""
