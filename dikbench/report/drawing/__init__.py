"""How figures are drawn: styles, labels, panels, scales."""
